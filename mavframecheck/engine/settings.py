"""What a user may set for a run."""

from __future__ import annotations

import msgspec

from mavframecheck.wire import DEFAULT_DIALECT


class SettingsError(Exception):
    """A setting that makes no sense; the text says what to do."""


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Which rules run, and what to assume."""

    select: tuple[str, ...] = ()
    """Prefixes of codes to run; empty: all."""
    extend_select: tuple[str, ...] = ()
    """Prefixes of codes to run as well, those in preview too."""
    ignore: tuple[str, ...] = ()
    preview: bool = False
    """Whether rules in preview run too (one that is selected by its full code always does)."""
    autopilot: str | None = None
    """Family to assume where the recording does not say."""
    plan: str | None = None
    """Mission file that recordings are compared with."""
    dem: str | None = None
    """Terrain model that missions are compared with."""
    dialect: str = DEFAULT_DIALECT
    input_kind: str | None = None
    sender: int | None = None
    """``sysid * 256 + compid`` of the only sender whose messages are judged; None: everybody's."""
    overrides: dict[str, dict[str, float | str | bool]] = {}
    """Code to parameter to value."""
