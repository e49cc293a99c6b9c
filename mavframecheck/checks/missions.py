"""Checks of whole missions as they went over the link."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Place, Verdict, place
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.missions import Mission, Transactions
from mavframecheck.missions.items import Items
from mavframecheck.model import Subject
from mavframecheck.semantics.commands import altitude_commands, location_commands
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import AltRef
from mavframecheck.semantics.mavframe import FRAMES, GLOBAL_FRAMES
from mavframecheck.semantics.names import family
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Table

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MAX_HOMES = 500
"""Heights of home that are remembered of one vehicle and source."""
MAX_MISSIONS = 200
MAX_ITEMS = 50_000
"""Missions, and items in them, that are judged."""
PLAIN_MISSION = 0
"""MAV_MISSION_TYPE_MISSION."""

_REFERENCE = {facts.id: facts.alt_ref for facts in FRAMES}
_PLACED = np.array(sorted(set(altitude_commands()) & set(location_commands())))
_NO_HEIGHT = np.array([constant("MAV_CMD.NAV_LAND"), constant("MAV_CMD.NAV_VTOL_LAND")])
"""Commands whose height is the ground, or not read."""


def flown(beats: Table) -> Iterator[tuple[int, str, int]]:
    """Yield each system's first word of what it flies in (n,) HEARTBEATs: system, family, MAV_TYPE."""
    speaks = beats.take(np.flatnonzero(beats["autopilot"] != constant("MAV_AUTOPILOT.INVALID")))
    systems, first = np.unique(speaks.frames.sysid, return_index=True)
    for sysid, row in zip(systems.tolist(), first.tolist(), strict=True):
        mav_type = int(speaks["type"][row])
        yield sysid, family(int(speaks["autopilot"][row]), mav_type), mav_type


class _Heights:
    """Heights of home, where they changed, in frame order."""

    def __init__(self) -> None:
        self._numbers: list[int] = []
        self._values: list[float] = []

    def add(self, numbers: Ints, heights: Floats, step_m: float) -> None:
        """Keep each height that differs by `step_m` from the one kept before."""
        row = 0
        while len(self._values) < MAX_HOMES:
            last = self._values[-1] if self._values else np.nan
            changed = np.flatnonzero(~(np.abs(heights[row:] - last) < step_m))
            if not len(changed):
                return
            row += int(changed[0])
            self._numbers.append(int(numbers[row]))
            self._values.append(float(heights[row]))
            row += 1

    def at(self, number: int) -> float | None:
        """Return the height that held at a frame, else the first one known."""
        before = bisect_right(self._numbers, number) - 1
        return self._values[max(before, 0)] if self._values else None


class Leg(NamedTuple):
    """A way from one item to the next whose heights have different references."""

    first: int
    """Row of the item that it leaves."""
    second: int
    climb_m: float
    """Height gained, by the frames of the two."""
    apart_m: float
    """Difference of the bare numbers."""
    away_m: float


class AltitudeProfile(Check):
    """Missions that mix heights above home and above the sea, with a leg that climbs like no other.

    The profile is implausible when the two ends of a leg are far apart in height, steeply, while the
    numbers in the items are close to each other: then one of the frames is wrong.
    """

    of_missions = True

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Remember nothing yet."""
        super().__init__(params, dialect)
        self._transactions = Transactions()
        self._homes: dict[int, _Heights] = {}
        self._differences: dict[int, _Heights] = {}
        """Height minus height above home, for vehicles that never say where home is."""
        self._families: dict[int, str] = {}
        self._missions: list[Mission] = []
        self._items = 0
        self._seen: set[tuple[int, int, bytes]] = set()

    def update(self, batch: Batch, _context: Context) -> None:
        """Collect heights of home, and missions that end in this batch."""
        told = batch.tables.get("HOME_POSITION")
        if told is not None:
            self._remember(self._homes, told, told["altitude"].astype(float) * 1e-3)
        positions = batch.tables.get("GLOBAL_POSITION_INT")
        if positions is not None:
            placed = positions.take(
                np.flatnonzero((positions["lat"] != 0) | (positions["lon"] != 0))
            )
            difference = placed["alt"].astype(float) - placed["relative_alt"]
            self._remember(self._differences, placed, difference * 1e-3)
        if "HEARTBEAT" in batch.tables:
            for sysid, known, _ in flown(batch.tables["HEARTBEAT"]):
                self._families.setdefault(sysid, known)
        for mission in self._transactions.update(batch):
            self._keep(mission)

    def _remember(self, kept: dict[int, _Heights], table: Table, heights: Floats) -> None:
        for sysid in np.unique(table.frames.sysid).tolist():
            rows = np.flatnonzero(table.frames.sysid == sysid)
            numbers = table.frames.number[rows].astype(np.int64)
            step_m = float(self.params["min_home_step_m"])
            kept.setdefault(sysid, _Heights()).add(numbers, heights[rows], step_m)

    def _keep(self, mission: Mission) -> None:
        """Keep a mission once, whoever sent it and however often."""
        full = len(self._missions) >= MAX_MISSIONS or self._items >= MAX_ITEMS
        if mission.mission_type != PLAIN_MISSION or full:
            return
        items = mission.items
        content = np.stack([items.seq, items.command, items.frame], axis=1).tobytes()
        key = (mission.sender, mission.target, content + items.z.tobytes())
        if key not in self._seen:
            self._seen.add(key)
            self._missions.append(mission)
            self._items += len(items)

    def finish(self) -> Iterable[Observation]:
        """Return the implausible missions."""
        for mission in self._transactions.finish():
            self._keep(mission)
        for mission in self._missions:
            yield from self._judge(mission)

    def _judge(self, mission: Mission) -> Iterator[Observation]:
        home = self._home(mission)
        if home is None:
            return
        legs = [leg for leg in _legs(mission.items, self._first(mission), home) if self._wild(leg)]
        if not legs:
            return
        worst = max(legs, key=lambda leg: abs(leg.climb_m))
        items = mission.items
        second = [leg.second for leg in legs]
        numbers = Counter(_REFERENCE[frame] for frame in items.frame[_heights(items)].tolist())
        yield Observation(
            Subject(mission.sender >> 8, mission.sender & 0xFF, self._message(items), None),
            _place(items, second[0]),
            _place(items, second[-1]),
            len(legs),
            {
                "seq_from": int(items.seq[worst.first]),
                "seq_to": int(items.seq[worst.second]),
                "z_from": float(items.z[worst.first]),
                "z_to": float(items.z[worst.second]),
                "reference_from": _words(items, worst.first),
                "reference_to": _words(items, worst.second),
                "climb_m": worst.climb_m,
                "away_m": worst.away_m,
                "home_m": home,
                "relative": numbers[AltRef.HOME],
                "absolute": numbers[AltRef.MSL],
            },
        )

    def _wild(self, leg: Leg) -> bool:
        """Return whether a leg is steep by its frames and level by its numbers."""
        climb = abs(leg.climb_m)
        steep = climb >= float(self.params["min_grade"]) * leg.away_m
        alike = leg.apart_m <= float(self.params["max_apart_m"])
        return climb >= float(self.params["min_climb_m"]) and steep and alike

    def _message(self, items: Items) -> str:
        return self.dialect.layouts[int(items.frames.msgid[0])].name

    def _first(self, mission: Mission) -> int:
        """Return the first `seq` that is flown: item 0 is home on ArduPilot, and where nobody knows."""
        return 0 if self._families.get(self._vehicle(mission)) == "px4" else 1

    def _vehicle(self, mission: Mission) -> int:
        """Return the system that the mission is for: the target of an upload, else the sender."""
        return mission.target if mission.target in self._families else mission.sender >> 8

    def _home(self, mission: Mission) -> float | None:
        """Return the height of home when the mission was sent, else the first one known, else item 0."""
        number = int(mission.items.frames.number[-1])
        for kept in (self._homes, self._differences):
            heights = kept.get(self._vehicle(mission))
            found = heights.at(number) if heights is not None else None
            if found is not None:
                return found
        items = mission.items
        says_home = items.seq[0] == 0 and _REFERENCE.get(int(items.frame[0])) == AltRef.MSL
        if self._first(mission) == 1 and says_home and items.z[0] != 0:
            return float(items.z[0])
        return None

    def verdict(self) -> Verdict:
        """Return the missions with heights of both kinds, and whether home was known for one."""
        mixed = [m for m in self._missions if _mixes(m.items, self._first(m))]
        known = sum(self._home(mission) is not None for mission in mixed)
        why = "nothing says how high home is" if mixed and not known else ""
        return Verdict(known or len(self._missions) - len(mixed), why)


def _heights(items: Items) -> Bools:
    """Return (n,) items with a place and a height that is flown."""
    placed = np.isin(items.command, _PLACED) & ~np.isin(items.command, _NO_HEIGHT)
    somewhere = (items.x != 0) | (items.y != 0)
    whole = placed & np.isin(items.frame, GLOBAL_FRAMES) & somewhere & np.isfinite(items.z)
    return np.asarray(whole)


def _mixes(items: Items, first: int) -> bool:
    frames = items.frame[_heights(items) & (items.seq >= first)].tolist()
    return {AltRef.MSL, AltRef.HOME} <= {_REFERENCE[frame] for frame in frames}


def _legs(items: Items, first: int, home: float) -> Iterator[Leg]:
    """Yield the legs between neighbours, one above home and one above the sea."""
    rows = np.flatnonzero(_heights(items) & (items.seq >= first))
    references = [_REFERENCE[frame] for frame in items.frame[rows].tolist()]
    base = {AltRef.MSL: 0.0, AltRef.HOME: home}
    away = distance_m(items.x[rows[:-1]], items.y[rows[:-1]], items.x[rows[1:]], items.y[rows[1:]])
    for k in range(len(rows) - 1):
        one, other = references[k], references[k + 1]
        if one != other and one in base and other in base:
            z, z_next = float(items.z[rows[k]]), float(items.z[rows[k + 1]])
            climb = base[other] + z_next - base[one] - z
            yield Leg(int(rows[k]), int(rows[k + 1]), climb, abs(z_next - z), float(away[k]))


def _words(items: Items, row: int) -> str:
    return "above home" if _REFERENCE[int(items.frame[row])] == AltRef.HOME else "above the sea"


def _place(items: Items, row: int) -> Place:
    return place(items.frames, row)
