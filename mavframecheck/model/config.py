"""What a configuration file may hold: pure data, read from TOML and checked against these types."""

from __future__ import annotations

from datetime import date
from typing import Literal, TypeAlias

import msgspec

from mavframecheck.model.rule import Severity

Autopilot: TypeAlias = Literal["px4", "arducopter", "arduplane", "ardurover", "ardusub"]
"""Families that a user can name where the recording does not."""
Codes: TypeAlias = tuple[str, ...]
"""Codes, prefixes or names of rules."""


class Suppression(
    msgspec.Struct, frozen=True, kw_only=True, rename="kebab", forbid_unknown_fields=True
):
    """Findings that are known and accepted, and why."""

    rule: str
    reason: str
    stream: str | None = None
    """``1/191 ODOMETRY.q`` or what it begins with; None for all."""
    file: str | None = None
    """Pattern for the path; None for all."""
    until: date | None = None
    """Last day on which it holds."""


class Config(msgspec.Struct, frozen=True, kw_only=True, rename="kebab", forbid_unknown_fields=True):
    """A configuration file; `docs/configuration.md` describes the keys."""

    select: Codes | None = None
    extend_select: Codes = ()
    ignore: Codes = ()
    preview: bool = False
    fail_on: Severity = Severity.WARNING
    autopilot: Autopilot | None = None
    dialect: str | None = None
    rules: tuple[str, ...] = ()
    """Directories of rule files, from the folder of the configuration file."""
    baseline: str | None = None
    """Baseline file, from the folder of the configuration file."""
    dem: str | None = None
    """Terrain model, from the folder of the configuration file."""
    severity: dict[str, Severity] = {}
    """Rule to the severity of all its findings."""
    params: dict[str, dict[str, int | float | str | bool]] = {}
    """Rule to parameter to value."""
    per_file_ignores: dict[str, Codes] = {}
    """Pattern for the path to rules."""
    per_sysid_ignores: dict[str, Codes] = {}
    """System id of the sender to rules."""
    per_stream_ignores: dict[str, Codes] = {}
    """``1/191 ODOMETRY.q``, or what it begins with, to rules."""
    suppressions: tuple[Suppression, ...] = ()
