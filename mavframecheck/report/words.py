"""How numbers, times and vehicles read in a sentence."""

from __future__ import annotations

from datetime import UTC, datetime

from mavframecheck.model import Vehicle
from mavframecheck.model.finding import MISSION_KINDS, FileSummary
from mavframecheck.report.escape import sentence
from mavframecheck.semantics.names import FAMILY_NAMES

_YEAR_10000 = 253_402_300_800
_ROLES = {"gcs": "ground station", "adsb": "ADS-B receiver", "unknown": "unknown component"}


def plural(number: int, noun: str) -> str:
    """Return ``1 frame``, ``2 frames``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shortened(items: list[str], most: int) -> str:
    """Return the first `most` items joined by commas, and how many more there are."""
    more = [f"{len(items) - most} more"] if len(items) > most else []
    return ", ".join(items[:most] + more)


def scalar(value: object) -> str:
    """Return a value as evidence shows it: eight digits tell a metre of longitude in degrees."""
    if isinstance(value, float):
        return f"{value:.8g}".replace("nan", "NaN")
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "unknown" if value is None else sentence(str(value))


def is_number(text: str) -> bool:
    """Return whether `text` reads as a number, so that a unit may follow it."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def duration(seconds: float) -> str:
    """Return ``45.2 s``, ``12 min 31 s`` or ``1 h 02 min``."""
    if round(seconds, 1) < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def elapsed(seconds: float) -> str:
    """Return time since the start of a recording as ``m:ss.s`` or ``h:mm:ss.s``."""
    tenths = round(abs(seconds) * 10)
    minutes, rest = divmod(tenths, 600)
    sign = "-" if seconds < 0 and tenths else ""
    clock = f"{rest // 10:02d}.{rest % 10}"
    if minutes < 60:
        return f"{sign}{minutes}:{clock}"
    return f"{sign}{minutes // 60}:{minutes % 60:02d}:{clock}"


def utc(seconds: float) -> str:
    """Return a time since 1970 as a date and time of day."""
    if not 0 <= seconds < _YEAR_10000:
        return "an impossible time"
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S} UTC"


def autopilot(vehicle: Vehicle) -> str:
    """Return ``ArduCopter 4.7.0``, as far as the vehicle said so."""
    if vehicle.autopilot is None:
        return "unknown autopilot"
    family = FAMILY_NAMES.get(vehicle.autopilot, sentence(vehicle.autopilot))
    return (
        f"{family} {sentence(vehicle.version)}"
        if vehicle.version
        else f"{family} of unknown version"
    )


def component(vehicle: Vehicle) -> str:
    """Return what a component is: its autopilot and type, or its role."""
    role = _ROLES.get(vehicle.role, sentence(vehicle.role))
    if vehicle.role == "autopilot":
        role = autopilot(vehicle)
    kind = sentence(vehicle.type or "").replace("_", " ").lower()
    return f"{role}, {kind}" if kind else role


def intended(vehicle: Vehicle) -> str:
    """Return what a mission is for: no file says which version."""
    return component(vehicle).replace(" of unknown version", "")


def extent(file: FileSummary) -> str:
    """Return what the file is, how long, how much: ``tlog, 42 s from 2026-01-01 00:00:00 UTC, 210 frames``."""
    frames = plural(file.messages, "frame") if file.messages else "nothing could be decoded"
    if file.kind in MISSION_KINDS:
        frames = plural(file.messages, "item")
    start = f" from {utc(file.time_start)}" if file.time_start is not None else ""
    length = [duration(file.duration_s) + start] if file.duration_s is not None else []
    return ", ".join([file.kind, *length, frames])


def what_was_read(file: FileSummary) -> str:
    """Return its extent, and how many frames nobody could name."""
    unknown = [f"{plural(file.unknown, 'frame')} of unknown messages"] if file.unknown else []
    return ", ".join([extent(file), *unknown])
