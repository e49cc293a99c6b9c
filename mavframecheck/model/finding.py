"""What a rule found, and how each rule ended: the structs every report is written from."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from mavframecheck.model.rule import Confidence, Severity

Scalar: TypeAlias = str | float | int | bool | None
Evidence: TypeAlias = dict[str, Scalar]
"""`expected`, `observed`, `unit`, `frame` and what else the rule found worth saying."""


MISSION_KINDS = frozenset({"plan", "wpl", "points", "rally"})
"""`FileSummary.kind` of mission files; every other kind is a recording."""


class ByteLocation(msgspec.Struct, frozen=True):
    """A place in a recording."""

    offset: int
    """Byte at which the first frame of the finding starts (its magic byte)."""
    length: int
    """Bytes of that frame."""


class MissionLocation(msgspec.Struct, frozen=True):
    """A place in a mission file; lines and columns count from 1."""

    line: int | None
    """Line of the file."""
    column: int | None
    """Column of that line."""
    item: int | None
    """Sequence number of the mission item."""
    command: str | None
    """MAV_CMD name of the item."""


class Subject(msgspec.Struct, frozen=True, order=True):
    """The stream a finding or a verdict is about."""

    sysid: int | None = None
    compid: int | None = None
    message: str | None = None
    field: str | None = None

    def __str__(self) -> str:
        """Return ``1/191 ODOMETRY.q``, leaving out what is not known; ``1/*`` is all of a system."""
        component = "*" if self.compid is None else self.compid
        sender = "" if self.sysid is None else f"{self.sysid}/{component}"
        stream = ".".join(part for part in (self.message, self.field) if part)
        return " ".join(part for part in (sender, stream) if part)


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """An episode: consecutive hits of one rule on one stream, with evidence and words."""

    code: str
    """Code of the rule, e.g. ``MFC302``."""
    name: str
    """Name of the rule, e.g. ``degrees-in-scaled-field``."""
    severity: Severity
    """How bad it is."""
    confidence: Confidence
    """How sure the rule is that this is a mistake."""
    file: str
    """Path as given to `check`, or as found below a directory given."""
    subject: str
    """The stream in words: ``1/191 ODOMETRY.q``."""
    sysid: int | None
    """System id of the sender; None in a mission file."""
    compid: int | None
    """Component id of the sender; None in a mission file."""
    message_name: str | None
    """MAVLink message, or None when the finding is about the file."""
    field: str | None
    """Field of that message, or None when it is about the whole message."""
    time_first: float | None
    """Receive time of the first hit, s since 1970; None where the recording has no stamps."""
    time_last: float | None
    """Receive time of the last hit, s since 1970."""
    utc_first: str | None
    """`time_first` as text, UTC."""
    utc_last: str | None
    """`time_last` as text, UTC."""
    count: int
    """Hits in this episode."""
    location: ByteLocation | MissionLocation | None
    """Bytes of the first hit in a recording, line and item in a mission."""
    related: tuple[str, ...] = ()
    """Other streams that the evidence leans on."""
    fingerprint: str
    """Same for the same mistake of the same stream in another recording."""
    evidence: Evidence
    """`expected`, `observed`, `unit`, `frame`, and what else the rule found worth saying."""
    text: str
    """What is wrong, in a sentence."""
    fix: str
    """How to mend it."""


class Suppressed(msgspec.Struct, frozen=True, kw_only=True):
    """A finding that the user knows of and has set aside."""

    finding: Finding
    """What was found."""
    by: Literal["configuration", "baseline"]
    """What sets it aside."""
    reason: str
    """Why, in the words of the user; for the baseline that it is in there."""


class RuleRun(msgspec.Struct, frozen=True, kw_only=True):
    """How a rule ended on one file: silence of a rule that could not look is not a pass."""

    code: str
    """Code of the rule."""
    subject: str | None = None
    """The stream this verdict is about; None for the whole file."""
    status: Literal["ran", "not-applicable", "insufficient-data"]
    """Whether the rule judged, had nothing to judge, or could not."""
    reason: str = ""
    """Why it did not run, or what it left out; empty when it judged all."""
    checked: int = 0
    """Rows looked at."""


class Damage(msgspec.Struct, frozen=True):
    """A byte range of the recording that holds no good frame."""

    offset: int
    """First byte of the range."""
    length: int
    """Bytes in the range."""
    reason: str
    """Why no frame could be read there."""


class Vehicle(msgspec.Struct, frozen=True, kw_only=True):
    """A component that spoke, and what it said it is."""

    sysid: int
    """System id."""
    compid: int
    """Component id."""
    role: str
    """``autopilot``, ``gcs``, ``companion``, ``camera``..."""
    autopilot: str | None = None
    """Family, e.g. ``px4``, ``arducopter``; None when it is no autopilot or never said."""
    type: str | None = None
    """What it says it is, e.g. ``QUADROTOR``."""
    version: str | None = None
    """Version of its software, where it said so."""
    messages: int = 0
    """Good frames it sent."""


class FileSummary(msgspec.Struct, frozen=True, kw_only=True):
    """What was read of one file."""

    path: str
    """Path as given to `check`, or as found below a directory given."""
    kind: str
    """What the content is: ``tlog``, ``raw``, ``pcap``, ``pcapng``, ``plan``, ``wpl``..."""
    messages: int
    """Good frames of known messages; items of a mission."""
    unknown: int
    """Frames whose id the dialect lacks."""
    bad_crc: int
    """Frames whose checksum is wrong."""
    skipped_bytes: int
    """Bytes that belong to no good frame."""
    duration_s: float | None
    """First to last plausible receive time, s; None where the recording has no stamps."""
    time_start: float | None
    """First plausible receive time, s since 1970; None where the recording has no stamps."""
    notes: tuple[str, ...]
    """What else a reader of the report should know."""


class FileReport(FileSummary, frozen=True, kw_only=True):
    """What was read of one file, and how each rule ended on it."""

    vehicles: tuple[Vehicle, ...]
    """Components that spoke, ground stations included."""
    damage: tuple[Damage, ...]
    """The first ranges without a good frame."""
    damage_total: int
    """Damaged ranges in all; `damage` lists the first ones."""
    runs: tuple[RuleRun, ...]
    """How each rule ended; a rule may end differently on each stream."""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """All that a run of `check` says."""

    version: str
    """Version of mavframecheck that wrote it."""
    files: tuple[FileReport, ...]
    """Files read, in the order judged."""
    findings: tuple[Finding, ...]
    """What was found, file by file."""
    suppressed: tuple[Suppressed, ...] = ()
    """What was found and set aside by the user, file by file."""
