"""What a report may draw: series that a run kept as proof, thinned out so that nothing extreme is lost.

Nothing here is in the JSON report: it is worked out only for a report that draws (`Detail`).
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from mavframecheck.model.finding import ByteLocation, Finding, MissionLocation
from mavframecheck.model.survey import FileSurvey


class Trace(msgspec.Struct, frozen=True, kw_only=True):
    """A line, over time or on a map; of a long series the least and greatest of each stretch of time."""

    label: str
    """What it is, in words."""
    role: str = ""
    """What it is there for: ``claimed``, ``reference``, ``corrected``, ``limit``; a height reference
    (``msl``...) or a kind of track (``vehicle``, ``sent``...) in a `Flight`."""
    t: tuple[float, ...]
    """Receive time, s since 1970; the running number of the frame where the recording has no times."""
    y: tuple[float, ...]
    """Values in the unit of the figure, NaN where there is none; north (or latitude, deg) on a map."""
    system: int | None = None
    """The vehicle that says it, in a `Flight`."""
    x: tuple[float, ...] | None = None
    """East (or longitude, deg) on a map; None: a line over time."""


class Figure(msgspec.Struct, frozen=True, kw_only=True):
    """A drawing that proves a finding."""

    title: str
    """What it shows."""
    kind: Literal["time", "plan"]
    """Lines over time, or a map: north up, east to the right, in metres."""
    unit: str
    traces: tuple[Trace, ...]
    note: str = ""
    """How to read it."""


class Value(msgspec.Struct, frozen=True, kw_only=True):
    """One field of a decoded frame."""

    name: str
    raw: str
    """As on the wire."""
    says: str
    """What it means: with its unit in SI, a frame or mask in words; empty where there is no more to say."""


class FrameBytes(msgspec.Struct, frozen=True, kw_only=True):
    """A frame as it lies in the recording."""

    offset: int
    data: bytes
    message: str | None
    """None: it cannot be decoded."""
    values: tuple[Value, ...] = ()


class Proof(msgspec.Struct, frozen=True, kw_only=True):
    """How a finding is known."""

    figures: tuple[Figure, ...] = ()
    frame: FrameBytes | None = None
    """The first hit; None where the bytes cannot be fetched again (standard input)."""


ProofKey: TypeAlias = tuple[str, ByteLocation | MissionLocation | None, int]


def key_of(finding: Finding) -> ProofKey:
    """Return what tells a finding of a recording from its others, whatever severity it is given."""
    return finding.fingerprint, finding.location, finding.count


class Band(msgspec.Struct, frozen=True, kw_only=True):
    """A time in which a vehicle was armed, or in one mode."""

    system: int
    kind: Literal["armed", "mode"]
    label: str
    start: float
    """As `Trace.t`."""
    end: float


class Point(msgspec.Struct, frozen=True, kw_only=True):
    """A place that matters: home, a local origin, where a vehicle was armed."""

    kind: Literal["home", "origin", "launch"]
    label: str
    system: int
    lat: float
    """deg"""
    lon: float
    alt_msl: float
    """m"""
    time: float | None
    """As `Trace.t`."""


class Flight(msgspec.Struct, frozen=True, kw_only=True):
    """What the vehicles of a recording did, as they said it."""

    timed: bool
    """Whether `Trace.t` is a time."""
    bands: tuple[Band, ...]
    heights: tuple[Trace, ...]
    """Heights of the vehicles, m, each above its own reference (`role`)."""
    boots: tuple[Trace, ...]
    """The clock of each autopilot, s since its start."""
    tracks: tuple[Trace, ...]
    """Where vehicles were and were sent: latitude and longitude, deg."""
    points: tuple[Point, ...]


class Detail(msgspec.Struct, frozen=True, kw_only=True):
    """What a report that draws needs of one file, beside the report and its findings."""

    flight: Flight
    proofs: dict[ProofKey, Proof]
    """By what `key_of` says of each finding."""
    survey: FileSurvey
    """The semantic map."""
