"""A rule as its file says it: pure data, read from TOML and checked against these types.

The file format is described in `docs/rule-files.md`; what the expressions mean is the engine's business.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any, Literal, TypeAlias

import msgspec


class Severity(StrEnum):
    """How bad a finding is; `rank` orders them."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"

    @property
    def rank(self) -> int:
        """Return 2 for an error, 1 for a warning, 0 for information."""
        return 2 - list(Severity).index(self)


Confidence: TypeAlias = Literal["high", "medium", "low"]
Status: TypeAlias = Literal["stable", "preview"]


class _Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Common settings: an unknown key in a rule file is an error that names it."""


class Applies(_Part, frozen=True):
    """Which rows a rule judges. Keys are AND; a list is any of its values; a leading ``!`` is not."""

    message: tuple[str, ...] = ()
    """Message names."""
    tag: dict[str, str | int | tuple[str, ...]] = {}
    """Criteria on the meaning of a field: attribute of `FieldTag` to wanted value or values."""
    has: tuple[str, ...] = ()
    """Aliases of the tagged field's group that must exist (`lon` beside a latitude)."""
    command: tuple[str, ...] = ()
    """MAV_CMD names, or ``location`` for every command with a position."""
    frame: tuple[str, ...] = ()
    """MAV_FRAME names or kinds (``global``, ``local``, ``body``, ``mission``)."""
    autopilot: tuple[str, ...] = ()
    """Families of the vehicle the message is about (``px4``, ``arducopter``...)."""
    sender: tuple[str, ...] = msgspec.field(default=(), name="from")
    """Roles of the sender (``autopilot``, ``gcs``, ``companion``, ``camera``...)."""
    report: Literal["message", "field", "group"] = "message"
    """One finding per message stream, per tagged field, or per group of fields."""


class Persist(_Part, frozen=True):
    """How much of it makes a finding: all that are given must hold within one episode."""

    count: int = 1
    """Hits."""
    seconds: float = 0.0
    """Receive time between first and last hit, s."""
    share: float = 0.0
    """Hits per judged row between first and last hit, 0..1."""


class Detect(_Part, frozen=True):
    """What is looked for: expressions on columns, or the name of a Python check."""

    when: str = ""
    flag: str = ""
    check: str = ""
    persist: Persist = Persist()
    worst: str = ""
    """Expression whose largest magnitude marks the worst row of an episode."""


class SeverityWhen(_Part, frozen=True):
    """Another severity where an expression holds on the first hit."""

    condition: str = msgspec.field(name="if")
    severity: Severity


class Explain(_Part, frozen=True):
    """What people read: `text` of the finding, why it matters, how to mend it, where it is written."""

    text: str
    why: str
    fix: str
    references: tuple[str, ...] = ()


class ProofLines(_Part, frozen=True):
    """A drawing of what was judged, for reports that draw: each line an expression over the judged rows."""

    title: str
    lines: dict[str, str]
    """Words to expression; the first one is what is judged. They name no context that the rule does not."""
    unit: str = ""
    note: str = ""
    """How to read it."""


class Step(_Part, frozen=True):
    """One message of an example, or `repeat` of them `every` seconds apart."""

    message: str
    fields: dict[str, Any] = {}
    t: float = 0.0
    sender: str = msgspec.field(default="companion", name="from")
    repeat: int = 1
    every: float = 0.1
    each: dict[str, float] = {}
    """What is added to a field with every repetition: a stamp that runs, a value that changes."""
    version: Literal[1, 2] = 2
    mangle: Literal["", "checksum", "lost", "twice"] = ""
    """What goes wrong on the way: the checksum breaks, the frame is lost, or it arrives twice."""


class Example(_Part, frozen=True):
    """A small recording that must, or must not, make the rule speak."""

    expect: Literal["bad", "good"]
    step: tuple[Step, ...] = ()
    context: dict[str, Any] = {}
    interleave: bool = False
    """The steps go on side by side: frames in order of time, not step by step."""
    raw: str = ""
    """Bytes in hexadecimal appended after the steps (for rules about the stream itself)."""
    file: str = ""
    """Text of a mission file that is judged instead (for rules about what only a file says)."""
    note: str = ""


def setting(value: float | str | bool) -> str:
    """Return a parameter value as it is written on the command line."""
    return str(value).lower() if isinstance(value, bool) else str(value)


class Rule(_Part, frozen=True):
    """One rule file."""

    code: str
    name: str
    severity: Severity
    confidence: Confidence
    status: Status
    since: str
    summary: str
    detect: Detect
    explain: Explain
    applies: Applies = Applies()
    let: dict[str, str] = {}
    params: dict[str, float | int | str | bool] = {}
    severity_when: tuple[SeverityWhen, ...] = ()
    evidence: dict[str, str] = {}
    proof: tuple[ProofLines, ...] = ()
    example: tuple[Example, ...] = ()

    @property
    def family(self) -> str:
        """Return the family of the code, e.g. ``MFC3xx``."""
        return f"{self.code[:-2]}xx"
