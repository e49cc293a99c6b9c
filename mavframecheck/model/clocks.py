"""What `inspect --clocks` found: whose clock each stamp is, and how it runs."""

from __future__ import annotations

import msgspec

from mavframecheck.model.finding import FileSummary


class ClockStep(msgspec.Struct, frozen=True, kw_only=True):
    """A place where receive time and stamp went different ways."""

    time: float | None
    """Receive time behind it, s since 1970."""
    receive_s: float
    """How far receive time went over it, s."""
    stamp_s: float
    """How far the stamp went, s of receive time."""
    offset: int
    """Byte offset of the first frame behind it, or of the stretch it lies in."""


class ClockStream(msgspec.Struct, frozen=True, kw_only=True):
    """The stamps of one field of one stream."""

    sysid: int
    compid: int
    message: str
    field: str
    target: int | None
    """System that the messages are addressed to; None where they name none."""
    instance: int | None
    """Sensor, if the message has several; a name as a number."""
    count: int
    """Messages."""
    unset: int
    """Messages whose stamp is 0 or all ones."""
    clock: str
    """What the field is for: ``boot``, ``unix``, ``ambiguous`` (either) or ``sender``."""
    domain: str | None
    """What it holds: ``boot``, ``unix``, ``vehicle`` (the autopilot's boot clock), ``sender`` (its own),
    ``mixed``, ``constant``; None where nothing is stamped."""
    unit: str
    """Unit of the field."""
    rate: float | None
    """Seconds of the stamp in a second of receive time; None if it is too short or stands still."""
    offset_s: float | None
    """Receive time minus stamp, s, the least at the start: when a boot clock began (s since 1970)."""
    error_ppm: float | None
    """How much faster (slower: negative) than receive time it runs, parts in a million."""
    latency_p50_s: float | None
    latency_p99_s: float | None
    """Time from the stamp to the recorder beyond the fastest message of the component around it, s."""
    repeated: int
    """Messages with the stamp of the one before."""
    backward: int
    """Messages with an earlier stamp than the one before."""
    steps: tuple[ClockStep, ...]


class ClockRestart(msgspec.Struct, frozen=True, kw_only=True):
    """A component whose clock begins again."""

    sysid: int
    compid: int
    time: float | None
    """Receive time of the first message behind it, s since 1970."""
    uptime_s: float
    """Stamp before it, s."""
    since_s: float
    """Stamp behind it, s."""
    streams: int
    """Streams that agree."""


class ClockExchange(msgspec.Struct, frozen=True, kw_only=True):
    """TIMESYNC between two components."""

    asker: str
    """``sysid/compid``."""
    answerer: str | None
    """None: nobody answers."""
    questions: int
    answers: int
    ahead_s: float | None
    """The answerer's clock minus the asker's, s."""


class ComponentClock(msgspec.Struct, frozen=True, kw_only=True):
    """The boot clock of a component against the time of day."""

    sysid: int
    compid: int
    boot_utc: float
    """When it was started by its own SYSTEM_TIME, s since 1970."""


class FileClocks(FileSummary, frozen=True, kw_only=True):
    """The clocks of one recording."""

    streams: tuple[ClockStream, ...]
    """By sender, message and field."""
    restarts: tuple[ClockRestart, ...]
    exchanges: tuple[ClockExchange, ...]
    components: tuple[ComponentClock, ...]
    """Those that sent SYSTEM_TIME."""
