"""Streams of poses row by row: jumps that nobody announced, counters that run, rates."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Scalar, Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place, Table
from mavframecheck.wire.table import join

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

MAX_STREAMS = 256
COUNTED = ("VISION_POSITION_ESTIMATE", "GLOBAL_VISION_POSITION_ESTIMATE", "ODOMETRY")
"""Poses with a reset counter."""
POSES = (*COUNTED, "VICON_POSITION_ESTIMATE", "ATT_POS_MOCAP")
VARIANTS = {
    "ODOMETRY": ("frame_id", "child_frame_id"),
    "GPS_INPUT": ("gps_id",),
    "HIL_GPS": ("id",),
}
"""Fields that tell streams of one sender apart: frames, or the receiver."""


class Key(NamedTuple):
    """One stream."""

    sender: int
    message: str
    variant: int
    """Values of its `VARIANTS`: such rows never follow each other."""


@dataclass(slots=True)
class Found:
    """What was found in a stream, and the rows that the next batch goes on from."""

    rows: int = 0
    hits: int = 0
    first: Place | None = None
    last: Place | None = None
    values: dict[str, Scalar] = field(default_factory=dict)
    tail: Table | None = None
    judged: int = -1
    """Number of the last row that was judged."""

    def hit(self, table: Table, rows: Ints) -> None:
        """Note hits."""
        if len(rows):
            self.first = self.first or table.frames.place(int(rows[0]))
            self.last = table.frames.place(int(rows[-1]))
            self.hits += len(rows)


State = TypeVar("State", bound=Found)


class PoseCheck(Check, Generic[State]):
    """Follows the poses that are sent to a vehicle; what autopilots send is none."""

    messages: tuple[str, ...] = POSES
    autopilots = False
    """Whether what autopilots send counts."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._streams: dict[Key, State] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Follow every stream through the batch."""
        for key, table in _poses(batch, context, self.messages, autopilots=self.autopilots):
            found = self._streams.get(key)
            if found is None:
                if len(self._streams) >= MAX_STREAMS:
                    continue
                found = self._streams[key] = self.begin()
            found.rows += len(table)
            self.follow(found, table, context)

    @abstractmethod
    def begin(self) -> State:
        """Return the state of a new stream."""

    @abstractmethod
    def follow(self, found: State, table: Table, context: Context) -> None:
        """Judge further rows of a stream."""

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream with hits."""
        for key, found in self._streams.items():
            if found.first is not None and found.last is not None:
                subject = Subject(key.sender >> 8, key.sender & 0xFF, key.message)
                values = {"message": key.message, "times": found.hits, **found.values}
                yield Observation(subject, found.first, found.last, found.hits, values)

    def verdict(self) -> Verdict:
        """Return the rows followed."""
        followed = [f for key, f in self._streams.items() if self.concerns_sender(key.sender)]
        return Verdict(sum(found.rows for found in followed))


def _poses(
    batch: Batch, context: Context, messages: tuple[str, ...], *, autopilots: bool
) -> Iterator[tuple[Key, Table]]:
    for message in messages:
        table = batch.tables.get(message)
        if table is None:
            continue
        if not autopilots:
            role = context.lookup("sender.role", table)
            table = table.take(~role.among(lambda name: name == "autopilot"))
        variant = np.zeros(len(table), np.int64)
        for name in VARIANTS.get(message, ()):
            variant = variant << 8 | table[name].astype(np.int64)
        key = table.frames.sender.astype(np.int64) << 16 | variant
        for each in np.unique(key).tolist():
            yield Key(each >> 16, message, each & 0xFFFF), table.take(key == each)


def xyz(table: Table) -> Floats:
    """Return (n, 3) the position of poses, m."""
    return np.column_stack([table[name].astype(np.float64) for name in ("x", "y", "z")])


class UnsignalledReset(PoseCheck[Found]):
    """Steps that are no motion, with the reset counter as before."""

    messages = COUNTED

    def begin(self) -> Found:
        """Return the state of a new stream."""
        return Found()

    def follow(self, found: Found, table: Table, _context: Context) -> None:
        """Look at each step beside the one before and the one after it."""
        frames = table.frames
        table = table.take((frames.version == 2) & frames.t_valid & np.isfinite(xyz(table)).all(1))
        if found.tail is not None:
            table = join([found.tail, table])
        if not len(table):
            return
        fresh = np.any(np.diff(xyz(table), axis=0) != 0, axis=1)
        table = table.take(np.concatenate(([True], fresh)))  # repeated poses hide how fast it goes
        found.tail = table.take(np.arange(max(len(table) - 3, 0), len(table))).compact()
        if len(table) < 4:
            return
        jumps = self._jumps(table)
        jumps = jumps[table.frames.number[jumps] > found.judged]
        found.judged = int(table.frames.number[-2])
        self._describe(found, table, jumps)
        found.hit(table, jumps)

    def _jumps(self, table: Table) -> Ints:
        """Return the rows that a jump leads to: not the first two, nor the last."""
        where, dt = xyz(table), np.diff(table.frames.t_us) * 1e-6
        went = np.linalg.norm(np.diff(where, axis=0), axis=1)
        calm = np.clip(dt, self.params["min_interval_s"], None)
        speed = went / calm
        around = np.maximum(speed[:-2], speed[2:])
        step, apart = went[1:-1], calm[1:-1]
        jumped = step > self.params["min_jump_m"] + self.params["speeds"] * around * apart
        jumped &= (np.abs(dt[:-2]) < 1) & (np.abs(dt[1:-1]) < 1) & (np.abs(dt[2:]) < 1)
        back = np.linalg.norm(where[3:] - where[1:-2], axis=1)
        jumped &= back > step / 2
        counter = table["reset_counter"].astype(np.int64)
        jumped &= counter[2:-1] == counter[1:-2]
        return np.flatnonzero(jumped) + 2

    def _describe(self, found: Found, table: Table, jumps: Ints) -> None:
        where = xyz(table)
        for row in jumps.tolist():
            step = where[row] - where[row - 1]
            length = float(np.linalg.norm(step))
            if length > float(found.values.get("jump_m") or 0.0):
                found.values = {
                    "jump_m": length,
                    "dx": float(step[0]),
                    "dy": float(step[1]),
                    "dz": float(step[2]),
                    "counter": int(table["reset_counter"][row]),
                }


@dataclass(slots=True)
class _Counting(Found):
    """A counter, and when it went up of late."""

    counter: int = -1
    changes: Ints = field(default_factory=lambda: np.zeros(0, np.int64))


class RunningResetCounter(PoseCheck[_Counting]):
    """Counters that go up once a second and more, for long."""

    messages = COUNTED

    def begin(self) -> _Counting:
        """Return the state of a new stream."""
        return _Counting()

    def follow(self, found: _Counting, table: Table, _context: Context) -> None:
        """Note when the counter goes up, and how many times it did in a row of seconds."""
        table = table.take(table.frames.t_valid)
        if not len(table):
            return
        counter = table["reset_counter"].astype(np.int64)
        start = counter[:1] if found.counter < 0 else [found.counter]
        up = np.flatnonzero((counter - np.concatenate((start, counter[:-1]))) % 256 == 1)
        found.counter = int(counter[-1])
        many = int(self.params["min_changes"])
        times = np.concatenate((found.changes, table.frames.t_us[up]))
        last = np.arange(len(found.changes), len(times))
        lasted = times[last] - times[np.maximum(last - many + 1, 0)]
        running = (last >= many - 1) & (lasted >= 0) & (lasted <= self.params["within_s"] * 1e6)
        found.changes = times[-many:]
        found.hit(table, up[running])
        if running.any():
            found.values = {
                "changes": int(self.params["min_changes"]),
                "within_s": self.params["within_s"],
            }


@dataclass(slots=True)
class _Beating(Found):
    """How often a stream comes."""

    last_us: int = 0
    intervals: int = 0
    live_us: int = 0
    """Intervals without a pause, and how long they are together, us."""
    autopilot: str = "unknown"


class Rate(PoseCheck[_Beating]):
    """Poses that come more rarely, or more often, than an estimator can use."""

    def begin(self) -> _Beating:
        """Return the state of a new stream."""
        return _Beating()

    def follow(self, found: _Beating, table: Table, context: Context) -> None:
        """Add the intervals between rows."""
        table = table.take(table.frames.t_valid)
        if not len(table):
            return
        found.first = found.first or table.frames.place(0)
        found.last = table.frames.place(len(table) - 1)
        family = str(context.lookup("vehicle.autopilot", table).words[-1])
        found.autopilot = found.autopilot if family == "unknown" else family
        before = [found.last_us] if found.last_us else []
        dt = np.diff(np.concatenate((before, table.frames.t_us)).astype(np.int64))
        goes_on = dt[(dt >= 0) & (dt <= self.params["pause_s"] * 1e6)]
        found.intervals += len(goes_on)
        found.live_us += int(goes_on.sum())
        found.last_us = int(table.frames.t_us[-1])
        found.hits = found.rows if self._wrong(found) else 0

    def _wrong(self, found: _Beating) -> bool:
        if found.live_us < self.params["min_live_s"] * 1e6:
            return False
        hz = found.intervals / (found.live_us * 1e-6)
        least = self.params["px4_min_hz" if found.autopilot == "px4" else "min_hz"]
        found.values = {"hz": round(hz, 6), "least_hz": least, "autopilot": found.autopilot}
        return not least <= hz <= self.params["max_hz"]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that comes at another rate."""
        yield from (each for each in super().finish() if each.times)

    def verdict(self) -> Verdict:
        """Return the rows of streams that go on for long enough."""
        least = self.params["min_live_s"] * 1e6
        mine = [f for key, f in self._streams.items() if self.concerns_sender(key.sender)]
        told = sum(found.rows for found in mine if found.live_us >= least)
        if mine and not told:
            return Verdict(0, "no stream of poses goes on for long enough")
        return Verdict(told)
