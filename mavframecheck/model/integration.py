"""What `inspect --sender` says: how a sensor fares in the steps of its integration."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from mavframecheck.model.finding import FileSummary, Finding, RuleRun

Verdict: TypeAlias = Literal["passed", "failed", "missing", "nothing"]
"""`missing`: it cannot be told, and what was missing; `nothing`: the sender says nothing
that the rules of the step are about."""


class Step(msgspec.Struct, frozen=True):
    """One step of the integration of a sensor, and the rules that answer it."""

    name: str
    question: str
    codes: tuple[str, ...]


class StepResult(msgspec.Struct, frozen=True, kw_only=True):
    """How a step ended."""

    step: str
    question: str
    verdict: Verdict
    missing: tuple[str, ...]
    """What could not be told, and which motion or message was missing."""
    findings: tuple[Finding, ...]
    runs: tuple[RuleRun, ...]
    """How each rule of the step ended on this sender."""


class FileIntegration(FileSummary, frozen=True, kw_only=True):
    """The steps for one sender in one recording."""

    sender: str
    """``1/191``"""
    heard: bool
    """Whether it says anything in this recording."""
    others: tuple[str, ...]
    """Who else does."""
    steps: tuple[StepResult, ...]
