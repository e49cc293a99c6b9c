"""What `inspect` says of one field, in words: what it measures, what it refers to, what came."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import degrees

from mavframecheck.model.survey import FieldSurvey, ReferenceCount
from mavframecheck.report.escape import sentence
from mavframecheck.report.words import utc

_SPATIAL = frozenset(
    {
        *("latitude", "longitude", "altitude", "position", "position_offset", "velocity"),
        *("attitude_angle", "attitude_quaternion", "heading", "course", "timestamp", "mask"),
        *("frame_selector", "altitude_selector", "orientation_selector"),
    }
)
"""Quantities that are shown unasked."""
_CLOCKS = {
    "boot": "since boot",
    "boot_event": "since boot, of an event",
    "unix": "since 1970, UTC",
    "unix_2019": "since 2019, UTC",
    "utc_hour": "since the full hour, UTC",
    "gps": "GPS time",
    "gps_week": "since the start of the GPS week",
    "sender": "another party's clock",
    "duration": "an interval",
    "mixed": "now since boot, now since 1970",
}
_POINTS = {"vehicle": "", "home": "of home"}
"""How a point of reference reads; nothing for the usual one."""
_MOST_VALUES = 6
"""Values of a selector or an instance that a cell lists."""
_DATES_S = (1e9, 4_102_444_800.0)
"""Unix times that are shown as dates: 2001 to 2100."""


def is_spatial(field: FieldSurvey) -> bool:
    """Return whether a field speaks of position, velocity, attitude, height, heading, time or frame."""
    return field.quantity in _SPATIAL


def share(count: int, total: int) -> str:
    """Return a part of a whole as ``98 %``; what is not all never reads as all, nor as nothing."""
    percent = 100 * count / total if total else 0.0
    if 0 < percent < 0.1:
        return "< 0.1 %"
    if 99.9 < percent < 100:
        return "> 99.9 %"
    near_an_end = 0 < percent < 1 or 99 < percent < 100
    return f"{percent:.1f} %" if near_an_end else f"{percent:.0f} %"


def meaning(field: FieldSurvey) -> str:
    """Return ``latitude, degE7``; a dash for what has no meaning in the catalogue."""
    quantity = (field.quantity or "-").replace("_", " ")
    return f"{quantity}, {field.unit}" if field.unit else quantity


def refers_to(field: FieldSurvey, labels: Mapping[str, str], before: str) -> tuple[str, str]:
    """Return frame, direction, height reference and clock in words, and the frame alone.

    A frame that was said of the field `before` is not repeated.
    """
    frame = _mixed([each for each in field.frames if each.reference != "vertical"], labels)
    heights = _mixed(field.heights, labels)
    shown = "same" if frame and frame == before else frame
    point = _POINTS.get(field.point or "", f"of the {field.point}" if field.point else "")
    said = (shown, _direction(field), heights) if shown else (heights, _direction(field))
    parts = (*said, _clock(field), point)
    return "; ".join(filter(None, parts)), frame


def _mixed(counts: Sequence[ReferenceCount], labels: Mapping[str, str]) -> str:
    """Return one reference by its label, several with their shares."""
    if len(counts) == 1:
        return sentence(labels[counts[0].reference])
    total = sum(each.count for each in counts)
    return ", ".join(
        f"{sentence(labels[each.reference])} {share(each.count, total)}" for each in counts
    )


def _direction(field: FieldSurvey) -> str:
    """Return ``+ north`` or ``roll, + right wing down``; only the axis where the frame decides."""
    positive = (field.positive or "").replace("_", " ")
    axis = "" if field.axis in ("lat", "lon", positive) else field.axis or ""
    grows = f"+ {positive}" if positive not in ("", "by frame", "unspecified") else ""
    return ", ".join(filter(None, (axis, grows)))


def _clock(field: FieldSurvey) -> str:
    if field.clock != "ambiguous":
        return _CLOCKS.get(field.clock or "", "")
    if field.clock_seen is None:
        return "since boot or 1970"
    return f"{_CLOCKS[field.clock_seen]} (by its size)"


def values(field: FieldSurvey) -> Iterator[str]:
    """Yield what came: names or range, then codes, NaN, and how much of it counts."""
    if not field.present:
        yield "never given"
        return
    if not field.used:
        yield f"ignored by {field.mask}"
        return
    if field.seen:
        yield from _names(field)
    elif field.minimum is not None:
        yield from _range(field)
    yield from _codes(field)
    if field.used < field.present:
        yield f"counts in {share(field.used, field.present)} ({field.mask})"
    if field.present < field.count:
        yield f"given in {share(field.present, field.count)}"


def _names(field: FieldSurvey) -> Iterator[str]:
    if len(field.seen) == 1 and not field.seen_others:
        yield _name(field.seen[0].words, field.seen[0].value)
        return
    for each in field.seen[:_MOST_VALUES]:
        yield f"{_name(each.words, each.value)} {share(each.count, field.used)}"
    more = len(field.seen) - _MOST_VALUES
    if more > 0 or field.seen_others:
        yield f"and {max(more, 0)}{' or more' if field.seen_others else ''} other values"


def _name(words: str | None, value: int | str) -> str:
    return sentence(words or str(value)) or '""'


def _range(field: FieldSurvey) -> Iterator[str]:
    """Yield smallest and largest; angles in degrees too, Unix time as dates."""
    low, high = field.minimum, field.maximum
    if low is None or high is None:
        return
    unix = "unix" in (field.clock, field.clock_seen) and field.si_unit == "s"
    if unix and _DATES_S[0] <= low <= high < _DATES_S[1]:
        yield _span(utc(low).removesuffix(" UTC"), utc(high))
        return
    unit = field.si_unit if field.si_unit is not None else field.unit
    digits = 10 if field.quantity in ("latitude", "longitude") else 5
    yield f"{_span(_number(low, digits), _number(high, digits))} {unit}".rstrip()
    if unit in ("rad", "rad/s") and (low or high):
        span = _span(_number(degrees(low), 4), _number(degrees(high), 4))
        yield f"({span} {unit.replace('rad', 'deg')})"


def _span(low: str, high: str) -> str:
    return low if low == high else f"{low} .. {high}"


def _number(value: float, digits: int) -> str:
    """Return a number with at most `digits` digits, whole ones in full."""
    if float(value).is_integer() and abs(value) < 1e15:
        return str(int(value))
    return f"{value:.{max(digits, len(str(int(abs(value)))))}g}"


def _codes(field: FieldSurvey) -> Iterator[str]:
    """Yield the codes that came with what they mean, and NaN that means nothing."""
    meant = 0
    for each in field.sentinels:
        meant += each.count if each.code == "NaN" else 0
        if each.count:
            yield f"{each.code} = {each.meaning} {share(each.count, field.values)}"
    if field.nan > meant:
        yield f"NaN {share(field.nan - meant, field.values)}"
    if field.infinite:
        yield f"infinite {share(field.infinite, field.values)}"
