"""What a link delivers, made into tlog records: a receive time, then the frame as it came."""

from __future__ import annotations

import numpy as np

from mavframecheck.model import Damage
from mavframecheck.wire.batch import Batch, batch_of
from mavframecheck.wire.chunk import Chunk
from mavframecheck.wire.dialect import Dialect
from mavframecheck.wire.frames import STAMP
from mavframecheck.wire.framing import Framer, Scan


class Records:
    """Finds the frames of a link, flow by flow, and writes each down with its receive time."""

    def __init__(self, dialect: Dialect) -> None:
        """Read with the ids and checksum seeds of `dialect`."""
        self._dialect = dialect
        self._framers: dict[int, Framer] = {}
        self.damage: list[Damage] = []
        """What held no frame in the bytes taken last; it is in no record."""

    def take(self, chunks: list[Chunk]) -> bytes:
        """Return the records that are certain once `chunks`, one per flow, have arrived."""
        return self._written(
            [
                self._framers.setdefault(chunk.flow, Framer(self._dialect, stamped=False)).feed(
                    chunk
                )
                for chunk in chunks
            ]
        )

    def close(self) -> bytes:
        """Return the records of what still waited for the bytes behind it: no more will come."""
        return self._written([framer.feed(None) for framer in self._framers.values()])

    def _written(self, scans: list[Scan]) -> bytes:
        if not scans:
            self.damage = []
            return b""
        batch = batch_of(scans, self._dialect)
        self.damage = batch.damage
        return written(batch)


def written(batch: Batch) -> bytes:
    """Return the frames of `batch` as tlog records: 8 bytes big-endian, us since 1970, then the frame."""
    frames = batch.frames
    size = frames.size + STAMP
    record = np.repeat(np.arange(len(frames)), size)
    within = np.arange(len(record)) - np.repeat(np.cumsum(size) - size, size)
    octets = np.frombuffer(batch.buffer, np.uint8)
    data = octets[np.maximum(frames.start[record] + within - STAMP, 0)]
    data[within < STAMP] = frames.t_us.astype(">u8").view(np.uint8)
    return bytes(data)
