"""The lines that rules draw of what they judged (`[[proof]]`), kept thinned out while they judge."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.compiled import CompiledRule
from mavframecheck.engine.scope import RuleScope
from mavframecheck.model.trace import Figure
from mavframecheck.vehicle.flight import SeriesBook, line
from mavframecheck.wire import Frames

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

MAX_STREAMS = 128
"""Streams of rules that lines are kept of."""


class Proofs:
    """The lines of every rule and stream of a recording."""

    def __init__(self, *, timed: bool) -> None:
        """Start with none; `timed`: whether the recording has receive times."""
        self._timed = timed
        self._books: dict[tuple[str, int], SeriesBook] = {}

    def record(
        self,
        rule: CompiledRule,
        scope: RuleScope,
        key: tuple[str, str | None],
        stream: Ints,
        rows: npt.NDArray[np.bool_],
    ) -> None:
        """Keep the lines of a rule at the judged `rows` of `scope`, whose message and label are `key`."""
        place = np.flatnonzero(rows)
        frames = scope.rows.table.frames.take(place)
        for k, (_, lines) in enumerate(rule.proofs):
            values = [_column(expression(scope), len(rows))[place] for expression in lines.values()]
            self._add((rule.rule.code, k), key, frames, stream[place], np.column_stack(values))

    def _add(
        self,
        figure: tuple[str, int],
        key: tuple[str, str | None],
        frames: Frames,
        stream: Ints,
        values: Floats,
    ) -> None:
        book = self._books.get(figure)
        if book is None:
            columns = values.shape[1]
            book = SeriesBook(columns, timed=self._timed, most=MAX_STREAMS)
            self._books[figure] = book
        parts = {each: np.flatnonzero(stream == each) for each in np.unique(stream).tolist()}
        book.add(
            ((key[0], key[1] or "", each), frames.take(own), values[own])
            for each, own in parts.items()
        )

    def figures(
        self, rule: CompiledRule, key: tuple[str, str | None], stream: int
    ) -> tuple[Figure, ...]:
        """Return what was drawn of a stream."""
        wanted = (key[0], key[1] or "", stream)
        found = []
        for k, (figure, lines) in enumerate(rule.proofs):
            book = self._books.get((rule.rule.code, k))
            drawn = {} if book is None else {name: (t, v) for name, t, v in book.traces()}
            if wanted in drawn:
                t, values = drawn[wanted]
                traces = tuple(
                    line(label, t, values[:, place], "" if place or k else "claimed")
                    for place, label in enumerate(lines)
                )
                found.append(
                    Figure(
                        title=figure.title,
                        kind="time",
                        unit=figure.unit,
                        traces=traces,
                        note=figure.note,
                    )
                )
        return tuple(found)


def _column(value: Any, rows: int) -> Floats:
    """Return what an expression gives as (rows,) numbers."""
    column = np.asarray(value)
    if column.dtype.kind not in "iufb":
        return np.full(rows, np.nan)
    return np.broadcast_to(column.astype(np.float64), (rows,))
