"""Checks of setpoint streams: what only the row of messages, or the way of the vehicle meanwhile, gives away."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.geo.rotations import wrapped, wrapped_deg
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Frames, Place, Table

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

LOCAL, GLOBAL = "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT"
MAX_STREAMS = 256
"""Streams of setpoints that are followed."""
MAX_AGE_US = 5_000_000
"""Where the vehicle was is known from no longer ago, us."""
DEGREE_M = 111_320.0
"""Length of a degree of latitude, m: good to half a percent, enough for a direction."""
_AXES = ("x", "y", "z")


def _bits(*names: str) -> int:
    return sum(constant(f"POSITION_TARGET_TYPEMASK.{name}_IGNORE") for name in names)


YAW, YAW_RATE = _bits("YAW"), _bits("YAW_RATE")
FORCE = constant("POSITION_TARGET_TYPEMASK.FORCE_SET")
POSITION, ACCELERATION = _bits("X", "Y", "Z"), _bits("AX", "AY", "AZ")
MOTION = POSITION | ACCELERATION | _bits("VX", "VY", "VZ")
OFFSET_FRAMES = tuple(constant(f"MAV_FRAME.{n}") for n in ("LOCAL_OFFSET_NED", "BODY_OFFSET_NED"))
NORTH_FRAMES = tuple(constant(f"MAV_FRAME.{n}") for n in ("LOCAL_NED", "LOCAL_OFFSET_NED"))


class Stream(NamedTuple):
    """Setpoints of one sender to one system, in the order in which they were sent."""

    sender: int
    """``sysid * 256 + compid``."""
    target: int
    table: Table
    """The rows of a batch."""

    @property
    def key(self) -> tuple[int, int, str]:
        """What tells streams apart."""
        return self.sender, self.target, self.table.name

    @property
    def subject(self) -> Subject:
        """Whom a finding is about."""
        return Subject(self.sender >> 8, self.sender & 0xFF, self.table.name)

    @property
    def system(self) -> int:
        """The vehicle meant: the target, else the one that shares the sender's system."""
        return self.target or self.sender >> 8


def streams(batch: Batch, context: Context, messages: Iterable[str]) -> Iterator[Stream]:
    """Yield the setpoint streams in a batch; what autopilots send is none."""
    for message in messages:
        table = batch.tables.get(message)
        if table is None:
            continue
        ours = ~_by_autopilots(table, context)
        key = table.frames.sender * 256 + table["target_system"]
        for each in np.unique(key[ours]).tolist():
            mine = table.take(np.flatnonzero(ours & (key == each)))
            yield Stream(each >> 8, each & 0xFF, mine)


def _by_autopilots(table: Table, context: Context) -> Bools:
    return context.lookup("sender.role", table).among(lambda role: role == "autopilot")


class AsOf:
    """The last values that each autopilot said in one message, as of any row.

    Only what was said before a row counts, so that nothing depends on where batches are cut.
    """

    def __init__(self, message: str, scales: dict[str, float]) -> None:
        """Follow fields of `message`, each times its scale."""
        self._message = message
        self._scales = scales
        self._system = self._number = self._t_us = np.zeros(0, np.int64)
        self._values = {name: np.zeros(0) for name in scales}

    def feed(self, batch: Batch, context: Context) -> None:
        """Take in what a batch says."""
        table = batch.tables.get(self._message)
        if table is None:
            return
        table = table.take(np.flatnonzero(_by_autopilots(table, context)))
        frames = table.frames
        stamp = np.where(frames.t_valid, frames.t_us, -1)
        self._system = np.concatenate((self._system, frames.sysid.astype(np.int64)))
        self._number = np.concatenate((self._number, frames.number))
        self._t_us = np.concatenate((self._t_us, stamp))
        for name, scale in self._scales.items():
            self._values[name] = np.concatenate((self._values[name], table[name] * scale))

    def at(self, stream: Stream) -> dict[str, Floats]:
        """Return (n,) each field as of the rows of a stream, NaN where it is not known."""
        mine = np.flatnonzero(self._system == stream.system)
        frames = stream.table.frames
        found = np.searchsorted(self._number[mine], frames.number) - 1
        known = found >= 0
        if not known.any():
            return {name: np.full(len(stream.table), np.nan) for name in self._scales}
        rows = mine[np.maximum(found, 0)]
        timed = frames.t_valid & (self._t_us[rows] >= 0)
        fresh = ~timed | (np.abs(frames.t_us - self._t_us[rows]) <= MAX_AGE_US)
        return {n: np.where(known & fresh, v[rows], np.nan) for n, v in self._values.items()}

    def settle(self) -> None:
        """Forget all but the last value of each system: the batch is done."""
        backwards = self._system[::-1]
        last = np.sort(len(backwards) - 1 - np.unique(backwards, return_index=True)[1])
        self._system, self._number = self._system[last], self._number[last]
        self._t_us = self._t_us[last]
        self._values = {name: values[last] for name, values in self._values.items()}


def local_position() -> AsOf:
    """Return where vehicles are in their local frame, m."""
    return AsOf("LOCAL_POSITION_NED", dict.fromkeys(_AXES, 1.0))


@dataclass(slots=True)
class Found:
    """What was found in one stream."""

    first: Place
    last: Place
    times: int
    values: dict[str, Scalar]


class SetpointCheck(Check):
    """A check of setpoint streams: one observation a stream."""

    messages: tuple[str, ...] = (LOCAL, GLOBAL)

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Follow no stream yet."""
        super().__init__(params, dialect)
        self.checked = 0
        self.found: dict[tuple[int, int, str], Found] = {}
        self._subjects: dict[tuple[int, int, str], Subject] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Follow each stream through the batch."""
        self.learn(batch, context)
        for stream in streams(batch, context, self.messages):
            room = stream.key in self._subjects or len(self._subjects) < MAX_STREAMS
            if room and self.concerns_sender(stream.sender):
                self._subjects[stream.key] = stream.subject
                with np.errstate(all="ignore"):  # a setpoint may hold NaN and infinity
                    self.follow(stream)
        self.settle()

    def learn(self, batch: Batch, context: Context) -> None:
        """Take in what a batch says of the vehicles."""

    @abstractmethod
    def follow(self, stream: Stream) -> None:
        """Read the next rows of a stream."""

    def settle(self) -> None:
        """Forget what only this batch could ask for."""

    def report(
        self, key: tuple[int, int, str], first: Place, last: Place, hits: int, /, **values: Scalar
    ) -> None:
        """Add hits to what was found in a stream; the earliest ones give the values."""
        known = self.found.setdefault(key, Found(first, last, 0, values))
        earlier = first.number < known.first.number
        same = first.number == known.first.number
        if earlier or (same and str(values) < str(known.values)):
            known.first, known.values = first, values
        known.last = max(known.last, last, key=lambda each: each.number)
        known.times += hits

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream in which something was found."""
        for key in sorted(self.found):
            it = self.found[key]
            yield Observation(self._subjects[key], it.first, it.last, it.times, it.values)

    def verdict(self) -> Verdict:
        """Return the setpoints looked at."""
        return Verdict(self.checked)


@dataclass(slots=True)
class _Flicker:
    """The last row of a stream, and its last switches."""

    kind: int = -1
    used: bool = False
    times: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    places: list[Place] = field(default_factory=list)
    counted: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))


class FlickeringYaw(SetpointCheck):
    """Setpoints of one kind that switch between a yaw and none, over and over."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._last: dict[tuple[int, int, str], _Flicker] = {}

    def follow(self, stream: Stream) -> None:
        """Find the switches between neighbours of one kind (same frame, same fields in use)."""
        table, state = stream.table, self._last.setdefault(stream.key, _Flicker())
        mask = table["type_mask"].astype(np.int64)
        kind = table["coordinate_frame"].astype(np.int64) << 16 | mask & MOTION
        used = (mask & YAW) == 0
        before = np.concatenate(([state.kind], kind[:-1]))
        used_before = np.concatenate(([state.used], used[:-1]))
        state.kind, state.used = int(kind[-1]), bool(used[-1])
        self.checked += len(table)
        frames = table.frames
        switched = np.flatnonzero((kind == before) & (used != used_before) & frames.t_valid)
        if len(switched):
            self._count(stream.key, state, frames, switched)

    def _count(
        self, key: tuple[int, int, str], state: _Flicker, frames: Frames, switched: Ints
    ) -> None:
        """Count the switches that lie close together, with those before the batch."""
        several, kept = self.params["switches"], len(state.times)
        times = np.concatenate((state.times, frames.t_us[switched]))
        counted = np.concatenate((state.counted, np.zeros(len(switched), np.bool_)))
        close = _close_together(times, several, self.params["within_s"] * 1e6)

        def where(n: int) -> Place:
            return state.places[n] if n < kept else frames.place(int(switched[n - kept]))

        new = np.flatnonzero(close & ~counted)
        if len(new):
            self.report(key, where(int(new[0])), where(int(new[-1])), len(new))
        tail = range(max(len(times) - several + 1, 0), len(times))
        state.places = [where(n) for n in tail]
        state.times, state.counted = times[tail.start :], (close | counted)[tail.start :]


def _close_together(times: Ints, several: int, within_us: float) -> Bools:
    """Return (n,) times that lie with `several` - 1 others of their neighbours within a stretch."""
    close = np.zeros(len(times), np.bool_)
    span = times[several - 1 :] - times[: len(times) - several + 1]
    starts = np.flatnonzero((span >= 0) & (span <= within_us))
    for k in range(several):
        close[starts + k] = True
    return close


@dataclass(slots=True)
class _Run:
    """The same offset, sent again and again."""

    what: tuple[float, ...]
    first: Place
    last: Place
    start: Floats
    """(3,) m, NED: where the vehicle was at the first of them."""
    end: Floats
    times: int = 0


class RunawayOffset(SetpointCheck):
    """An offset from the vehicle that is sent again while the vehicle moves: the target runs away."""

    messages = (LOCAL,)

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no vehicle yet."""
        super().__init__(params, dialect)
        self._where = local_position()
        self._runs: dict[tuple[int, int, str], _Run] = {}
        self._unplaced = 0

    def learn(self, batch: Batch, context: Context) -> None:
        """Learn where the vehicles are."""
        self._where.feed(batch, context)

    def settle(self) -> None:
        """Keep the last positions."""
        self._where.settle()

    def follow(self, stream: Stream) -> None:
        """Put equal neighbours together to runs."""
        table, key = stream.table, stream.key
        mask = table["type_mask"].astype(np.int64)
        frame = table["coordinate_frame"].astype(np.int64)
        offset = np.isin(frame, OFFSET_FRAMES) & (mask & POSITION != POSITION)
        if not offset.any() and key not in self._runs:
            return
        numbers = np.stack([_used(table, mask, name) for name in _AXES], axis=1)
        what = np.column_stack((np.where(offset, frame, -1), np.where(offset[:, None], numbers, 0)))
        at = np.stack(list(self._where.at(stream).values()), axis=1)
        self.checked += int(np.count_nonzero(offset & np.isfinite(at).all(axis=1)))
        self._unplaced += int(np.count_nonzero(offset & ~np.isfinite(at).all(axis=1)))
        self._stays(stream, offset, numbers, at)
        self._continue(key, what, at, table.frames)

    def _stays(self, stream: Stream, offset: Bools, numbers: Floats, at: Floats) -> None:
        """Find offsets that are, number for number, where the vehicle is: as a place they say "stay"."""
        far = np.linalg.norm(numbers, axis=1) >= self.params["far_m"]
        near = np.linalg.norm(numbers - at, axis=1) <= self.params["near_m"]
        rows = np.flatnonzero(offset & far & near)
        if len(rows):
            first, last = int(rows[0]), int(rows[-1])
            values = self._values(
                numbers[first], stream.table["coordinate_frame"][first], at[first]
            )
            frames = stream.table.frames
            self.report(stream.key, frames.place(first), frames.place(last), len(rows), **values)

    def _continue(
        self, key: tuple[int, int, str], what: Floats, at: Floats, frames: Frames
    ) -> None:
        """Go through the runs of a batch; the first may go on from the batch before."""
        edges = np.flatnonzero((what[1:] != what[:-1]).any(axis=1)) + 1
        starts, ends = np.concatenate(([0], edges)), np.concatenate((edges, [len(what)])) - 1
        worth = (ends > starts) | (starts == 0) | (ends == len(what) - 1)
        for first, last in zip(starts[worth].tolist(), ends[worth].tolist(), strict=True):
            wanted = tuple(what[first].tolist())
            run = self._runs.get(key)
            if run is None or run.what != wanted or first:
                self._close(key)
                if wanted[0] < 0:
                    continue
                begin = frames.place(first)
                run = self._runs[key] = _Run(wanted, begin, begin, at[first], at[first])
            run.last, run.end = frames.place(last), at[last]
            run.times += last - first + 1

    def _close(self, key: tuple[int, int, str]) -> None:
        """Judge the run of a stream that has ended."""
        run = self._runs.pop(key, None)
        if run is None or run.times < self.params["times"]:
            return
        offset = np.array(run.what[1:])
        moved, length = float(np.linalg.norm(run.end - run.start)), float(np.linalg.norm(offset))
        enough = max(self.params["min_moved_m"], self.params["min_share"] * length)
        if length >= self.params["min_offset_m"] and moved >= enough:
            values = self._values(offset, run.what[0], run.start)
            values |= {"times": run.times, "moved_m": moved}
            self.report(key, run.first, run.last, run.times, **values)

    def _values(self, offset: Floats, frame: float, at: Floats) -> dict[str, Scalar]:
        """Return what is said of an offset that was sent while the vehicle was `at` some place."""
        there = dict(zip(_AXES, offset.tolist(), strict=True))
        absolute_m = float(np.linalg.norm(offset - at))
        length_m = float(np.linalg.norm(offset))
        return {
            **there,
            "frame": int(frame),
            "length_m": length_m,
            "absolute_m": absolute_m,
            "times": 1,
            "moved_m": 0.0,
        }

    def finish(self) -> Iterable[Observation]:
        """Judge the runs that are still open, too."""
        with np.errstate(all="ignore"):
            for key in list(self._runs):
                self._close(key)
        return super().finish()

    def verdict(self) -> Verdict:
        """Return the offsets that could be judged."""
        if self._unplaced and not self.checked:
            return Verdict(0, "no LOCAL_POSITION_NED before the offsets")
        return Verdict(self.checked)


def _used(table: Table, mask: Ints, name: str) -> Floats:
    """Return (n,) a coordinate of the position, 0 where the mask ignores it."""
    return np.where(mask & _bits(name.upper()), 0.0, table[name].astype(float))


@dataclass(slots=True)
class _Legs:
    """What a stream has asked the nose to do so far."""

    target: tuple[float, float] | None = None
    """Where the last leg leads to, m north and east."""
    asked: tuple[float, float] = (np.nan, np.nan)
    """The target of the last setpoint, far or near."""
    nose_first: bool = False
    """A leg was flown with the nose ahead."""
    zero: int = 0
    """Legs in a row that lead elsewhere than north, with a yaw of exactly 0."""
    courses: list[int] = field(default_factory=list)
    first: Place | None = None


class ZeroYaw(SetpointCheck):
    """A yaw of exactly 0 that nobody seems to have meant."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no vehicle yet."""
        super().__init__(params, dialect)
        self._local = local_position()
        self._global = AsOf("GLOBAL_POSITION_INT", {"lat": 1e-7, "lon": 1e-7})
        self._attitude = AsOf("ATTITUDE", {"yaw": 1.0})
        self._legs: dict[tuple[int, int, str], _Legs] = {}

    def learn(self, batch: Batch, context: Context) -> None:
        """Learn where the vehicles are, and where they point."""
        for source in (self._local, self._global, self._attitude):
            source.feed(batch, context)

    def settle(self) -> None:
        """Keep what was said last."""
        for source in (self._local, self._global, self._attitude):
            source.settle()

    def follow(self, stream: Stream) -> None:
        """Look at the setpoints whose yaw counts, from north."""
        mask = stream.table["type_mask"].astype(np.int64)
        frame = stream.table["coordinate_frame"]
        from_north = np.isin(frame, NORTH_FRAMES) | (stream.table.name == GLOBAL)
        rows = np.flatnonzero(from_north & (mask & YAW == 0))
        if len(rows):
            self.checked += len(rows)
            used = stream._replace(table=stream.table.take(rows))
            self._left_in(used, mask[rows])
            self._follow_legs(used, mask[rows])

    def _left_in(self, stream: Stream, mask: Ints) -> None:
        """Find zeros that a mask lets count by mistake, while the vehicle points elsewhere."""
        table = stream.table
        yaw = self._attitude.at(stream)["yaw"]
        both = (mask & YAW_RATE == 0) & (table["yaw_rate"] == 0) & (mask != 0)
        ignored = mask & ACCELERATION == ACCELERATION
        shifted = (mask & FORCE != 0) & ignored & (mask & YAW_RATE != 0)
        away = np.abs(wrapped(yaw)) > np.radians(self.params["min_turn_deg"])
        rows = np.flatnonzero((table["yaw"] == 0) & away & (both | shifted))
        if len(rows):
            first, last = (table.frames.place(int(rows[k])) for k in (0, -1))
            heading = float(np.degrees(yaw[rows[0]]))
            how = "yaw_rate" if both[rows[0]] else "force_bit"
            self.report(stream.key, first, last, len(rows), how=how, yaw_deg=heading, courses="")

    def _follow_legs(self, stream: Stream, mask: Ints) -> None:
        """Find legs to other places than north with a yaw of 0, after legs flown nose first."""
        north, east, dn, de = self._targets(stream)
        yaw = stream.table["yaw"].astype(float)
        legs = self._legs.setdefault(stream.key, _Legs())
        before_n = np.concatenate(([legs.asked[0]], north[:-1]))
        before_e = np.concatenate(([legs.asked[1]], east[:-1]))
        changed = (north != before_n) | (east != before_e)
        legs.asked = float(north[-1]), float(east[-1])
        far = np.hypot(dn, de) >= self.params["min_leg_m"]
        frames = stream.table.frames
        for row in np.flatnonzero(changed & far & (mask & POSITION == 0)).tolist():
            target = (float(north[row]), float(east[row]))
            if legs.target is None or np.hypot(
                target[0] - legs.target[0], target[1] - legs.target[1]
            ) >= float(self.params["min_leg_m"]):
                legs.target = target
                self._leg(
                    stream.key,
                    legs,
                    float(np.arctan2(de[row], dn[row])),
                    float(yaw[row]),
                    frames.place(row),
                )

    def _leg(
        self, key: tuple[int, int, str], legs: _Legs, course: float, yaw: float, at: Place
    ) -> None:
        """Take in one leg: its course and the yaw that goes with it, rad."""
        if yaw != 0:
            ahead = abs(float(wrapped(np.array(yaw - course)))) < np.radians(
                self.params["nose_first_deg"]
            )
            legs.nose_first |= ahead
            legs.zero, legs.first, legs.courses = 0, None, []
            return
        if abs(course) < np.radians(self.params["min_turn_deg"]):
            return
        legs.zero += 1
        legs.first = legs.first or at
        legs.courses = [*legs.courses, round(float(np.degrees(course)))][: self.params["legs"]]
        if legs.nose_first and legs.zero >= self.params["legs"]:
            several = legs.zero if legs.zero == self.params["legs"] else 1
            named = ", ".join(f"{each % 360} deg" for each in legs.courses)
            self.report(key, legs.first, at, several, how="legs", yaw_deg=0.0, courses=named)

    def _targets(self, stream: Stream) -> tuple[Floats, Floats, Floats, Floats]:
        """Return (n,) targets, m north and east of a fixed place, and the way to them from the vehicle."""
        table = stream.table
        if table.name == LOCAL:
            here = self._local.at(stream)
            north, east = table["x"].astype(float), table["y"].astype(float)
            offset = table["coordinate_frame"] != NORTH_FRAMES[0]
            return (
                north,
                east,
                np.where(offset, north, north - here["x"]),
                np.where(offset, east, east - here["y"]),
            )
        here = self._global.at(stream)
        lat, lon = table["lat_int"] * 1e-7, table["lon_int"] * 1e-7
        shrink = np.cos(np.radians(lat))
        turn = wrapped_deg(lon - here["lon"])
        return (
            lat * DEGREE_M,
            lon * DEGREE_M * shrink,
            (lat - here["lat"]) * DEGREE_M,
            turn * DEGREE_M * shrink,
        )
