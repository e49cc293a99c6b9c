"""The heading of an injected GPS: 0 says 'none', north is 36000."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place, Table

Ints = npt.NDArray[np.int64]

MESSAGES = ("GPS_INPUT", "HIL_GPS")
INSTANCE = {"GPS_INPUT": "gps_id", "HIL_GPS": "id"}
CIRCLE_CDEG = 36_000
MAX_STREAMS = 1000


class _Stream:
    """The headings of one receiver of one sender."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.given = 0
        """Rows with a heading."""
        self.before: int | None = None
        """The last heading that was not 0."""
        self.zeros = 0
        """Rows of 0 since."""
        self.first: Place | None = None
        self.last: Place | None = None
        self.at_north = 0
        self.elsewhere = 0
        """Stretches of 0 between two headings near north, and between others."""
        self.rows = 0
        """Rows of 0 in those near north."""
        self.open: tuple[Place, Place] | None = None


class NorthAsZero(Check):
    """Streams whose heading is given, passes through north, and is exactly 0 there."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._streams: dict[tuple[str, int, int], _Stream] = {}

    def update(self, batch: Batch, _context: Context) -> None:
        """Follow the heading of every receiver through the batch."""
        for message in MESSAGES:
            table = batch.tables.get(message)
            if table is not None:
                # yaw ends the message, so that MAVLink 2 cuts a 0 off: what is missing there is a 0
                fixed = np.flatnonzero((table["fix_type"] >= 3) & (table.frames.version == 2))
                receiver = table.frames.sender[fixed].astype(np.int64) << 8
                receiver |= table[INSTANCE[message]][fixed].astype(np.int64)
                for one in np.unique(receiver).tolist():
                    self._follow(message, one, table, fixed[receiver == one])

    def _follow(self, message: str, receiver: int, table: Table, rows: Ints) -> None:
        key = (message, receiver >> 8, receiver & 0xFF)
        stream = self._streams.get(key)
        if stream is None:
            if len(self._streams) >= MAX_STREAMS:
                return
            subject = Subject(receiver >> 16, receiver >> 8 & 0xFF, message, "yaw")
            stream = self._streams[key] = _Stream(subject)
        yaw = table["yaw"][rows].astype(np.int64)
        stream.given += int(np.count_nonzero(yaw))
        for start, stop in _stretches(yaw != 0):
            if yaw[start] == 0:
                self._pause(stream, table, rows[start:stop])
            else:
                self._resume(stream, int(yaw[start]))
                stream.before = int(yaw[stop - 1])

    def _pause(self, stream: _Stream, table: Table, rows: Ints) -> None:
        first, last = table.frames.place(int(rows[0])), table.frames.place(int(rows[-1]))
        stream.open = (stream.open[0] if stream.open is not None else first, last)
        stream.zeros += len(rows)

    def _resume(self, stream: _Stream, after: int) -> None:
        """Judge the stretch of 0 that ends here: it counts where the heading passed north."""
        if stream.open is not None and stream.before is not None:
            limit = self.params["near_north_deg"] * 100
            if _from_north(stream.before) <= limit and _from_north(after) <= limit:
                stream.at_north += 1
                stream.rows += stream.zeros
                stream.first = stream.first or stream.open[0]
                stream.last = stream.open[1]
            else:
                stream.elsewhere += 1
        stream.open, stream.zeros = None, 0

    def finish(self) -> Iterable[Observation]:
        """Return one observation per receiver whose 0 lies at north, and hardly anywhere else."""
        for stream in self._streams.values():
            enough = stream.at_north >= self.params["min_passes"]
            if stream.first is None or stream.last is None or not enough:
                continue
            if stream.elsewhere <= self.params["max_elsewhere_share"] * stream.at_north:
                values = {"rows": stream.rows, "passes": stream.at_north}
                yield Observation(stream.subject, stream.first, stream.last, stream.rows, values)

    def verdict(self) -> Verdict:
        """Return the rows with a heading."""
        mine = (s for (_, sender, _), s in self._streams.items() if self.concerns_sender(sender))
        return Verdict(sum(stream.given for stream in mine))


def _from_north(yaw_cdeg: int) -> int:
    turned = yaw_cdeg % CIRCLE_CDEG
    return min(turned, CIRCLE_CDEG - turned)


def _stretches(given: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return [start, stop) of the stretches in which `given` stays the same."""
    if not len(given):
        return []
    edges = (np.flatnonzero(np.diff(given)) + 1).tolist()
    return list(zip([0, *edges], [*edges, len(given)], strict=True))
