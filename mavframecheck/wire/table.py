"""Frames to columns: one structured array per message id, decoded only when somebody looks."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.wire.dialect import Layout
from mavframecheck.wire.frames import Bools, Frames, Ints, places_of
from mavframecheck.wire.frames import join as join_frames
from mavframecheck.wire.windows import windows

Column = npt.NDArray[Any]


class Table:
    """All messages of one id in a batch.

    A table taken from another one takes over a column only when somebody looks at it.
    """

    def __init__(
        self,
        layout: Layout,
        frames: Frames,
        payloads: npt.NDArray[np.void],
        picked: Ints | None = None,
    ) -> None:
        """Hold the `payloads` of `layout` (those at `picked`) and their `frames`."""
        self.layout = layout
        self.frames = frames
        """The frames of the rows."""
        self._payloads = payloads
        self._picked = picked
        self._taken: dict[str, Column] = {}

    @functools.cached_property
    def columns(self) -> npt.NDArray[np.void]:
        """(n,) structured, payloads zero-extended."""
        if self._picked is None:
            return self._payloads
        # Indexing a structured array goes field by field, thirty times as slow.
        return self._payloads.take(self._picked)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._payloads if self._picked is None else self._picked)

    def __getitem__(self, field: str) -> Column:
        """Return the column of `field` as it is on the wire: (n,), or (n, k) for an array."""
        column = self._taken.get(field)
        if column is None:
            whole: Column = self._payloads[field]
            column = self._taken[field] = whole if self._picked is None else whole[self._picked]
        return column

    @property
    def name(self) -> str:
        """Name of the message."""
        return self.layout.name

    def present(self, field: str) -> Bools:
        """Return (n,) whether the sender gave `field`.

        A base field is always given: cut off by MAVLink 2 truncation it is zero. An extension field is
        unknown when it lies beyond the received payload, and in every MAVLink 1 frame.
        """
        definition = self.layout.by_name[field]
        if not definition.extension:
            return np.ones(len(self), np.bool_)
        present: Bools = (self.frames.version == 2) & (self.frames.length > definition.offset)
        return present

    def take(self, rows: Ints | Bools) -> Table:
        """Return a table of the rows at `rows`."""
        places = places_of(rows)
        picked = places if self._picked is None else self._picked.take(places)
        return Table(self.layout, self.frames.take(places), self._payloads, picked)

    def only(self, holds: Bools) -> Table:
        """Return a table of the rows for which `holds`, (n,): itself where that is all of them."""
        return self if holds.all() else self.take(np.flatnonzero(holds))

    def compact(self) -> Table:
        """Return the same rows without holding on to the rest of their batch."""
        return Table(self.layout, self.frames.own(), self.columns)


def join(parts: list[Table]) -> Table:
    """Return the rows of several tables of one message, one after the other."""
    if len(parts) == 1:
        return parts[0]
    joined = join_frames([part.frames for part in parts])
    return Table(parts[0].layout, joined, np.concatenate([p.columns for p in parts]))


class Tables(Mapping[str, Table]):
    """The tables of a batch by message name; each is decoded on first use."""

    def __init__(
        self,
        buffer: npt.NDArray[np.uint8],
        frames: Frames,
        layouts: Mapping[int, Layout],
        only: Bools | None = None,
    ) -> None:
        """Group the good frames of `frames` (those of `only`), whose bytes lie in `buffer`, by message id."""
        self._buffer = buffer
        good = frames.good if only is None else frames.good & only
        rows = _by_id(frames.msgid, good)
        self._frames = frames.take(rows)
        """Those of one message follow each other, so that each table has a stretch of every column."""
        ids = frames.msgid[rows]
        edges = [0, *(np.flatnonzero(np.diff(ids)) + 1).tolist(), len(ids)]
        self._groups = {
            layouts[int(ids[first])].name: (layouts[int(ids[first])], slice(first, last))
            for first, last in itertools.pairwise(edges)
            if last > first
        }
        self._decoded: dict[str, Table] = {}

    def __getitem__(self, name: str) -> Table:
        """Return the table of the message called `name`; KeyError when the batch has none."""
        table = self._decoded.get(name)
        if table is None:
            layout, rows = self._groups[name]
            frames = self._frames.take(rows)
            payloads = _payloads(self._buffer, frames, layout)
            table = self._decoded[name] = Table(layout, frames, payloads)
        return table

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the messages in the batch."""
        return iter(self._groups)

    def __len__(self) -> int:
        """Return the number of different messages."""
        return len(self._groups)


def _by_id(ids: npt.NDArray[np.int32], good: Bools) -> Ints:
    """Return the rows that are `good`, by message id and in order."""
    rows = np.flatnonzero(good)
    ids = ids[rows]
    narrow = ids.astype(np.uint16) if not len(ids) or ids.max() < 2**16 else ids
    return rows[np.argsort(narrow, kind="stable")]


def _payloads(
    buffer: npt.NDArray[np.uint8], frames: Frames, layout: Layout
) -> npt.NDArray[np.void]:
    """Return the payloads of `frames`, which hold one message, zero-extended: (n,) structured."""
    length = frames.length
    payloads = windows(buffer, f"V{layout.length}")[frames.payload]
    if (length < layout.length).any():
        octets = payloads.view(np.uint8).reshape(-1, layout.length)
        octets *= np.arange(layout.length, dtype=np.uint8) < length[:, None]
    return payloads.view(layout.dtype)
