"""Batches: what the floors above read, in the order it was received."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from mavframecheck.model import Damage
from mavframecheck.wire.chunk import Chunk
from mavframecheck.wire.dialect import Dialect
from mavframecheck.wire.frames import STX_V2, Bools, Frames, are_magic, join
from mavframecheck.wire.framing import Framer, Scan
from mavframecheck.wire.table import Table, Tables

MANY_MAGIC = 900_000
SHORT = 1 << 18
"""Bytes of a chunk that is read in parts because it holds more magic bytes than that."""


class Batch:
    """Some frames of a recording, the tables they decode to, and the damage found on the way."""

    def __init__(
        self,
        frames: Frames,
        dialect: Dialect,
        buffer: bytes = b"",
        tables: Mapping[str, Table] | None = None,
    ) -> None:
        """Hold `frames`, whose payloads lie in `buffer`, or whose `tables` never were bytes."""
        self.frames = frames
        self.damage: list[Damage] = []
        self.buffer = buffer
        self.layouts = dialect.layouts
        if tables is not None:
            self.tables = tables

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.frames)

    @functools.cached_property
    def tables(self) -> Mapping[str, Table]:
        """The good frames, by message."""
        return Tables(np.frombuffer(self.buffer, np.uint8), self.frames, self.layouts)

    def restrict(self, rows: Bools) -> None:
        """Let `tables` hold only the frames at `rows`, (n,)."""
        self.tables = Tables(np.frombuffer(self.buffer, np.uint8), self.frames, self.layouts, rows)


def batch_of(scans: list[Scan], dialect: Dialect, first: int = 0, clock_us: int = 0) -> Batch:
    """Put the `scans` of all flows in order; `first` and `clock_us` go on from the batch before."""
    buffer, frames = _merge(scans)
    frames.number = np.arange(first, first + len(frames))
    frames.clock_us = np.maximum.accumulate(
        np.maximum(np.where(frames.t_valid, frames.t_us, 0), clock_us)
    )
    batch = Batch(frames, dialect, buffer)
    batch.damage = sorted((d for s in scans for d in s.damage), key=lambda d: d.offset)
    return batch


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


def _bounded(chunks: Iterable[list[Chunk]]) -> Iterator[list[Chunk]]:
    """Cut a chunk that holds magic bytes by the hundred thousand: each is looked at as a frame."""
    for group in chunks:
        plain = len(group) == 1 and len(group[0].starts) == 1
        if not plain or not _much_magic(group[0].data):
            yield group
            continue
        (chunk,) = group
        for at in range(0, len(chunk.data), SHORT):
            part = chunk.data[at : at + SHORT]
            yield [chunk._replace(data=part, offsets=chunk.offsets + at)]


def _much_magic(data: bytes) -> bool:
    """Return whether there is too much; a count that takes 0xFF along costs little and mostly settles it."""
    octets = np.frombuffer(data, np.uint8)
    at_most = np.count_nonzero(octets >= STX_V2)
    return bool(at_most > MANY_MAGIC and np.count_nonzero(are_magic(octets)) > MANY_MAGIC)


def read_batches(
    chunks: Iterable[list[Chunk]], dialect: Dialect, *, stamped: bool
) -> Iterator[Batch]:
    """Frame and decode `chunks` (lists of one chunk per flow) into batches.

    `stamped` says that an 8-byte stamp precedes each frame, as in a tlog.
    """
    framers: dict[int, Framer] = {}
    first = clock_us = 0
    for group in _bounded(chunks):
        for chunk in group:
            framers.setdefault(chunk.flow, Framer(dialect, stamped=stamped))
        scans = [framers[chunk.flow].feed(chunk) for chunk in group]
        batch = batch_of(scans, dialect, first, clock_us)
        first += len(batch)
        clock_us = int(batch.frames.clock_us[-1]) if len(batch) else clock_us
        yield batch
        del batch, scans  # not in memory while the next one is read
    if framers:
        scans = [framer.feed(None) for framer in framers.values()]
        yield batch_of(scans, dialect, first, clock_us)
