"""Set-points that an autopilot needs without a break, with a break in between."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.clocks import ClockCheck
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place, Table

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.void]

LOCAL, GLOBAL, ATTITUDE = (
    "SET_POSITION_TARGET_LOCAL_NED",
    "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_ATTITUDE_TARGET",
)
MAX_STREAMS = 64
"""Senders of set-points that are followed, each per target."""
MAX_GAPS = 256
"""Gaps that are kept of each; what comes after is counted only."""
NEEDED = {"px4": "OFFBOARD", "ardupilot": "GUIDED"}
"""Family -> the mode in which it flies by set-points."""
_ROW = np.dtype(
    [(name, np.int64) for name in ("number", "t_us", "offset", "size", "stream", "family")]
    + [("t_valid", np.bool_), ("moves", np.bool_)]
)
"""A set-point: where, from whom to whom, whether it flies a PX4 (1) or an ArduPilot (2), else 0, and
whether it only gives a velocity that is not zero."""
_BUSY = 3
"""So many frames of others in a gap say that it is not the recording that has it."""


class Gap(NamedTuple):
    """Two neighbours of a stream that are far apart."""

    first: Place
    last: Place
    seconds: float
    family: int


@dataclass(slots=True)
class _Stream:
    """The set-points of one sender to one system."""

    last: Rows = field(default_factory=lambda: np.zeros(0, _ROW))
    rows: int = 0
    gaps: list[Gap] = field(default_factory=list)
    times: int = 0


class SetpointGaps(ClockCheck):
    """Breaks in the set-points of a vehicle that flies by them before and after."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no sender yet."""
        super().__init__(params, dialect)
        self._streams: dict[int, _Stream] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Follow each sender's set-points through the batch."""
        super().update(batch, context)
        tables = [batch.tables.get(name) for name in (LOCAL, GLOBAL, ATTITUDE)]
        parts = [_rows(table, context) for table in tables if table is not None]
        if not parts:
            return
        rows = np.concatenate(parts)
        rows = rows[np.argsort(rows["number"])]
        streams, first = np.unique(rows["stream"], return_index=True)
        for stream in streams[np.argsort(first)].tolist():
            if stream in self._streams or len(self._streams) < MAX_STREAMS:
                mine = rows[rows["stream"] == stream]
                self._follow(self._streams.setdefault(stream, _Stream()), mine)

    def _follow(self, stream: _Stream, rows: Rows) -> None:
        """Look at the time between neighbours."""
        stream.rows += int(np.count_nonzero(rows["family"]))
        rows = np.concatenate((stream.last, rows))
        stream.last = rows[-1:]
        before, after = rows[:-1], rows[1:]
        apart_s = (after["t_us"] - before["t_us"]) * 1e-6
        needed = (before["family"] > 0) & (before["family"] == after["family"])
        needed &= before["t_valid"] & after["t_valid"]
        needed &= after["number"] - before["number"] > _BUSY
        needed &= (before["family"] == 1) | (before["moves"] & after["moves"])
        long = np.where(
            before["family"] == 1, self.params["px4_gap_s"], self.params["ardupilot_gap_s"]
        )
        found = np.flatnonzero(needed & (apart_s > long) & (apart_s < self.params["longest_s"]))
        stream.times += len(found)
        for k in found[: MAX_GAPS - len(stream.gaps)].tolist():
            family = int(before["family"][k])
            gap = Gap(_place(before[k]), _place(after[k]), float(apart_s[k]), family)
            stream.gaps.append(gap)

    def finish(self) -> Iterable[Observation]:
        """Return one observation per sender and target with breaks that are long by the vehicle's clock."""
        for key, stream in sorted(self._streams.items()):
            sender, target = divmod(key, 256)
            rate = self._rate(target)
            gaps = [gap for gap in stream.gaps if gap.seconds * rate > self._longest(gap)]
            if not gaps:
                continue
            worst = max(gaps, key=lambda gap: gap.seconds)
            values: dict[str, Scalar] = {
                "seconds": worst.seconds,
                "times": len(gaps),
                "limit_s": self._longest(worst),
                "family": "PX4" if worst.family == 1 else "ArduPilot",
            }
            who = Subject(sender >> 8, sender & 0xFF)
            yield Observation(who, gaps[0].first, gaps[-1].last, len(gaps), values)

    def _longest(self, gap: Gap) -> float:
        return float(self.params["px4_gap_s" if gap.family == 1 else "ardupilot_gap_s"])

    def _rate(self, target: int) -> float:
        """Return how slow the vehicle's time runs, at most 1: a slow simulation has more of ours."""
        pools = [
            pool
            for sender in self.clocks.of
            if self.autopilot(sender) and target in (0, sender >> 8)
            if (pool := self.clocks.pool(sender)) is not None
        ]
        return min([1.0, *(pool.rate for pool in pools)]) * 1.05

    def verdict(self) -> Verdict:
        """Return the set-points that a vehicle flew by."""
        mine = (s for key, s in self._streams.items() if self.concerns_sender(key // 256))
        return Verdict(sum(stream.rows for stream in mine))


def _rows(table: Table, context: Context) -> Rows:
    """Return the set-points of a table that do not come from an autopilot."""
    said = context.lookup("sender.role", table).among(lambda role: role != "autopilot")
    table = table.take(np.flatnonzero(said))
    rows = np.zeros(len(table), _ROW)
    frames = table.frames
    for name in ("number", "t_us", "offset", "size", "t_valid"):
        rows[name] = getattr(frames, name)
    rows["stream"] = frames.sender * 256 + table["target_system"]
    family = context.lookup("vehicle.autopilot", table, late=False)
    mode = context.lookup("vehicle.mode", table, late=False)
    armed = context.lookup("vehicle.armed", table, late=False)
    flown = mode.known & armed.known & (armed.values == 1)
    px4 = family.known & family.among(lambda name: name == "px4")
    ardu = family.known & family.among(lambda name: name.startswith("ardu"))
    rows["family"][flown & px4 & mode.among(lambda name: name == NEEDED["px4"])] = 1
    rows["family"][flown & ardu & mode.among(lambda name: name == NEEDED["ardupilot"])] = 2
    rows["moves"] = _velocity_only(table)
    return rows


def _velocity_only(table: Table) -> Bools:
    """Return (n,) set-points that give a velocity other than zero, and no position."""
    if table.name == ATTITUDE:
        return np.zeros(len(table), np.bool_)
    mask = table["type_mask"]
    moving = (table["vx"] != 0) | (table["vy"] != 0) | (table["vz"] != 0)
    position, velocity = _ignored("X", "Y", "Z"), _ignored("VX", "VY", "VZ")
    return np.asarray((mask & position == position) & (mask & velocity == 0) & moving)


def _ignored(*axes: str) -> int:
    return sum(constant(f"POSITION_TARGET_TYPEMASK.{axis}_IGNORE") for axis in axes)


def _place(row: np.void) -> Place:
    t_us = int(row["t_us"]) if row["t_valid"] else None
    return Place(int(row["number"]), t_us, int(row["offset"]), int(row["size"]))
