"""Streams of poses row by row: jumps that nobody announced, counters that run, poses that stand still."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Place, Verdict, place
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.model import Scalar, Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Table
from mavframecheck.wire.table import join

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

MAX_STREAMS = 256
COUNTED = ("VISION_POSITION_ESTIMATE", "GLOBAL_VISION_POSITION_ESTIMATE", "ODOMETRY")
"""Poses with a reset counter."""
POSES = (*COUNTED, "VICON_POSITION_ESTIMATE", "ATT_POS_MOCAP")
_FRAMES = ("frame_id", "child_frame_id")


class Key(NamedTuple):
    """One stream."""

    sender: int
    message: str
    frames: int
    """Frames of an ODOMETRY; they never follow each other."""


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
            self.first = self.first or place(table.frames, int(rows[0]))
            self.last = place(table.frames, int(rows[-1]))
            self.hits += len(rows)


State = TypeVar("State", bound=Found)


class _PoseCheck(Check, Generic[State]):
    """Follows the poses that are sent to a vehicle; what autopilots send is none."""

    messages: tuple[str, ...] = POSES

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._streams: dict[Key, State] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Follow every stream through the batch."""
        for key, table in _poses(batch, context, self.messages):
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
    batch: Batch, context: Context, messages: tuple[str, ...]
) -> Iterator[tuple[Key, Table]]:
    for message in messages:
        table = batch.tables.get(message)
        if table is None:
            continue
        role = context.lookup("sender.role", table)
        table = table.take(~role.among(lambda name: name == "autopilot"))
        key = table.frames.sender << 16
        for name in _FRAMES if message == "ODOMETRY" else ():
            key = key << 8 | table[name].astype(np.int64)
        if message != "ODOMETRY":
            key = key << 16
        for each in np.unique(key).tolist():
            yield Key(each >> 32, message, each & 0xFFFF), table.take(key == each)


def _xyz(table: Table) -> Floats:
    return np.column_stack([table[name].astype(np.float64) for name in ("x", "y", "z")])


class UnsignalledReset(_PoseCheck[Found]):
    """Steps that are no motion, with the reset counter as before."""

    messages = COUNTED

    def begin(self) -> Found:
        """Return the state of a new stream."""
        return Found()

    def follow(self, found: Found, table: Table, _context: Context) -> None:
        """Look at each step beside the one before and the one after it."""
        frames = table.frames
        table = table.take((frames.version == 2) & frames.t_valid & np.isfinite(_xyz(table)).all(1))
        if found.tail is not None:
            table = join([found.tail, table])
        if not len(table):
            return
        fresh = np.any(np.diff(_xyz(table), axis=0) != 0, axis=1)
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
        where, dt = _xyz(table), np.diff(table.frames.t_us) * 1e-6
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
        where = _xyz(table)
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


class RunningResetCounter(_PoseCheck[_Counting]):
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
class _Standing(Found):
    """The last position of a stream, and where the vehicle was when it was first sent."""

    pose: Floats | None = None
    begun: Place | None = None
    since: int = 0
    """Rows with this position so far."""
    lat: float = np.nan
    lon: float = np.nan
    heard_at: tuple[float, float] = (np.nan, np.nan)
    """Where the vehicle was when the stream was first heard, deg."""
    went_m: float = 0.0
    """How far it was away from there since."""


def _first_known(carried: float, values: Floats, start: Ints) -> Floats:
    """Return (n,) the first value that is known from row `start` on; `carried` where that is negative."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return np.where(start < 0, carried, np.nan)
    at = known[np.minimum(np.searchsorted(known, np.maximum(start, 0)), len(known) - 1)]
    inside = (at >= start) & (at <= np.arange(len(values)))
    found = np.where(inside, values[at], np.nan)
    return np.where((start < 0) & np.isfinite(carried), carried, found)


class FrozenPose(_PoseCheck[_Standing]):
    """Positions that stay the same to the last digit while the vehicle goes somewhere else."""

    def begin(self) -> _Standing:
        """Return the state of a new stream."""
        return _Standing()

    def follow(self, found: _Standing, table: Table, context: Context) -> None:
        """Judge every row by how long its position stood, and where the vehicle was at the beginning."""
        pose = _xyz(table)
        lat, lon = (
            context.lookup(name, table, late=False).values
            for name in ("vehicle.lat", "vehicle.lon")
        )
        before = pose[:1] + 1 if found.pose is None else found.pose[np.newaxis]
        fresh = np.any(pose != np.concatenate((before, pose[:-1])), axis=1)
        rows = np.arange(len(table))
        start = np.maximum.accumulate(np.where(fresh, rows, -1))
        count = rows - start + np.where(start < 0, found.since, 1)
        lat0 = _first_known(found.lat, lat, start)
        lon0 = _first_known(found.lon, lon, start)
        away = distance_m(lat0, lon0, lat, lon)
        moved = (count >= self.params["min_rows"]) & (away >= self.params["min_moved_m"])
        self._note(found, table, np.flatnonzero(moved), start, count, away)
        found.pose, found.since = pose[-1], int(count[-1])
        found.lat, found.lon = float(lat0[-1]), float(lon0[-1])
        if start[-1] >= 0:
            found.begun = place(table.frames, int(start[-1]))
        self._travel(found, lat, lon)

    @staticmethod
    def _travel(found: _Standing, lat: Floats, lon: Floats) -> None:
        known = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon))
        if not len(known):
            return
        if not np.isfinite(found.heard_at[0]):
            found.heard_at = float(lat[known[0]]), float(lon[known[0]])
        away = distance_m(*found.heard_at, lat[known], lon[known])
        found.went_m = max(found.went_m, float(away.max()))

    def verdict(self) -> Verdict:
        """Return the rows of streams during which the vehicle went far enough."""
        heard = [f for key, f in self._streams.items() if self.concerns_sender(key.sender)]
        rows = sum(f.rows for f in heard if f.went_m >= self.params["min_moved_m"])
        return Verdict(rows, "the vehicle hardly moves" if heard and not rows else "")

    def _note(
        self, found: _Standing, table: Table, hits: Ints, start: Ints, count: Ints, away: Floats
    ) -> None:
        if not len(hits):
            return
        if found.first is None:
            began = int(start[hits[0]])
            found.first = found.begun if began < 0 else place(table.frames, began)
        found.hit(table, hits)
        at = {name: float(table[name][hits[0]]) for name in ("x", "y", "z")}
        found.values = {
            **at,
            **found.values,
            "moved_m": max(float(found.values.get("moved_m") or 0.0), float(away[hits].max())),
            "rows": max(int(found.values.get("rows") or 0), int(count[hits].max())),
        }
