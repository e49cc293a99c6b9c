"""One message of one sender: split by what selects its meaning, and counted field by field."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np

from mavframecheck.engine.columns import FieldColumn, Intervals, Tally
from mavframecheck.engine.fields import field_survey, value_said, values_seen
from mavframecheck.model.survey import StreamSurvey, ValueCount, ViewSurvey
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.enums import Quantity
from mavframecheck.semantics.tags import Condition, FieldTag
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Field, Layout

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

Conditions: TypeAlias = tuple[Condition, ...]


class Stream:
    """One message of one sender."""

    def __init__(self, layout: Layout, *, split: bool) -> None:
        """Watch the message of `layout`; if it has views, look into them only with `split`."""
        self._layout = layout
        self._count = 0
        self._intervals = Intervals()
        self._tags = catalogue.tags(layout.name)
        self._selectors = _selectors(self._tags, layout)
        self.is_split = split and bool(self._selectors)
        """Whether it has views that are told apart."""
        self._most_views = MOST_VIEWS if self.is_split else 0 if self._selectors else 1
        self._instance = next((t.instance_field for t in self._tags if t.instance_field), "")
        if self._instance not in layout.by_name:
            self._instance = ""
        self._instances = Tally()
        self._views: dict[tuple[int, ...], _View] = {}
        self._others = 0

    def add(self, rows: Rows) -> None:
        """Take in further messages."""
        self._count += len(rows)
        self._intervals.add(rows.table.frames)
        if self._instance:
            self._instances.add(rows.raw(self._instance))
        if not self._most_views:
            self._others += len(rows)
            return
        for values, own in self._split(rows):
            view = self._view(values)
            if view is None:
                self._others += len(own)
            else:
                view.add(own)

    def _view(self, values: tuple[int, ...]) -> _View | None:
        """Return the view with these values of the selectors, None for one too many."""
        view = self._views.get(values)
        if view is None and len(self._views) < self._most_views:
            selected = dict(zip(self._selectors, values))
            view = self._views[values] = _View(self._layout, self._tags, selected)
        return view

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
        """Return what was gathered."""
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
                field: _selected_value(self._message, field, value, self._count)
                for field, value in self._selected.items()
            },
            count=self._count,
            fields=tuple(
                field_survey(column, conditions)
                for conditions, column in self._columns
                if column.count
            ),
        )


def _selected_value(message: str, field: str, value: int, count: int) -> ValueCount:
    enums = [tag.enum for tag in catalogue.tags_of(message, field) if tag.enum]
    return ValueCount(value=value, words=value_said(enums[0] if enums else "", value), count=count)


def _fits(tag: FieldTag, selected: dict[str, int]) -> bool:
    """Return whether a tag can hold where the selectors have these values."""
    return all(c.field not in selected or selected[c.field] in c.values for c in tag.when)


def _columns(
    field: Field, tags: Sequence[FieldTag], selected: dict[str, int]
) -> Iterator[tuple[Conditions, FieldColumn]]:
    """Yield a column for each meaning of `field`, with the conditions that are left to test.

    A meaning with conditions hides the general one.
    """
    mine = [tag for tag in tags if tag.field == field.name]
    special = [tag for tag in mine if tag.when]
    if not mine:
        yield (), FieldColumn(field, None, tallied=False)
    for tag in special or mine:
        left = tuple(c for c in tag.when if c.field not in selected)
        yield left, FieldColumn(field, tag, tallied=_is_tallied(field, tag))


def _is_tallied(field: Field, tag: FieldTag) -> bool:
    scalar = field.type not in ("float", "double") and (not field.length or field.type == "char")
    return scalar and (bool(tag.enum) or tag.quantity in _TALLIED)


def _holds(condition: Condition, rows: Rows) -> Any:
    return np.isin(rows.raw(condition.field), condition.values)
