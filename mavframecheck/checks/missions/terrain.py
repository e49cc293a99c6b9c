"""Legs that come near to the ground, or lead through it, by a terrain model (MFC911)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.missions.plans import (
    CLIMBED,
    FLOWN,
    LANDINGS,
    REFERENCE,
    Bools,
    EachMission,
    Floats,
    Ints,
    Plan,
    Plans,
    with_height,
    with_place,
)
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.geo.terrain import Ground
from mavframecheck.missions import Items
from mavframecheck.model import Scalar
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import AltRef
from mavframecheck.wire import Dialect

MOST_SAMPLES = 200_000
"""Places of a mission at which the ground is asked for; legs have at least two."""
MOST_LISTED = 20
"""Legs that a finding names."""
_TAKEOFFS = np.array([constant(f"MAV_CMD.{name}") for name in ("NAV_TAKEOFF", "NAV_VTOL_TAKEOFF")])
_ROUTE = np.concatenate((FLOWN, _TAKEOFFS, [constant("MAV_CMD.NAV_RETURN_TO_LAUNCH")]))
_SPLINE = constant("MAV_CMD.NAV_SPLINE_WAYPOINT")
_NOT_IN_THE_AIR = ("ardurover", "ardusub")
_NOT_IN_THE_AIR_TYPES = tuple(
    constant(f"MAV_TYPE.{name}") for name in ("GROUND_ROVER", "SURFACE_BOAT", "SUBMARINE")
)
_SAID = {AltRef.MSL: "above the sea", AltRef.HOME: "above home", AltRef.TERRAIN: "above terrain"}


class Level(NamedTuple):
    """How high home is."""

    home_m: float
    """m above mean sea level; NaN where that cannot be told."""
    by: str
    """What says so; where nothing does, why."""


class Legs(NamedTuple):
    """The parts of a mission that are judged: straight ways, and items by themselves (from and to the same)."""

    a: Ints
    """(n,) row of the item that it leaves."""
    b: Ints
    """(n,) row of the item that it leads to."""
    start_m: Floats
    """(n,) m above mean sea level at its beginning; above terrain for an item in such a frame."""
    end_m: Floats

    def __len__(self) -> int:
        """Return their number."""
        return len(self.a)


class Lowest(NamedTuple):
    """Where each leg is lowest above the ground; NaN where that is not known."""

    above_m: Floats
    """(n,) m above the ground."""
    ground_m: Floats
    """(n,) m above mean sea level, there."""
    lat: Floats
    lon: Floats
    away_m: Floats
    """(n,) how long the leg is, m."""
    known: Floats
    """(n,) share of its places at which the ground is known."""


class TerrainClearance(EachMission):
    """Legs through the ground, and legs low above it.

    A leg is straight, its height changes evenly, and items in a terrain frame are judged by themselves.
    What is not known of a flight counts in its favour: the height of a landing is not read, circles are
    climbed in before or after a leg, and near a take-off or landing anything is low.
    """

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Have judged nothing yet."""
        super().__init__(params, dialect)
        self._blind = False
        self._whole_m = self._known_m = 0.0
        self._covered = True
        self._reasons: list[str] = []

    def judge_all(self, plans: Plans, sent: list[Plan]) -> Iterator[Observation]:
        """Judge each mission, if a terrain model was given."""
        self._blind = plans.ground is None
        if not self._blind:
            yield from super().judge_all(plans, sent)

    def judge(self, plan: Plan, plans: Plans) -> Iterator[Observation]:
        """Yield the leg that is deepest in the ground and the lowest above it, each with all of its kind."""
        ground = plans.ground
        grounded = plan.family in _NOT_IN_THE_AIR or plan.mav_type in _NOT_IN_THE_AIR_TYPES
        if ground is None or grounded:
            return
        level = self._level(plan, plans, ground)
        legs = _legs(plan, level.home_m)
        if np.isnan(level.home_m) and self._needs_home(plan):
            self._reasons.append(level.by)
        if not len(legs):
            return
        low = lowest(plan.items, legs, ground, self.params["near_m"])
        self._count(low)
        deep = low.above_m < -self.params["model_error_m"]
        for kind, rows in (
            ("below", np.flatnonzero(deep)),
            ("low", np.flatnonzero((low.above_m < self.params["clearance_m"]) & ~deep)),
        ):
            if len(rows):
                yield self._found(plan, legs, low, rows, level, kind)

    def _level(self, plan: Plan, plans: Plans, ground: Ground) -> Level:
        """Return how high home is: as said, if that fits the ground there, else as the ground there where nobody says."""
        told, place = plans.home_m(plan), plans.home_place(plan)
        lat, lon = np.array([place or (np.nan, np.nan)]).T
        under = float(ground.heights(lat, lon)[0])
        off_m = self.params["home_off_m"]
        unset = told is None or np.isnan(told) or (told == 0 and not abs(under) <= off_m)
        if told is None or unset:
            why = "neither the mission nor the terrain model says how high home is"
            return Level(under, "by the terrain model" if np.isfinite(under) else why)
        if abs(told - under) > off_m:
            return Level(
                np.nan,
                f"home is said to be {told:.0f} m above the sea, and the ground there is at {under:.0f} m: "
                "heights above home cannot be compared with the terrain",
            )
        return Level(told, "as said")

    def _needs_home(self, plan: Plan) -> bool:
        """Return whether a mission has heights above home."""
        items = plan.items
        flown = with_height(items) & np.isin(items.command, _ROUTE) & (items.seq >= plan.first)
        return AltRef.HOME in _references(items.frame[flown])

    def _count(self, low: Lowest) -> None:
        """Take note of how much could be judged."""
        self.looked += int(np.count_nonzero(np.isfinite(low.above_m)))
        self._whole_m += float(low.away_m.sum())
        self._known_m += float((low.away_m * low.known).sum())
        self._covered &= bool((low.known == 1).all())

    def _found(
        self, plan: Plan, legs: Legs, low: Lowest, rows: Ints, level: Level, kind: str
    ) -> Observation:
        """Return the worst of the legs at `rows`, placed at the item that it leads to."""
        items, worst = plan.items, rows[np.argmin(low.above_m[rows])]
        reading, other_m = self._reading(items, legs, low, rows, level.home_m)
        values: dict[str, Scalar] = {
            "kind": kind,
            "seq_from": int(items.seq[legs.a[worst]]),
            "seq_to": int(items.seq[legs.b[worst]]),
            "above_m": float(low.above_m[worst]),
            "ground_m": float(low.ground_m[worst]),
            "lat": float(low.lat[worst]),
            "lon": float(low.lon[worst]),
            "legs": len(rows),
            "listed": _listed(items, legs, rows),
            "reference": _SAID[REFERENCE[int(items.frame[legs.a[worst]])]],
            "home": level.by if np.isfinite(level.home_m) else "not known",
            "reading": reading if kind == "below" else "",
            "other_m": float(low.above_m[worst] + other_m),
        }
        found = self.observed(items, legs.b[worst : worst + 1], values, "z")
        return found._replace(times=len(rows))

    def _reading(
        self, items: Items, legs: Legs, low: Lowest, rows: Ints, home_m: float
    ) -> tuple[str, float]:
        """Return the other reference with which none of the legs is in the ground, and how much higher they are.

        Home lies between the two references, so that a whole leg moves by its height.
        """
        said = _references(items.frame[np.concatenate((legs.a[rows], legs.b[rows]))])
        landing = np.isin(items.command[legs.b[rows]], LANDINGS)
        said = said if not landing.any() else _references(items.frame[legs.a[rows]])
        for reference, other, shift in (
            (AltRef.MSL, AltRef.HOME, home_m),
            (AltRef.HOME, AltRef.MSL, -home_m),
        ):
            moved = low.above_m[rows] + shift
            plausible = (moved >= 0) & (moved <= self.params["plausible_m"])
            if said == {reference} and plausible.all():
                return _SAID[other], shift
        return "", 0.0

    def verdict(self) -> Verdict:
        """Return the legs that were judged, and why others were not."""
        if self._blind:
            return Verdict(0, idle="no terrain model was given (--dem FILE)")
        why = "; ".join(dict.fromkeys([*self._reasons, *self._uncovered()]))
        return Verdict(self.looked, "" if self.looked else why, why)

    def _uncovered(self) -> Iterator[str]:
        """Say how much of the missions the terrain model covers, where that is not all."""
        if not self._covered and self._whole_m:
            part = np.floor(100 * self._known_m / self._whole_m)  # all but a little is not all
            yield f"the terrain model covers {part:.0f} % of the mission ({self._whole_m / 1e3:.1f} km)"
        elif not self._covered:
            yield "the terrain model does not cover the mission"


def _references(frames: Ints) -> set[AltRef]:
    return {REFERENCE.get(frame, AltRef.NONE) for frame in np.unique(frames).tolist()}


def _legs(plan: Plan, home_m: float) -> Legs:
    """Return the legs of a mission, with home at `home_m`, and what must be judged item by item."""
    items = plan.items
    rows = np.flatnonzero(np.isin(items.command, _ROUTE) & (items.seq >= plan.first))
    reference = np.array(
        [REFERENCE.get(frame, AltRef.NONE) for frame in items.frame[rows].tolist()]
    )
    base = np.select([reference == AltRef.MSL, reference == AltRef.HOME], [0.0, home_m], np.nan)
    told = with_height(items)[rows]
    height = np.where(told, items.z[rows] + base, np.nan)
    is_leg = _flown_straight(items, rows) & np.isfinite(height[:-1])
    k = np.flatnonzero(is_leg)
    start_m, end_m = height[k], _end_m(items.command[rows[k + 1]], height[k], height[k + 1])
    known = np.isfinite(end_m)
    k, start_m, end_m = k[known], start_m[known], end_m[known]
    in_legs = np.isin(np.arange(len(rows)), np.concatenate((k, k + 1)))
    of_terrain = told & (reference == AltRef.TERRAIN)
    takeoff = np.isin(items.command[rows], _TAKEOFFS)
    alone = np.flatnonzero((np.isfinite(height) | of_terrain) & ~in_legs & ~takeoff)
    own = np.where(of_terrain, items.z[rows], height)[alone]
    return Legs(
        np.concatenate((rows[k], rows[alone])),
        np.concatenate((rows[k + 1], rows[alone])),
        np.concatenate((start_m, own)),
        np.concatenate((end_m, own)),
    )


def _flown_straight(items: Items, rows: Ints) -> Bools:
    """Return (n - 1,) whether the way from each item of the route to the next is a straight line in the air."""
    command, placed = items.command[rows], with_place(items)[rows]
    straight = placed & (command != _SPLINE)
    ends = ~np.isin(command, _TAKEOFFS)
    return np.asarray(straight[:-1] & straight[1:] & ends[1:])


def _end_m(command: Ints, start_m: Floats, end_m: Floats) -> Floats:
    """Return (n,) the height at the end of legs: before a landing, and circles at the end, the better one."""
    circled = ~np.isin(command, CLIMBED)
    best = np.where(np.isin(command, LANDINGS), start_m, np.maximum(start_m, end_m))
    return np.where(circled, best, end_m)


def lowest(items: Items, legs: Legs, ground: Ground, near_m: float) -> Lowest:
    """Return where (n,) legs are lowest; what is nearer than `near_m` to a take-off or landing does not count."""
    a, b = legs.a, legs.b
    away_m = distance_m(items.x[a], items.y[a], items.x[b], items.y[b])
    step_m = max(ground.step_m, float(away_m.sum()) / MOST_SAMPLES)
    steps = np.where(a == b, 0, np.maximum(np.ceil(away_m / step_m), 1)).astype(np.int64)
    first = np.concatenate(([0], np.cumsum(steps + 1)[:-1]))
    leg = np.repeat(np.arange(len(legs)), steps + 1)
    share = (np.arange(len(leg)) - first[leg]) / np.maximum(steps, 1)[leg]
    east = np.mod(items.y[b] - items.y[a] + 180, 360) - 180
    lat = items.x[a][leg] + share * (items.x[b] - items.x[a])[leg]
    lon = items.y[a][leg] + share * east[leg]
    ground_m = ground.heights(lat, lon)
    height_m = legs.start_m[leg] + share * (legs.end_m - legs.start_m)[leg]
    terrain = np.array(
        [REFERENCE.get(frame) == AltRef.TERRAIN for frame in items.frame[a].tolist()]
    )
    above_m = np.where(terrain[leg], height_m, height_m - ground_m)
    counts = ~_at_ground(items, legs, leg, share * away_m[leg], (1 - share) * away_m[leg], near_m)
    above_m = np.where(counts, above_m, np.nan)
    worst = _first_least(above_m, leg, first)
    known = np.add.reduceat(np.isfinite(ground_m) | terrain[leg], first) / (steps + 1)
    return Lowest(above_m[worst], ground_m[worst], lat[worst], lon[worst], away_m, known)


def _at_ground(
    items: Items, legs: Legs, leg: Ints, from_m: Floats, to_m: Floats, near_m: float
) -> Bools:
    """Return (m,) places of legs that are so near to a take-off or landing that they are low by right."""
    begins = np.isin(items.command[legs.a], _TAKEOFFS)[leg]
    ends = np.isin(items.command[legs.b], LANDINGS)[leg]
    return np.asarray((begins & (from_m <= near_m)) | (ends & (to_m <= near_m)))


def _first_least(values: Floats, leg: Ints, first: Ints) -> Ints:
    """Return (n,) the place of the first least value of each leg; NaN is more than anything."""
    filled = np.where(np.isnan(values), np.inf, values)
    least = np.minimum.reduceat(filled, first)
    places = np.flatnonzero(filled == least[leg])
    return places[np.searchsorted(leg[places], np.arange(len(first)))]


def _listed(items: Items, legs: Legs, rows: Ints) -> str:
    """Name legs by the numbers of their items, in the order of the mission."""
    order = rows[np.argsort(legs.b[rows], kind="stable")]
    pairs = zip(items.seq[legs.a[order]].tolist(), items.seq[legs.b[order]].tolist())
    words = [str(b) if a == b else f"{a}-{b}" for a, b in pairs]
    more = f" and {len(words) - MOST_LISTED} more" if len(words) > MOST_LISTED else ""
    return ", ".join(words[:MOST_LISTED]) + more
