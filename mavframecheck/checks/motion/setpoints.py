"""Attitude setpoints whose quaternions come in another order: put in order they continue the flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Observation
from mavframecheck.geo import quaternions as q4
from mavframecheck.model import Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Place, Table

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

MESSAGE = "SET_ATTITUDE_TARGET"
MAX_STREAMS = 256
IN_ROW = 5
"""Setpoints in a row that must read better the other way."""
FAR = np.radians(60.0)
"""As they are, they would tilt the vehicle by more than this, rad, ..."""
NEAR = np.radians(25.0)
"""... and put in order they are within this, rad, of how it lies."""


@dataclass(slots=True)
class _Stream:
    """Setpoints of one sender to one system."""

    rows: int = 0
    run: int = 0
    begun: Place | None = None
    """First row of the run that is not over."""
    first: Place | None = None
    last: Place | None = None
    hits: int = 0
    left: float = 0.0
    labelled: float = 0.0
    """The largest differences from the vehicle while it reads better the other way, rad."""
    run_left: float = 0.0
    run_labelled: float = 0.0
    """The same of the run that is not over."""


class OrderOfSetpoints:
    """Follows the attitude setpoints of a recording."""

    def __init__(self) -> None:
        """Know no stream yet."""
        self._streams: dict[int, _Stream] = {}

    def rows(self, sender: int | None = None) -> int:
        """Return how many setpoints, of one sender or all, could be compared with the vehicle's attitude."""
        streams = self._streams.items()
        return sum(stream.rows for key, stream in streams if sender in (None, key >> 8))

    def update(self, batch: Batch, context: Context) -> None:
        """Compare each setpoint with the attitude that was said last."""
        table = batch.tables.get(MESSAGE)
        if table is None:
            return
        angles = [
            context.lookup(f"vehicle.{name}", table, late=False).values
            for name in ("roll", "pitch", "yaw")
        ]
        lies = q4.quaternion_from_euler(*angles)
        q = q4.unit(table["q"])
        heard = np.isfinite(lies).all(axis=1) & np.isfinite(q).all(axis=1)
        key = table.frames.sender << 8 | table["target_system"]
        for each in np.unique(key[heard]).tolist():
            if each in self._streams or len(self._streams) < MAX_STREAMS:
                rows = np.flatnonzero(heard & (key == each))
                self._follow(self._streams.setdefault(each, _Stream()), table, rows, q, lies)

    def _follow(self, stream: _Stream, table: Table, rows: Ints, q: Floats, lies: Floats) -> None:
        mine, theirs = q[rows], lies[rows]
        ordered = mine[:, [3, 0, 1, 2]]
        left, labelled = q4.angle_between(ordered, theirs), q4.angle_between(mine, theirs)
        wrong = (_tilt(mine) > FAR) & (_tilt(ordered) < FAR) & (left < NEAR) & (labelled > FAR)
        stream.rows += len(rows)
        for start, stop in _runs(wrong):
            if start or not stream.run:
                stream.run, stream.begun = 0, table.frames.place(int(rows[start]))
                stream.run_left = stream.run_labelled = 0.0
            before, stream.run = stream.run, stream.run + stop - start
            stream.run_left = max(stream.run_left, float(left[start:stop].max()))
            stream.run_labelled = max(stream.run_labelled, float(labelled[start:stop].max()))
            if stream.run >= IN_ROW:
                stream.first = stream.first or stream.begun
                stream.last = table.frames.place(int(rows[stop - 1]))
                stream.hits += stop - start + (before if before < IN_ROW else 0)
                stream.left = max(stream.left, stream.run_left)
                stream.labelled = max(stream.labelled, stream.run_labelled)
        if not wrong[-1]:
            stream.run = 0

    def found(self) -> list[Observation]:
        """Return one observation per stream that reads better the other way."""
        return [
            Observation(
                Subject(key >> 16, key >> 8 & 0xFF, MESSAGE, "q"),
                stream.first,
                stream.last,
                stream.hits,
                {
                    "message": MESSAGE,
                    "left": float(np.degrees(stream.left)),
                    "labelled": float(np.degrees(stream.labelled)),
                    "measured_in": "degrees",
                },
            )
            for key, stream in self._streams.items()
            if stream.first is not None and stream.last is not None
        ]


def _tilt(q: Floats) -> Floats:
    """Return (n,) how far attitudes lean from level, rad."""
    return 2 * np.arctan2(np.hypot(q[:, 1], q[:, 2]), np.hypot(q[:, 0], q[:, 3]))


def _runs(wrong: Bools) -> list[tuple[int, int]]:
    """Return [start, stop) of the stretches that are wrong."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], wrong, [False]))))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
