"""Batches: what the floors above read, in the order it was received."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator

import numpy as np

from mavframecheck.model import Damage
from mavframecheck.wire.chunk import Chunk
from mavframecheck.wire.dialect import Dialect
from mavframecheck.wire.frames import Bools, Frames, join
from mavframecheck.wire.framing import Framer, Scan
from mavframecheck.wire.table import Tables


class Batch:
    """Some frames of a recording, the tables they decode to, and the damage found on the way."""

    def __init__(self, scans: list[Scan], first: int, dialect: Dialect) -> None:
        """Put the `scans` of all flows in order; `first` is the running number of the first frame."""
        self.damage: list[Damage] = sorted(
            (d for s in scans for d in s.damage), key=lambda d: d.offset
        )
        self.buffer, self.frames = _merge(scans)
        self.frames.number = np.arange(first, first + len(self.frames))
        self.layouts = dialect.layouts

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.frames)

    @functools.cached_property
    def tables(self) -> Tables:
        """The good frames, by message."""
        return Tables(np.frombuffer(self.buffer, np.uint8), self.frames, self.layouts)

    def restrict(self, rows: Bools) -> None:
        """Let `tables` hold only the frames at `rows`, (n,)."""
        self.tables = Tables(np.frombuffer(self.buffer, np.uint8), self.frames, self.layouts, rows)


def _merge(scans: list[Scan]) -> tuple[bytes, Frames]:
    """Return one buffer and one set of frames, ordered by offset in the recording."""
    if len(scans) == 1:
        return scans[0].buffer, scans[0].frames
    shift = 0
    for scan in scans:
        scan.frames.start += shift
        scan.frames.payload += shift
        shift += len(scan.buffer)
    frames = join([scan.frames for scan in scans])
    return b"".join(scan.buffer for scan in scans), frames.take(
        np.argsort(frames.offset, kind="stable")
    )


def read_batches(
    chunks: Iterable[list[Chunk]], dialect: Dialect, *, stamped: bool
) -> Iterator[Batch]:
    """Frame and decode `chunks` (lists of one chunk per flow) into batches.

    `stamped` says that an 8-byte stamp precedes each frame, as in a tlog.
    """
    framers: dict[int, Framer] = {}
    first = 0
    for group in chunks:
        scans = []
        for chunk in group:
            framer = framers.setdefault(chunk.flow, Framer(dialect, stamped=stamped))
            scans.append(framer.feed(chunk))
        batch = Batch(scans, first, dialect)
        first += len(batch)
        yield batch
    if framers:
        yield Batch([framer.feed(None) for framer in framers.values()], first, dialect)
