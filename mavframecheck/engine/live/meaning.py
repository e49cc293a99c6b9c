"""What the streams of a link mean, looked at every few seconds: each field has its cost by batch."""

from __future__ import annotations

from mavframecheck.engine.contract import terms
from mavframecheck.engine.reading import Reading
from mavframecheck.engine.survey import Survey
from mavframecheck.model.contract import Terms
from mavframecheck.vehicle import Traffic
from mavframecheck.wire import Dialect, batch_of, whole
from mavframecheck.wire.framing import Framer

EVERY_S = 2.0
"""Streams are looked at so often (s)."""
ENOUGH = 1 << 20
"""Bytes after which they are looked at sooner."""


class Meaning:
    """The semantic map of a link."""

    def __init__(self, reading: Reading, dialect: Dialect) -> None:
        """Map what `reading` reads; who speaks is known there."""
        self._reading = reading
        self._dialect = dialect
        self._framer = Framer(dialect, stamped=True)
        self._survey = Survey()
        self._traffic = Traffic(dialect)
        self._waiting: list[bytes] = []
        self._size = self._offset = self._number = 0
        self._next: float | None = None
        self.streams: list[Terms] = []
        """What every stream means, and how often it comes, as of the last look."""

    def take(self, records: bytes, now: float) -> bool:
        """Take further records; return whether it was time to look at them."""
        self._waiting.append(records)
        self._size += len(records)
        self._next = now + EVERY_S if self._next is None else self._next
        if now < self._next and self._size <= ENOUGH:
            return False
        self.look(now)
        return True

    def look(self, now: float) -> None:
        """Map what waits."""
        data, self._waiting, self._size = b"".join(self._waiting), [], 0
        scan = self._framer.feed(whole(data, self._offset))
        batch = batch_of([scan], self._dialect, self._number)
        self._offset += len(data)
        self._number += len(batch)
        batch.restrict(self._traffic.admit(batch.frames))
        self._survey.update(batch, self._reading.context)
        self.streams = terms(self._survey.finish(self._reading.vehicles()))
        self._next = now + EVERY_S
