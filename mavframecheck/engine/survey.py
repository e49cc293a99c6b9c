"""The semantic map of a recording: who sends what, and what each number of it means."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.check import Progress, _duration, _Reading, _vehicles
from mavframecheck.engine.columns import FieldColumn, Intervals, Tally
from mavframecheck.engine.fields import field_survey, values_seen
from mavframecheck.engine.rows import Rows
from mavframecheck.engine.settings import Settings
from mavframecheck.model import Vehicle
from mavframecheck.model.survey import (
    FileSurvey,
    SenderSurvey,
    StreamSurvey,
    ValueCount,
    ViewSurvey,
)
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.enums import Quantity
from mavframecheck.semantics.references import height_reference, reference
from mavframecheck.semantics.tags import Condition, FieldTag
from mavframecheck.sources import open_recording
from mavframecheck.vehicle import Context, Traffic
from mavframecheck.wire import Batch, Field, Layout, Table, load_dialect, read_batches

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]

MOST_VIEWS = 32
"""Views of one stream that are told apart; further ones are counted."""
_TALLIED = frozenset(
    {
        *(Quantity.MASK, Quantity.INSTANCE, Quantity.ADDRESS, Quantity.VALIDITY, Quantity.SELECTOR),
        *(Quantity.FRAME_SELECTOR, Quantity.COMMAND_SELECTOR),
        *(Quantity.ALTITUDE_SELECTOR, Quantity.ORIENTATION_SELECTOR),
    }
)
"""Quantities whose values are names rather than amounts."""


def survey_file(
    path: str,
    settings: Settings,
    messages: Collection[str] = (),
    progress: Progress | None = None,
) -> FileSurvey:
    """Map the recording at `path` (``-``: standard input); `messages`: only these, empty for all.

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` when the dialect cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    context, traffic, reading = Context(settings.autopilot), Traffic(dialect), _Reading()
    survey = Survey(messages)
    with open_recording(path, settings.input_kind) as recording:
        for batch in read_batches(recording.chunks(), dialect, stamped=recording.stamped):
            reading.add(batch)
            admitted = traffic.admit(batch.frames)
            if traffic.refused:
                batch.restrict(admitted)
            context.update(batch)
            survey.update(batch, context)
            context.settle()
            if progress is not None and len(batch):
                progress(int(batch.frames.offset[-1]))
    senders = survey.finish(_vehicles(context, traffic))
    fields = [f for s in senders for m in s.streams for v in m.views for f in v.fields]
    notes = [*recording.notes]
    if traffic.refused:
        notes.append(f"{traffic.refused} frames of further senders or streams were not looked at")
    return FileSurvey(
        path=recording.name,
        kind=str(recording.kind),
        messages=reading.messages,
        unknown=reading.unknown,
        bad_crc=reading.bad_crc,
        skipped_bytes=reading.skipped,
        duration_s=_duration(traffic),
        time_start=traffic.t_first,
        notes=tuple(notes),
        senders=senders,
        references=tuple(map(reference, sorted({u.reference for f in fields for u in f.frames}))),
        heights=tuple(
            map(height_reference, sorted({u.reference for f in fields for u in f.heights}))
        ),
    )


class Survey:
    """Watches every stream of a recording, batch by batch."""

    def __init__(self, messages: Collection[str] = ()) -> None:
        """Watch only the messages named, or all."""
        self._wanted = frozenset(messages)
        self._streams: dict[tuple[int, str], _Stream] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Take in what `batch` holds."""
        for name in batch.tables:
            if not self._wanted or name in self._wanted:
                table = batch.tables[name]
                for sender, own in _by_sender(table):
                    self._stream(sender, table.layout).add(Rows(own, context))

    def finish(self, vehicles: Iterable[Vehicle]) -> tuple[SenderSurvey, ...]:
        """Return what each of `vehicles` (the components that spoke) sent."""
        return tuple(
            SenderSurvey(
                **{name: getattr(vehicle, name) for name in Vehicle.__struct_fields__},
                streams=self._of(vehicle.sysid * 256 + vehicle.compid),
            )
            for vehicle in vehicles
        )

    def _of(self, sender: int) -> tuple[StreamSurvey, ...]:
        mine = sorted(key for key in self._streams if key[0] == sender)
        return tuple(self._streams[key].finish() for key in mine)

    def _stream(self, sender: int, layout: Layout) -> _Stream:
        key = (sender, layout.name)
        if key not in self._streams:
            self._streams[key] = _Stream(layout)
        return self._streams[key]


def _by_sender(table: Table) -> Iterator[tuple[int, Table]]:
    """Yield each sender (``sysid * 256 + compid``) of a table with its rows."""
    sender = table.frames.sender
    found = np.unique(sender).tolist()
    for each in found:
        yield each, table if len(found) == 1 else table.take(sender == each)


class _Stream:
    """One message of one sender."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._count = 0
        self._intervals = Intervals()
        self._tags = catalogue.tags(layout.name)
        self._selectors = _selectors(self._tags, layout)
        self._instance = next((t.instance_field for t in self._tags if t.instance_field), "")
        if self._instance not in layout.by_name:
            self._instance = ""
        self._instances = Tally()
        self._views: dict[tuple[int, ...], _View] = {}
        self._others = 0

    def add(self, rows: Rows) -> None:
        self._count += len(rows)
        self._intervals.add(rows.table.frames)
        if self._instance:
            self._instances.add(rows.raw(self._instance))
        for values, own in self._split(rows):
            view = self._views.get(values)
            if view is None and len(self._views) < MOST_VIEWS:
                selected = dict(zip(self._selectors, values))
                view = self._views[values] = _View(self._layout, self._tags, selected)
            if view is None:
                self._others += len(own)
            else:
                view.add(own)

    def _split(self, rows: Rows) -> Iterator[tuple[tuple[int, ...], Rows]]:
        """Yield the rows of each combination of selector values, in the order they first come."""
        if not self._selectors:
            yield (), rows
            return
        columns = np.stack([rows.raw(field) for field in self._selectors], axis=1)
        found, first, which = np.unique(columns, axis=0, return_index=True, return_inverse=True)
        for place in np.argsort(first).tolist():
            yield tuple(found[place].tolist()), rows.take(which.reshape(-1) == place)

    def finish(self) -> StreamSurvey:
        views = [view.finish() for view in self._views.values()]
        return StreamSurvey(
            message=self._layout.name,
            msgid=self._layout.msgid,
            count=self._count,
            rate_hz=self._intervals.rate_hz(),
            instance_field=self._instance or None,
            instances=values_seen(self._instances, ""),
            views=tuple(sorted(views, key=_rank)),
            views_others=self._others,
        )


def _rank(view: ViewSurvey) -> tuple[int, list[int | str]]:
    return -view.count, [each.value for each in view.selectors.values()]


def _selectors(tags: Sequence[FieldTag], layout: Layout) -> tuple[str, ...]:
    """Return the integer fields that decide what other fields of the message mean."""
    asked = dict.fromkeys(c.field for tag in tags for c in tag.when if c.field in layout.by_name)
    return tuple(f for f in asked if layout.dtype[f].kind in "iu" and not layout.dtype[f].shape)


class _View:
    """The messages of a stream whose selectors have the same values."""

    def __init__(self, layout: Layout, tags: Sequence[FieldTag], selected: dict[str, int]) -> None:
        self._message = layout.name
        self._selected = selected
        self._count = 0
        fitting = [tag for tag in tags if _fits(tag, selected)]
        self._columns = [
            column for field in layout.fields for column in _columns(field, fitting, selected)
        ]

    def add(self, rows: Rows) -> None:
        self._count += len(rows)
        for conditions, column in self._columns:
            if not conditions:
                column.add(rows)
                continue
            wanted = np.all([_holds(condition, rows) for condition in conditions], axis=0)
            if wanted.any():
                column.add(rows.take(wanted))

    def finish(self) -> ViewSurvey:
        return ViewSurvey(
            selectors={
                field: ValueCount(
                    value=value, words=_words(self._message, field, value), count=self._count
                )
                for field, value in self._selected.items()
            },
            count=self._count,
            fields=tuple(
                field_survey(column, conditions)
                for conditions, column in self._columns
                if column.count
            ),
        )


def _words(message: str, field: str, value: int) -> str | None:
    seen = Tally()
    seen.counts[value] = 1
    enums = [tag.enum for tag in catalogue.tags_of(message, field) if tag.enum]
    return values_seen(seen, enums[0] if enums else "")[0].words


def _fits(tag: FieldTag, selected: dict[str, int]) -> bool:
    """Return whether a tag can hold where the selectors have these values."""
    return all(c.field not in selected or selected[c.field] in c.values for c in tag.when)


Conditions = tuple[Condition, ...]


def _columns(
    field: Field, tags: Sequence[FieldTag], selected: dict[str, int]
) -> Iterator[tuple[Conditions, FieldColumn]]:
    """Yield a column for each meaning of `field`, with the conditions that are left to test.

    A meaning with conditions hides the general one.
    """
    mine = [tag for tag in tags if tag.field == field.name]
    special = [tag for tag in mine if tag.when]
    for tag in special or mine or [None]:
        left = tuple(c for c in tag.when if c.field not in selected) if tag is not None else ()
        yield left, FieldColumn(field, tag, tallied=_is_tallied(field, tag))


def _is_tallied(field: Field, tag: FieldTag | None) -> bool:
    scalar = field.type not in ("float", "double") and (not field.length or field.type == "char")
    return scalar and tag is not None and (bool(tag.enum) or tag.quantity in _TALLIED)


def _holds(condition: Condition, rows: Rows) -> Any:
    return np.isin(rows.raw(condition.field), condition.values)
