"""The missions of a recording, with what is known of the vehicles that they are for.

They are gathered once for all rules of a recording, and judged at its end.
"""

from __future__ import annotations

import weakref
from abc import abstractmethod
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.missions import Items, Ledger, Mission, Readback, Transactions
from mavframecheck.missions.held import ALL_KINDS
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.commands import altitude_commands, location_commands
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import AltRef
from mavframecheck.semantics.mavframe import FRAMES, GLOBAL_FRAMES
from mavframecheck.semantics.names import family
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Table

if TYPE_CHECKING:
    from mavframecheck.geo.terrain import Ground

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MAX_HOMES = 500
"""Homes that are remembered of one vehicle and source."""
HOME_STEP_M = 5.0
"""Home moves less than this before arming, m."""
MAX_MISSIONS = 200
MAX_ITEMS = 50_000
"""Missions, and items in them, that are judged."""
MISSION, FENCE, RALLY = (
    constant(f"MAV_MISSION_TYPE.{name}") for name in ("MISSION", "FENCE", "RALLY")
)

_SAME_DEG, _SAME_M = 5e-5, 1.0
"""What a vehicle sends back differs by no more from what it was sent."""

REFERENCE = {facts.id: facts.alt_ref for facts in FRAMES}
"""MAV_FRAME -> what heights in it are above."""
CLIMBED = np.array(
    [constant(f"MAV_CMD.{name}") for name in ("NAV_WAYPOINT", "NAV_SPLINE_WAYPOINT")]
)
"""Commands that a fixed wing climbs to on its way; at others it may climb in circles."""
FLOWN = np.array(
    [
        *CLIMBED.tolist(),
        *(
            constant(f"MAV_CMD.{name}")
            for name in ("NAV_LOITER_UNLIM", "NAV_LOITER_TURNS", "NAV_LOITER_TIME", "NAV_LAND")
        ),
        *(constant(f"MAV_CMD.{name}") for name in ("NAV_VTOL_LAND", "NAV_LOITER_TO_ALT")),
    ]
)
"""Commands that the vehicle flies to."""
LANDINGS = np.array([constant("MAV_CMD.NAV_LAND"), constant("MAV_CMD.NAV_VTOL_LAND")])
"""Commands whose height is the ground, or not read."""
_PLACES = np.array(sorted(location_commands()))
_PLACED = np.array(sorted(set(altitude_commands()) & set(location_commands())))


class Plan(NamedTuple):
    """A mission, and whom it is for."""

    mission: Mission
    vehicle: int
    """System that it is for."""
    sent_back: bool
    """Whether the vehicle sent it: then it is what the vehicle holds, and no input."""
    family: str
    """Autopilot family, empty where nobody said."""
    mav_type: int | None

    @property
    def items(self) -> Items:
        """The items in order of `seq`."""
        return self.mission.items

    @property
    def first(self) -> int:
        """The first `seq` that is flown: item 0 is home on ArduPilot, and where nobody knows."""
        return 0 if self.family == "px4" or self.mission.mission_type != MISSION else 1


class Plans:
    """Gathers missions, homes and families of vehicles."""

    def __init__(self) -> None:
        """Remember nothing yet."""
        self._transactions = Transactions()
        self._batch: weakref.ref[Batch] | None = None
        self._homes: dict[int, _Homes] = {}
        self._differences: dict[int, _Homes] = {}
        """Height minus height above home, for vehicles that never say where home is."""
        self._vehicles: dict[int, tuple[str, int]] = {}
        """System -> family and MAV_TYPE, as first said."""
        self._missions: list[Mission] = []
        self._unfinished: list[Mission] = []
        """Those that may go on, as far as they were sent when they were last asked for."""
        self._items = 0
        self._contents: dict[bytes, Items] = {}
        self._roles: dict[int, str] = {}
        self._finished: list[Plan] | None = None
        """What `finished` found, until more is read."""
        self.intended: list[Plan] = []
        """The plan that was given beside the recording, if any."""
        self.ground: Ground | None = None
        """How high the ground lies, where a terrain model was given."""

    @staticmethod
    def of(context: Context) -> Plans:
        """Return the gathering that all rules of a recording share."""
        return _GATHERED.setdefault(context, Plans())

    def intend(self, batch: Batch) -> None:
        """Take in the batch of a mission file: what was meant to be flown."""
        transactions = Transactions()
        missions = [*transactions.update(batch), *transactions.finish()]
        beats = batch.tables.get("HEARTBEAT")
        told = {} if beats is None else {each[0]: each[1:] for each in _flown(beats)}
        for mission in missions:
            known = told.get(mission.target, ("", None))
            self.intended.append(Plan(mission, mission.target, False, *known))

    def update(self, batch: Batch, context: Context) -> None:
        """Take in a batch, once."""
        if self._batch is not None and self._batch() is batch:
            return
        self._batch = weakref.ref(batch)
        self._finished = None
        told = batch.tables.get("HOME_POSITION")
        if told is not None:
            places = np.column_stack((told["latitude"], told["longitude"])) * 1e-7
            _remember(self._homes, told, told["altitude"].astype(float) * 1e-3, places)
        positions = batch.tables.get("GLOBAL_POSITION_INT")
        if positions is not None:
            placed = positions.take(
                np.flatnonzero((positions["lat"] != 0) | (positions["lon"] != 0))
            )
            difference = placed["alt"].astype(float) - placed["relative_alt"]
            nowhere = np.full((len(placed), 2), np.nan)  # where the vehicle is, home need not be
            _remember(self._differences, placed, difference * 1e-3, nowhere)
        if "HEARTBEAT" in batch.tables:
            for sysid, known, mav_type in _flown(batch.tables["HEARTBEAT"]):
                self._vehicles.setdefault(sysid, (known, mav_type))
        for mission in self._transactions.update(batch):
            self._keep(mission)
        self._roles = {each.sender: context.role(each.sender) for each in self._missions}

    def _keep(self, mission: Mission) -> None:
        """Keep a mission; what has the same content shares it."""
        if len(self._missions) >= MAX_MISSIONS or self._items >= MAX_ITEMS:
            return
        content = _content(mission.items)
        if content not in self._contents:
            self._contents[content] = mission.items
            self._items += len(mission.items)
        self._missions.append(self._shared(mission))
        self._roles.setdefault(mission.sender, "unknown")

    def finished(self, context: Context) -> list[Plan]:
        """Return every mission that was sent, each content once a sender, at the end of the recording.

        What a vehicle only sends back as it got it is left out.
        """
        if self._finished is None:
            self._unfinished = [self._shared(each) for each in self._transactions.finish()]
            self._roles |= {each.sender: context.role(each.sender) for each in self._unfinished}
            self._finished = self._concluded()
        return self._finished

    @property
    def _all(self) -> list[Mission]:
        return [*self._missions, *self._unfinished]

    def _shared(self, mission: Mission) -> Mission:
        """Return a mission that shares its items with one of the same content."""
        mission.items = self._contents.get(_content(mission.items), mission.items)
        return mission

    def _concluded(self) -> list[Plan]:
        once: dict[tuple[int, int, int, int], Mission] = {}
        for mission in self._all:
            key = (mission.sender, mission.target, mission.mission_type, id(mission.items))
            if len(mission.items):
                once.setdefault(key, mission)
        plans = [self._plan(mission) for mission in once.values()]
        sent = [plan for plan in plans if not plan.sent_back]
        return [p for p in plans if not p.sent_back or not any(_repeats(p, s) for s in sent)]

    def _plan(self, mission: Mission) -> Plan:
        sent_back = self._roles[mission.sender] == "autopilot"
        vehicle = mission.sender >> 8 if sent_back else mission.target
        if vehicle not in self._vehicles and not mission.target and len(self._vehicles) == 1:
            vehicle = next(iter(self._vehicles))
        return Plan(mission, vehicle, sent_back, *self._vehicles.get(vehicle, ("", None)))

    def replaced_at(self, plan: Plan) -> float:
        """Return the frame number at which a vehicle got another mission than `plan`, infinity if it never did."""
        later = [
            mission.ended
            for mission in self._all
            if mission.target == plan.vehicle
            and mission.mission_type in (MISSION, ALL_KINDS)
            and mission.ended > plan.mission.ended
            and mission.items is not plan.items
        ]
        return min(later, default=np.inf)

    def readbacks(self) -> list[Readback]:
        """Return what vehicles sent back, with what they should have held."""
        ledger = Ledger(lambda sender: self._roles[sender] == "autopilot")
        return ledger.enter(self._all).readbacks

    def family(self, system: int) -> str:
        """Return the autopilot family of a system, empty where nobody said."""
        return self._vehicles.get(system, ("", 0))[0]

    def home_m(self, plan: Plan) -> float | None:
        """Return the height of home when a mission was sent, else the first one known, else that of item 0."""
        number = plan.mission.ended
        for kept in (self._homes, self._differences):
            heights = kept.get(plan.vehicle)
            found = heights.at(number) if heights is not None else None
            if found is not None:
                return found.height_m
        items = plan.items
        says_home = items.seq[0] == 0 and REFERENCE.get(int(items.frame[0])) == AltRef.MSL
        if plan.first == 1 and says_home and items.z[0] != 0:
            return float(items.z[0])
        return None

    def home_place(self, plan: Plan) -> tuple[float, float] | None:
        """Return latitude and longitude of home when a mission was sent, degrees: as said, else of item 0."""
        heights = self._homes.get(plan.vehicle)
        found = heights.at(plan.mission.ended) if heights is not None else None
        if found is not None:
            return found.lat, found.lon
        items = plan.items
        if plan.first == 1 and items.seq[0] == 0 and with_place(items)[0]:
            return float(items.x[0]), float(items.y[0])
        return None


_GATHERED: weakref.WeakKeyDictionary[Context, Plans] = weakref.WeakKeyDictionary()


class MissionCheck(Check):
    """A rule about whole missions."""

    of_missions = True

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Have judged nothing yet."""
        super().__init__(params, dialect)
        self._context: Context | None = None
        self.looked = 0
        """Missions, items or legs that could be judged."""
        self.missing = ""
        """Why others could not."""

    def update(self, batch: Batch, context: Context) -> None:
        """Let the missions be gathered."""
        self._context = context
        Plans.of(context).update(batch, context)

    def finish(self) -> Iterable[Observation]:
        """Return what is wrong with the missions of the recording."""
        if self._context is not None:
            plans = Plans.of(self._context)
            yield from self.judge_all(plans, plans.finished(self._context))

    @abstractmethod
    def judge_all(self, plans: Plans, sent: list[Plan]) -> Iterator[Observation]:
        """Yield what is wrong; count in `looked` what was judged, say in `missing` what was not."""

    def verdict(self) -> Verdict:
        """Return how much was judged, once all was."""
        return Verdict(self.looked, "" if self.looked else self.missing)

    def observed(
        self, items: Items, rows: Ints, values: Mapping[str, Scalar], field: str | None = None
    ) -> Observation:
        """Return an observation about the items at `rows`."""
        frames = items.frames
        first, last = int(rows[0]), int(rows[-1])
        message = self.dialect.layouts[int(frames.msgid[first])].name
        return Observation(
            Subject(int(frames.sysid[first]), int(frames.compid[first]), message, field),
            frames.place(first),
            frames.place(last),
            len(rows),
            values,
        )


class EachMission(MissionCheck):
    """A rule about each mission by itself."""

    kinds: tuple[int, ...] = (MISSION,)
    """MAV_MISSION_TYPE that it is about."""

    def judge_all(self, plans: Plans, sent: list[Plan]) -> Iterator[Observation]:
        """Judge one after the other."""
        for plan in sent:
            if plan.mission.mission_type in self.kinds:
                yield from self.judge(plan, plans)

    @abstractmethod
    def judge(self, plan: Plan, plans: Plans) -> Iterator[Observation]:
        """Yield what is wrong with a mission."""


class _Home(NamedTuple):
    """Home, as it was from a frame on."""

    number: int
    height_m: float
    lat: float
    lon: float


class _Homes:
    """Homes, where they changed, in frame order."""

    def __init__(self) -> None:
        self._kept: list[_Home] = []

    def add(self, numbers: Ints, heights: Floats, places: Floats) -> None:
        """Keep each home that is more than a step away from the one kept before."""
        row = 0
        while len(self._kept) < MAX_HOMES:
            changed = np.flatnonzero(self._away(heights[row:], places[row:]))
            if not len(changed):
                return
            row += int(changed[0])
            lat, lon = places[row].tolist()
            self._kept.append(_Home(int(numbers[row]), float(heights[row]), lat, lon))
            row += 1

    def _away(self, heights: Floats, places: Floats) -> Bools:
        """Return (n,) homes that are not the last one kept; a place that is not known moves nothing."""
        if not self._kept:
            return np.ones(len(heights), np.bool_)
        last = self._kept[-1]
        apart_m = distance_m(places[:, 0], places[:, 1], last.lat, last.lon)
        level = np.abs(heights - last.height_m) < HOME_STEP_M
        return np.asarray(~level | (apart_m >= HOME_STEP_M))

    def at(self, number: int) -> _Home | None:
        """Return what held at a frame, else the first one known."""
        before = bisect_right(self._kept, number, key=lambda kept: kept.number) - 1
        return self._kept[max(before, 0)] if self._kept else None


def _remember(kept: dict[int, _Homes], table: Table, heights: Floats, places: Floats) -> None:
    """Keep (n,) heights and (n, 2) latitudes and longitudes of what each system says."""
    for sysid in np.unique(table.frames.sysid).tolist():
        rows = np.flatnonzero(table.frames.sysid == sysid)
        numbers = table.frames.number[rows].astype(np.int64)
        kept.setdefault(sysid, _Homes()).add(numbers, heights[rows], places[rows])


def _flown(beats: Table) -> Iterator[tuple[int, str, int]]:
    """Yield each system's first word of what it flies in (n,) HEARTBEATs: system, family, MAV_TYPE."""
    speaks = beats.take(np.flatnonzero(beats["autopilot"] != constant("MAV_AUTOPILOT.INVALID")))
    systems, first = np.unique(speaks.frames.sysid, return_index=True)
    for sysid, row in zip(systems.tolist(), first.tolist(), strict=True):
        mav_type = int(speaks["type"][row])
        yield sysid, family(int(speaks["autopilot"][row]), mav_type), mav_type


def _repeats(back: Plan, sent: Plan) -> bool:
    """Return whether a vehicle sends back what it was sent, but for home in item 0."""
    one, other = back.items, sent.items
    kinds = back.vehicle == sent.vehicle and back.mission.mission_type == sent.mission.mission_type
    if not kinds or len(one) != len(other) or (one.seq != other.seq).any():
        return False
    flown = one.seq >= back.first
    same = (one.command == other.command) & ~(np.abs(one.z - other.z) > _SAME_M)
    same &= ~(np.abs(one.x - other.x) > _SAME_DEG) & ~(np.abs(one.y - other.y) > _SAME_DEG)
    return bool(same[flown].all())


def _content(items: Items) -> bytes:
    whole = np.stack([items.seq, items.command, items.frame], axis=1).tobytes()
    return whole + items.params.tobytes() + np.stack([items.x, items.y, items.z]).tobytes()


def with_place(items: Items) -> Bools:
    """Return (n,) items with a latitude and a longitude."""
    placed = np.isin(items.command, _PLACES) & np.isin(items.frame, GLOBAL_FRAMES)
    somewhere = (items.x != 0) | (items.y != 0)
    legal = (np.abs(items.x) <= 90) & (np.abs(items.y) <= 180)
    return np.asarray(placed & somewhere & legal)


def with_height(items: Items) -> Bools:
    """Return (n,) items with a place and a height that is flown."""
    placed = np.isin(items.command, _PLACED) & ~np.isin(items.command, LANDINGS)
    somewhere = (items.x != 0) | (items.y != 0)
    whole = placed & np.isin(items.frame, GLOBAL_FRAMES) & somewhere & np.isfinite(items.z)
    return np.asarray(whole)
