"""What `watch` says while a link is up: changes of findings, and what happens to the link itself."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from mavframecheck.model.contract import Deviation, Terms
from mavframecheck.model.finding import Finding, Vehicle

What: TypeAlias = Literal["found", "updated", "worse", "ended", "resumed", "withdrawn"]
State: TypeAlias = Literal["waiting", "up", "silent", "closed"]
Happening: TypeAlias = Literal[
    "open", "closed", "silent", "back", "garbage", "appeared", "reboot", "clock", "record", "note"
]


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """A finding that is new, or not what it was."""

    what: What
    """``found``: it is established; ``updated``: there is more of it; ``worse``: it is more severe;
    ``ended``: no hit for ten seconds; ``resumed``: hits again; ``withdrawn``: later messages speak
    against it."""
    time: float
    """Time of the link's newest message, s since 1970."""
    link: str
    finding: Finding


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """Something that happened to a link."""

    what: Happening
    """``open`` and ``closed``: the port; ``silent`` and ``back``: the messages; ``garbage``: bytes that
    hold no frame; ``appeared``: a system speaks for the first time; ``reboot``: a vehicle's clock begins
    again; ``clock``: this computer's clock was set; ``record``: the recording stopped; ``note``: anything else."""
    time: float
    """s since 1970."""
    link: str
    text: str
    """What happened, in a sentence."""
    sysid: int | None = None


class LinkStatus(msgspec.Struct, frozen=True, kw_only=True):
    """How a link does, over its last seconds."""

    link: str
    state: State
    """``waiting``: nothing was heard yet."""
    messages: int
    """Frames since the start."""
    rate_hz: float
    """Frames per second."""
    bytes_per_s: float
    loss: float | None
    """Share of the frames that sequence counters say were sent and did not come, 0..1."""
    garbage_bytes: int
    """Bytes since the start that hold no frame."""
    quiet_s: float | None
    """Since the last frame, s; None before the first."""
    record_bytes: int | None
    """Bytes recorded; None where nothing is."""


class SenderStatus(msgspec.Struct, frozen=True, kw_only=True):
    """How a component does, over its last seconds."""

    sysid: int
    compid: int
    rate_hz: float
    loss: float | None
    latency_s: float | None
    """How much later than the fastest its messages came in the last seconds, s: median; None without a clock."""
    quiet_s: float
    """Since its last frame, s."""


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Home or origin of a vehicle as it stands."""

    system: int
    what: Literal["home", "origin"]
    lat: float
    """deg"""
    lon: float
    """deg"""
    alt_msl: float
    """m"""
    source: str
    """The message that gave it, or who asked for it."""
    moves: int
    """How often it was somewhere else before."""


class Standing(msgspec.Struct, frozen=True, kw_only=True):
    """A finding as it stands."""

    finding: Finding
    active: bool
    """Whether there was a hit in the last ten seconds."""
    age_s: float
    """Since its first hit, s."""
    last_s: float
    """Since its last hit, s."""
    residuals: tuple[float, ...]
    """What the last fits left over, oldest first: for rules about motion."""


class View(msgspec.Struct, frozen=True, kw_only=True):
    """All that is known of a link at one moment: what a screen shows."""

    status: LinkStatus
    senders: tuple[tuple[Vehicle, SenderStatus], ...]
    places: tuple[Place, ...]
    streams: tuple[Terms, ...]
    findings: tuple[Standing, ...]
    """Worst first, active ones before those that ended."""
    judging: int
    """Rules that had something to judge so far."""
    deviations: tuple[Deviation, ...] | None
    """Where the link differs from the contract; None without one."""
