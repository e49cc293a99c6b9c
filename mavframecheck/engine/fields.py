"""From the statistics of a column to what `inspect` says of a field."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from mavframecheck.engine.columns import FieldColumn, Tally
from mavframecheck.model.survey import FieldSurvey, ReferenceCount, SentinelCount, ValueCount
from mavframecheck.semantics import catalogue, masks
from mavframecheck.semantics.constants import entries
from mavframecheck.semantics.enums import AltRef, Clock, Frame
from mavframecheck.semantics.mavframe import frame_name
from mavframecheck.semantics.references import selected_height, selected_reference
from mavframecheck.semantics.tags import Condition, FieldTag, Sentinel

UNIX_FROM_S = 1e9
"""An ambiguous stamp this large is Unix time (September 2001), a smaller one counts from boot."""


def field_survey(column: FieldColumn, conditions: Sequence[Condition]) -> FieldSurvey:
    """Return what `column` has gathered; `conditions` on other fields are part of its meaning."""
    tag, field = column.tag, column.field
    return FieldSurvey(
        name=field.name,
        when=tuple(_condition(each) for each in conditions),
        quantity=str(tag.quantity) if tag is not None else None,
        unit=tag.unit if tag is not None else field.unit,
        si_unit=tag.si_unit if tag is not None else None,
        frames=_frames(column),
        heights=_heights(column),
        axis=_word(tag, "axis"),
        positive=_word(tag, "positive"),
        point=_word(tag, "ref_point"),
        clock=_word(tag, "clock"),
        clock_seen=_clock_seen(column),
        extension=field.extension,
        mask=_word(tag, "ignore_field"),
        count=column.count,
        present=column.present,
        used=column.used,
        values=column.values,
        nan=column.nan,
        infinite=column.infinite,
        sentinels=_sentinels(column),
        minimum=_scaled(column.minimum, tag),
        maximum=_scaled(column.maximum, tag),
        seen=values_seen(column.seen, tag.enum if tag is not None else ""),
        seen_others=column.seen.others if column.seen is not None else 0,
    )


def _word(tag: FieldTag | None, name: str) -> str | None:
    return (str(getattr(tag, name)) or None) if tag is not None else None


def _condition(condition: Condition) -> str:
    return f"{condition.field} = {' or '.join(map(str, condition.values))}"


def _scaled(raw: float | None, tag: FieldTag | None) -> float | None:
    return raw if raw is None or tag is None or tag.scale == 1 else raw * tag.scale


def values_seen(tally: Tally | None, enum: str) -> tuple[ValueCount, ...]:
    """Return what a tally counted, most frequent first, with what `enum` says of each value."""
    return tuple(
        ValueCount(value=_text(value), words=value_said(enum, value), count=count)
        for value, count in (tally.ranked() if tally is not None else ())
    )


def _text(value: Any) -> int | str:
    return value.decode("utf-8", "backslashreplace") if isinstance(value, bytes) else int(value)


def value_said(enum: str, value: Any) -> str | None:
    """Return the bits in words, or the entry; None for a value or an enumeration without names."""
    if not enum or isinstance(value, bytes):
        return None
    if enum in masks.mask_enums():
        return "; ".join(masks.words(enum, int(value)))
    if enum == "MAV_FRAME":
        return frame_name(value)
    return _entries(enum).get(int(value))


@cache
def _entries(enum: str) -> dict[int, str]:
    """Return value -> entry of an enumeration; empty for one that the tables do not name."""
    try:
        return {value: name for name, value in entries(enum).items()}
    except KeyError:
        return {}


def _frames(column: FieldColumn) -> tuple[ReferenceCount, ...]:
    """Return the frames of the values that count, from the selector where there is one."""
    tag = column.tag
    if tag is None or not tag.frame:
        return ()
    if column.selected is None or tag.frame not in (Frame.BY_FIELD, Frame.GIMBAL_BY_FLAGS):
        return (ReferenceCount(reference=str(tag.frame), count=column.used),) * bool(column.used)
    enum = _selector_enum(tag)
    return _summed((selected_reference(enum, v), n) for v, n in column.selected.ranked())


def _heights(column: FieldColumn) -> tuple[ReferenceCount, ...]:
    """Return the height references of the values that count."""
    tag = column.tag
    if tag is None or not tag.alt_ref:
        return ()
    if column.selected is None or tag.alt_ref not in (AltRef.BY_FRAME, AltRef.BY_FIELD):
        return (ReferenceCount(reference=str(tag.alt_ref), count=column.used),) * bool(column.used)
    enum = _selector_enum(tag)
    return _summed((selected_height(enum, v), n) for v, n in column.selected.ranked())


def _selector_enum(tag: FieldTag) -> str:
    """Return the enumeration of the field that selects the frame of `tag`, in the same view."""
    selectors = catalogue.tags_of(tag.message, tag.frame_field)
    enums = [each.enum for each in selectors if each.enum and set(each.when) <= set(tag.when)]
    usual = "GIMBAL_MANAGER_FLAGS" if tag.frame is Frame.GIMBAL_BY_FLAGS else "MAV_FRAME"
    return enums[0] if enums else usual


def _summed(counted: Any) -> tuple[ReferenceCount, ...]:
    totals: dict[str, int] = {}
    for name, count in counted:
        totals[str(name)] = totals.get(str(name), 0) + count
    ranked = sorted(totals.items(), key=lambda item: (-item[1], item[0]))
    return tuple(ReferenceCount(reference=name, count=count) for name, count in ranked)


def _sentinels(column: FieldColumn) -> tuple[SentinelCount, ...]:
    known = column.tag.sentinels if column.tag is not None else ()
    return tuple(
        SentinelCount(code=_code(sentinel), meaning=sentinel.meaning, count=count)
        for sentinel, count in zip(known, column.sentinels, strict=True)
    )


def _code(sentinel: Sentinel) -> str:
    if sentinel.kind == "nan":
        return "NaN"
    whole = sentinel.value.is_integer()
    number = str(int(sentinel.value)) if whole else f"{sentinel.value:g}"
    return f"< {number}" if sentinel.kind == "below" else number


def _clock_seen(column: FieldColumn) -> str | None:
    """Return what stamps of an ambiguous clock were, by their size."""
    tag = column.tag
    if tag is None or tag.clock is not Clock.AMBIGUOUS or column.minimum is None:
        return None
    ends = {(_scaled(end, tag) or 0.0) >= UNIX_FROM_S for end in (column.minimum, column.maximum)}
    return "mixed" if len(ends) == 2 else "unix" if True in ends else "boot"
