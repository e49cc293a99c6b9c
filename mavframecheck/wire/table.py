"""Frames to columns: one structured array per message id, decoded only when somebody looks."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.wire.dialect import Layout
from mavframecheck.wire.frames import Bools, Frames, Ints
from mavframecheck.wire.frames import join as join_frames

Column = npt.NDArray[Any]


class Table:
    """All messages of one id in a batch."""

    def __init__(
        self, layout: Layout, frames: Frames, rows: Ints, columns: npt.NDArray[np.void]
    ) -> None:
        """Hold `columns` of `layout`, the payloads at `rows` of `frames`."""
        self.layout = layout
        self.columns = columns
        """(n,) structured, payloads zero-extended."""
        self._source = frames
        self._rows = rows

    @functools.cached_property
    def frames(self) -> Frames:
        """The frames of the rows."""
        return self._source.take(self._rows)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.columns)

    def __getitem__(self, field: str) -> Column:
        """Return the column of `field` as it is on the wire: (n,), or (n, k) for an array."""
        column: Column = self.columns[field]
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
        if rows.dtype == np.bool_:
            rows = np.flatnonzero(rows)
        # `take`: indexing a structured array goes field by field, thirty times as slow.
        return Table(self.layout, self._source, self._rows[rows], self.columns.take(rows))

    def only(self, holds: Bools) -> Table:
        """Return a table of the rows for which `holds`, (n,): itself where that is all of them."""
        return self if holds.all() else self.take(np.flatnonzero(holds))

    def compact(self) -> Table:
        """Return the same rows without holding on to the rest of their batch."""
        return Table(self.layout, self.frames.own(), np.arange(len(self)), self.columns)


def join(parts: list[Table]) -> Table:
    """Return the rows of several tables of one message, one after the other."""
    if len(parts) == 1:
        return parts[0]
    joined = join_frames([part.frames for part in parts])
    return Table(
        parts[0].layout, joined, np.arange(len(joined)), np.concatenate([p.columns for p in parts])
    )


@dataclass(slots=True)
class _Group:
    """Rows of a batch that hold one message."""

    layout: Layout
    rows: Ints


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
        self._frames = frames
        good = frames.good if only is None else frames.good & only
        self._groups = {
            layouts[msgid].name: _Group(layouts[msgid], rows)
            for msgid, rows in _by_id(frames, good)
        }
        self._decoded: dict[str, Table] = {}

    def __getitem__(self, name: str) -> Table:
        """Return the table of the message called `name`; KeyError when the batch has none."""
        table = self._decoded.get(name)
        if table is None:
            group = self._groups[name]
            columns = _payloads(self._buffer, self._frames, group)
            table = self._decoded[name] = Table(group.layout, self._frames, group.rows, columns)
        return table

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the messages in the batch."""
        return iter(self._groups)

    def __len__(self) -> int:
        """Return the number of different messages."""
        return len(self._groups)


def _by_id(frames: Frames, good: Bools) -> list[tuple[int, Ints]]:
    """Return (message id, rows in order) of the `good` frames."""
    rows = np.flatnonzero(good)
    ids = frames.msgid[rows]
    narrow = ids.astype(np.uint16) if not len(ids) or ids.max() < 2**16 else ids
    order = np.argsort(narrow, kind="stable")
    groups = np.split(rows[order], np.flatnonzero(np.diff(ids[order])) + 1)
    return [(int(frames.msgid[group[0]]), group) for group in groups if len(group)]


def _payloads(buffer: npt.NDArray[np.uint8], frames: Frames, group: _Group) -> npt.NDArray[np.void]:
    """Return the payloads of the frames of `group`, zero-extended: (n,) structured."""
    layout = group.layout
    start, length = frames.payload[group.rows], frames.length[group.rows]
    windows = np.ndarray(len(buffer) - layout.length + 1, f"V{layout.length}", buffer, strides=(1,))
    payloads = windows[start]
    short = np.flatnonzero(length < layout.length)
    if len(short):
        octets = payloads.view(np.uint8).reshape(-1, layout.length)
        octets[short] *= np.arange(layout.length, dtype=np.uint8) < length[short, None]
    return payloads.view(layout.dtype)
