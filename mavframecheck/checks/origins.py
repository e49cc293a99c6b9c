"""Checks of origins and home: points that moved, and numbers that count from the wrong one."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.missions.items import items_of
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.established import SAID, Geodetic, Home, Move, Origin
from mavframecheck.vehicle.origins import Registry
from mavframecheck.wire import Batch, Dialect, Place, Table

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Vector = tuple[float, float, float]

SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
TARGETS = (SETPOINT, "MISSION_ITEM_INT", "MISSION_ITEM")
MAX_STREAMS = 256
"""Streams of local targets that are followed."""
MAX_OLD = 8
"""Origins that a target is tried on."""
MAX_SHARED = 64
"""Targets of each vehicle that are remembered to find them again."""
BESIDE_M = 1.0
"""Targets nearer the origin than this, in the level, are above it."""
NED, ENU = constant("MAV_FRAME.LOCAL_NED"), constant("MAV_FRAME.LOCAL_ENU")
POSITION = 7
"""POSITION_TARGET_TYPEMASK: X, Y and Z_IGNORE."""


class _OfRegistry(Check):
    """A check of what the registry holds when the recording has been read."""

    _registry: Registry | None = None

    def update(self, _batch: Batch, context: Context) -> None:
        """Keep the registry up to date."""
        self._registry = context.registry

    @property
    def moves(self) -> list[Move]:
        """Moves of origins within a boot, in frame order."""
        moves = [] if self._registry is None else self._registry.moves
        return sorted(moves, key=lambda move: move.seen.number)

    def verdict(self) -> Verdict:
        """Return the origins that were compared."""
        return Verdict(0 if self._registry is None else len(self._registry.origins))

    def _in_flight(self, armed_s: float | None) -> bool:
        """Return whether a vehicle is armed and past what autopilots set anew at arming."""
        return armed_s is not None and armed_s >= self.params["min_armed_s"]

    def _far(self, shift: Vector) -> bool:
        """Return whether a point moved by as much as the rule asks."""
        level = bool(np.hypot(*shift[:2]) >= self.params["min_horizontal_m"])
        return level or bool(abs(shift[2]) >= self.params["min_vertical_m"])

    def _observed(self, move: Move, message: str) -> Observation:
        """Return a move as an observation."""
        north, east, down = move.shift
        origin, where = move.after, move.seen
        values: dict[str, Scalar] = {
            "north_m": north,
            "east_m": east,
            "up_m": -down,
            "shift_m": _length(move.shift),
            "lat": origin.at.lat,
            "lon": origin.at.lon,
            "alt_msl": origin.at.alt_msl,
            "origin_before": move.before.origin_id,
            "origin_after": origin.origin_id,
            "asked": origin.asked_by is not None,
            "asked_by": _sender(origin.asked_by),
            "source": origin.source,
            "local_m": move.local_m,
            "global_m": move.global_m,
        }
        subject = Subject(origin.system, origin.component, message, None)
        return Observation(subject, where, where, 1, values)


class OriginMoved(_OfRegistry):
    """An origin that is said to be elsewhere while the vehicle flies."""

    def finish(self) -> Iterator[Observation]:
        """Return the moves that a message announces, or that nobody saw happen."""
        for move in self.moves:
            known = move.said or move.after.asked_by is not None or move.local_m is None
            if known and self._far(move.shift) and self._in_flight(move.armed_s):
                yield self._observed(move, SAID)


class PositionJump(_OfRegistry):
    """A leap of the local or the global position that the other one does not have."""

    def finish(self) -> Iterator[Observation]:
        """Return the leaps in flight that no message announces."""
        local = bool(self.params["local"])
        for move in self.moves:
            if move.local_m is None or move.global_m is None or not self._in_flight(move.armed_s):
                continue
            leapt, stayed = move.local_m, move.global_m
            if not local:
                leapt, stayed = stayed, leapt
            alone = stayed <= self.params["max_share"] * leapt
            announced = local and (move.said or move.after.asked_by is not None)
            if leapt >= self.params["min_leap_m"] and alone and not announced:
                yield self._observed(move, "LOCAL_POSITION_NED" if local else "GLOBAL_POSITION_INT")


class HomeMoved(_OfRegistry):
    """Home that moves while the vehicle flies."""

    def verdict(self) -> Verdict:
        """Return the homes that were compared."""
        return Verdict(0 if self._registry is None else len(self._registry.homes))

    def finish(self) -> Iterator[Observation]:
        """Return, for each boot in which home moved in flight, how often and the furthest move."""
        for own in _by_boot([] if self._registry is None else self._registry.homes):
            moved = [
                (shift, new)
                for shift, new in ((old.at.shift_to(new.at), new) for old, new in pairwise(own))
                if self._far(shift) and self._in_flight(new.armed_s)
            ]
            if moved:
                yield _home_moved(moved)


def _by_boot(homes: Sequence[Home]) -> Iterator[list[Home]]:
    """Yield the homes of each vehicle and boot, in frame order."""
    for key in sorted({(home.system, home.boot) for home in homes}):
        own = [home for home in homes if (home.system, home.boot) == key]
        yield sorted(own, key=lambda home: home.seen.number)


def _home_moved(moved: list[tuple[Vector, Home]]) -> Observation:
    shift, home = max(moved, key=lambda each: _length(each[0]))
    values: dict[str, Scalar] = {
        "horizontal_m": float(np.hypot(*shift[:2])),
        "up_m": -shift[2],
        "alt_msl": home.at.alt_msl,
        "asked": home.asked_by is not None,
        "asked_by": _sender(home.asked_by),
    }
    subject = Subject(home.system, home.component, "HOME_POSITION", None)
    first, last = moved[0][1].seen, moved[-1][1].seen
    return Observation(subject, first, last, len(moved), values)


def _sender(sender: int | None) -> str:
    return "" if sender is None else f"{sender >> 8}/{sender & 0xFF}"


def _length(vector: Sequence[float] | Floats) -> float:
    return float(np.linalg.norm(vector))


class _Rows(NamedTuple):
    """Local targets of one sender for one vehicle, in a batch."""

    key: tuple[int, int, str]
    """Sender (``sysid * 256 + compid``), system, message."""
    table: Table
    at: Floats
    """(n, 3) m, NED."""


def _streams(table: Table, context: Context) -> Iterator[_Rows]:
    """Yield the streams of local targets in a table; what autopilots send is none."""
    ours = ~context.lookup("sender.role", table).among(lambda role: role == "autopilot")
    at, about = _targets(table), context.about_then(table)
    rows = np.flatnonzero(ours & (about >= 0) & np.isfinite(at).all(axis=1))
    key = table.frames.sender[rows] << 8 | about[rows]
    for each in np.unique(key).tolist():
        mine = rows[key == each]
        yield _Rows((each >> 8, each & 0xFF, table.name), table.take(mine), at[mine])


def _targets(table: Table) -> Floats:
    """Return (n, 3) local positions that the rows of a table ask for, m, NED; NaN where they ask for none."""
    if table.name == SETPOINT:
        at = np.column_stack([table[axis].astype(float) for axis in "xyz"])
        placed = (table["coordinate_frame"] == NED) & (table["type_mask"] & POSITION == 0)
        return np.where(placed[:, None], at, np.nan)
    items = items_of(table)
    ned = np.column_stack((items.x, items.y, items.z))
    enu = np.column_stack((items.y, items.x, -items.z))
    return np.where(
        (items.frame == NED)[:, None], ned, np.where((items.frame == ENU)[:, None], enu, np.nan)
    )


class _Target(NamedTuple):
    """The first local target of a stream since an origin is in force."""

    origin: int
    """Id of the origin; 0: none is in force."""
    vehicle: Geodetic | None
    """Where the vehicle was when the first row came."""
    due_us: int
    """Time of the recording from which on a row counts: a sender may need a moment to notice a move."""
    at: Floats | None = None
    """(3,) m, NED: the target; None: no row counted yet."""
    first: Place | None = None
    last: Place | None = None
    times: int = 0
    over: bool = False
    """Whether another target followed."""
    found: dict[str, Scalar] | None = None
    """What makes it suspicious."""


class _Targets(Check):
    """A check of local targets against origins that they might have been meant for."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._streams: dict[tuple[int, int, str], _Target] = {}
        self._found: dict[tuple[int, int, str, int], _Target] = {}
        self._checked = 0
        self._unplaced = 0

    def update(self, batch: Batch, context: Context) -> None:
        """Follow each stream of local targets."""
        for message in TARGETS:
            table = batch.tables.get(message)
            for rows in () if table is None else _streams(table, context):
                room = rows.key in self._streams or len(self._streams) < MAX_STREAMS
                if room and self.concerns_sender(rows.key[0]):
                    places = context.registry.at(rows.key[1], rows.table.frames.number)
                    self.follow(rows, places, context)

    def follow(self, rows: _Rows, places: Ints, context: Context) -> None:
        """Judge the first target under each origin (`places` in the registry), and count its repeats."""
        origins = context.registry.origins
        ids = np.array([0, *(origin.origin_id for origin in origins)])[places + 1]
        edges = np.flatnonzero(np.diff(ids, prepend=-1)).tolist()
        for begin, end in pairwise([*edges, len(ids)]):
            first = begin
            origin = origins[places[first]] if places[first] >= 0 else None
            state = self._streams.get(rows.key)
            if state is None or state.origin != ids[first]:
                state = self._begin(rows, first, origin, context)
            if state.at is None and origin is not None:
                state, first = self._wait(rows, state, origin, context.registry, first, end)
            if state.at is not None and not state.over and first < end:
                state = _repeated(state, rows, first, end)
            self._streams[rows.key] = state
            if state.found is not None:
                self._found[(*rows.key, state.origin)] = state

    def _begin(self, rows: _Rows, row: int, origin: Origin | None, context: Context) -> _Target:
        """Return the state of a stream whose first row under an origin is `row`."""
        at = _vehicle(rows.table.take(np.array([row])), context)
        moved = origin is not None and any(
            move.after.system == origin.system and move.after.origin_id == origin.origin_id
            for move in context.registry.moves
        )
        wait_us = int(self.params["notice_s"] * 1e6) if moved else 0
        due_us = int(rows.table.frames.clock_us[row]) + wait_us
        self._unplaced += origin is None or at is None
        return _Target(0 if origin is None else origin.origin_id, at, due_us)

    def _wait(
        self, rows: _Rows, state: _Target, origin: Origin, registry: Registry, first: int, end: int
    ) -> tuple[_Target, int]:
        """Judge the first row that counts, if it is among those; return also where the next ones begin."""
        frames = rows.table.frames
        due = np.flatnonzero(frames.clock_us[first:end] >= state.due_us)
        if not len(due):
            return state, end
        row = first + int(due[0])
        here, at = frames.place(row), rows.at[row]
        found = None
        if state.vehicle is not None:
            self._checked += 1
            others = self.others(origin, registry, frames.number[row : row + 1])
            found = self._judge(at, origin, others, np.array(origin.at.shift_to(state.vehicle)))
        return state._replace(at=at, first=here, last=here, times=1, found=found), row + 1

    def _judge(
        self, at: Floats, origin: Origin, others: Sequence[Origin], vehicle: Floats
    ) -> dict[str, Scalar] | None:
        """Return which of the other origins puts a target near the vehicle, None when none does."""
        away, best = _length(at - vehicle), None
        nearest = min(away / self.params["min_ratio"], away - self.params["min_nearer_m"])
        for other in others:
            shift = origin.at.shift_to(other.at)
            near = _length(at + np.array(shift) - vehicle)
            if near <= nearest and _length(shift) >= self.params["min_shift_m"]:
                nearest, best = near, _reading(at, other, shift) | {"away_m": away, "near_m": near}
        return best

    @abstractmethod
    def others(self, origin: Origin, registry: Registry, number: Ints) -> Sequence[Origin]:
        """Return the origins that a target may have been meant for instead."""

    def finish(self) -> Iterable[Observation]:
        """Return the streams whose targets fit another origin."""
        for (sender, system, message, _), target in sorted(self._found.items(), key=lambda e: e[0]):
            if target.first is not None and target.last is not None:
                subject = Subject(sender >> 8, sender & 0xFF, message, None)
                values = {**(target.found or {}), "system": system}
                yield Observation(subject, target.first, target.last, target.times, values)

    def verdict(self) -> Verdict:
        """Return the streams looked at."""
        why = "nothing says where the origin or the vehicle is" if self._unplaced else ""
        return Verdict(self._checked, "" if self._checked else why)


def _repeated(state: _Target, rows: _Rows, first: int, end: int) -> _Target:
    """Count the rows that hold the same target again; another one ends it."""
    other = np.flatnonzero((rows.at[first:end] != state.at).any(axis=1))
    upto = int(other[0]) if len(other) else end - first
    last = rows.table.frames.place(first + upto - 1) if upto else state.last
    return state._replace(times=state.times + upto, last=last, over=bool(len(other)))


def _vehicle(row: Table, context: Context) -> Geodetic | None:
    """Return where the vehicle was when a row was sent."""
    names = ("lat", "lon", "alt_msl")
    at = [context.lookup(f"vehicle.{name}", row, late=False) for name in names]
    return Geodetic(*(float(k.values[0]) for k in at)) if all(k.known[0] for k in at) else None


def _reading(at: Floats, other: Origin, shift: Vector) -> dict[str, Scalar]:
    """Return a target as it is and as it would be from another origin."""
    x, y, z = at.tolist()
    north, east, down = shift
    return {
        "x": x,
        "y": y,
        "z": z,
        "x_meant": x + north,
        "y_meant": y + east,
        "z_meant": z + down,
        "shift_m": _length(shift),
        "other_system": other.system,
        "other_origin": other.origin_id,
        "other_boot": other.boot,
        "shared": 0,
    }


class OldOrigin(_Targets):
    """Local targets that make sense from an origin that holds no more."""

    def others(self, origin: Origin, registry: Registry, _number: Ints) -> Sequence[Origin]:
        """Return the last few earlier origins of the vehicle."""
        earlier = [
            each
            for each in registry.origins
            if each.system == origin.system and each.origin_id < origin.origin_id
        ]
        return earlier[-MAX_OLD:]


class OtherOrigin(_Targets):
    """Local targets that make sense from the origin of another vehicle, or go to several alike."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._sent: dict[tuple[int, int, str], list[_Sent]] = {}

    def others(self, origin: Origin, registry: Registry, number: Ints) -> Sequence[Origin]:
        """Return the origins in force of other vehicles."""
        systems = sorted({each.system for each in registry.origins} - {origin.system})
        places = [int(registry.at(system, number)[0]) for system in systems]
        return [registry.origins[place] for place in places if place >= 0]

    def follow(self, rows: _Rows, places: Ints, context: Context) -> None:
        """Besides, remember the first targets of each stream."""
        super().follow(rows, places, context)
        sent = self._sent.setdefault(rows.key, [])
        before = np.array([sent[-1].at]) if sent else np.full((1, 3), np.nan)
        fresh = np.flatnonzero((np.diff(rows.at, axis=0, prepend=before) != 0).any(axis=1))
        for row in fresh[: MAX_SHARED - len(sent)].tolist():
            if places[row] >= 0:
                origin = context.registry.origins[places[row]]
                clock_us = int(rows.table.frames.clock_us[row])
                at = _vector(rows.at[row])
                sent.append(_Sent(at, origin, rows.table.frames.place(row), clock_us))

    def finish(self) -> Iterable[Observation]:
        """Return the streams whose targets fit another vehicle, and those that are the same for several."""
        yield from super().finish()
        for one, other in combinations(sorted(self._sent), 2):
            if one[0] == other[0] and one[1] != other[1] and one[2] == other[2]:
                yield from self._compare(other, self._sent[one], self._sent[other])

    def _compare(
        self, key: tuple[int, int, str], one: list[_Sent], other: list[_Sent]
    ) -> Iterator[Observation]:
        """Yield the targets that two vehicles were given alike, with origins apart."""
        within_us = self.params["within_s"] * 1e6
        same = [
            (mine, theirs)
            for mine in other
            for theirs in one
            if mine.at == theirs.at
            and _away(mine)
            and abs(mine.clock_us - theirs.clock_us) <= within_us
        ]
        kinds = len({mine.at for mine, _ in same})
        fewest = min(len({sent.at for sent in each if _away(sent)}) for each in (one, other))
        if kinds < max(self.params["min_shared"], self.params["min_share"] * fewest):
            return
        mine, theirs = same[0]
        shift = mine.origin.at.shift_to(theirs.origin.at)
        if _length(shift) >= self.params["min_apart_m"]:
            subject = Subject(key[0] >> 8, key[0] & 0xFF, key[2], None)
            values = _reading(np.array(mine.at), theirs.origin, shift)
            values |= {"shared": kinds, "system": key[1], "near_m": None, "away_m": None}
            yield Observation(subject, mine.place, same[-1][0].place, len(same), values)


class _Sent(NamedTuple):
    """A target that a vehicle was given."""

    at: Vector
    origin: Origin
    place: Place
    clock_us: int


def _away(sent: _Sent) -> bool:
    """Return whether a target lies beside the origin: a take-off height means the same for everybody."""
    return bool(np.hypot(*sent.at[:2]) >= BESIDE_M)


def _vector(row: Floats) -> Vector:
    x, y, z = row.tolist()
    return x, y, z
