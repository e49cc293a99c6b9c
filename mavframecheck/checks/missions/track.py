"""Where a vehicle went, or was told to go, beside its plan: exchanged, mirrored or turned (MFC416)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.missions.plans import Floats, MissionCheck, Plan, Plans, with_place
from mavframecheck.checks.missions.routes import (
    HOME_LAT,
    HOME_LON,
    LAT,
    LON,
    NUMBER,
    REACHED,
    SENT,
    SEQ,
    Route,
    Routes,
)
from mavframecheck.geo.permutations import PERMUTATIONS
from mavframecheck.model import Scalar
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.pairs import metres
from mavframecheck.wire import Batch, Dialect

LEVEL: Floats = np.unique(PERMUTATIONS[PERMUTATIONS[:, 2, 2] == 1][:, :2, :2], axis=0)
"""(8, 2, 2) what may have become of north and east."""
STRAIGHT = "as it is"
_WORDS = {
    (1, 0, 0, 1): STRAIGHT,
    (1, 0, 0, -1): "with east and west exchanged",
    (-1, 0, 0, 1): "with north and south exchanged",
    (-1, 0, 0, -1): "with both signs reversed",
    (0, 1, 1, 0): "with north and east exchanged",
    (0, -1, -1, 0): "with north and east exchanged and both signs reversed",
    (0, 1, -1, 0): "turned to the left by a quarter",
    (0, -1, 1, 0): "turned to the right by a quarter",
}
_LEAST, _MOST = 3, 1000
"""Places of a plan that is compared."""


class Fit(NamedTuple):
    """How a route lies on a plan."""

    words: str
    straight_m: float
    left_m: float
    """How far they are apart as they are, and with the turn or mirror, m."""
    places: int


class TrackAgainstPlan(MissionCheck):
    """Routes that meet the places of a plan only after a swap, a mirror or a turn about home.

    The plan is the one given beside the recording, else the mission that was sent before. Items that were
    sent or reached are compared one by one, targets with the nearest place of the plan.
    """

    of_missions = False

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no route yet."""
        super().__init__(params, dialect)
        self._routes = Routes()

    def update(self, batch: Batch, context: Context) -> None:
        """Follow what is reached and asked for."""
        super().update(batch, context)
        self._routes.update(batch, context)

    def judge_all(self, plans: Plans, sent: list[Plan]) -> Iterator[Observation]:
        """Yield each route that fits a plan only when that is turned or mirrored; what follows from one, once."""
        routes = sorted(self._routes.routes.values(), key=lambda each: each.first.number)
        wrong: set[int] = set()
        for route in routes:
            message = route.subject.message
            own = [p for p in sent if p.vehicle == route.vehicle and message not in SENT]
            for plan in plans.intended or own:
                fit = self._fit(plan, route, plans)
                if fit is None or fit.words == STRAIGHT:
                    continue
                if message != REACHED or route.vehicle not in wrong:
                    yield _observed(route, fit, given=bool(plans.intended))
                wrong.add(route.vehicle)
                break

    def _fit(self, plan: Plan, route: Route, plans: Plans) -> Fit | None:
        """Return how a route lies on a plan, None where nothing fits or nothing can be told."""
        places = route.places
        if not plans.intended:
            since, until = plan.mission.ended, plans.replaced_at(plan)
            places = places[(places[:, NUMBER] > since) & (places[:, NUMBER] < until)]
        both = _compared(plan, places)
        if both is None or both.size_m < self.params["min_size_m"]:
            return None
        self.looked += len(both.wanted)
        left = np.array([both.apart_m(turn) for turn in LEVEL])
        best = int(np.argmin(left))
        straight, left_m = both.apart_m(np.eye(2)), float(left[best])
        near = max(self.params["near_m"], self.params["near_share"] * both.size_m)
        if left_m > near or straight < max(self.params["ratio"] * left_m, both.size_m):
            return None
        turn = LEVEL[best].astype(int).ravel().tolist()
        words = _WORDS[turn[0], turn[1], turn[2], turn[3]]
        return Fit(words, straight, left_m, len(both.wanted))

    def verdict(self) -> Verdict:
        """Return the places that were compared."""
        reached = any(key[0] == REACHED for key in self._routes.routes)
        why = "no mission with three places in different directions was flown or asked for"
        return Verdict(self.looked, why if reached and not self.looked else "")


def _observed(route: Route, fit: Fit, *, given: bool) -> Observation:
    values: dict[str, Scalar] = {
        "says": fit.words,
        "straight_m": fit.straight_m,
        "left_m": fit.left_m,
        "given": given,
        "flown": route.subject.message == REACHED,
    }
    return Observation(route.subject, route.first, route.last, fit.places, values)


class _Compared(NamedTuple):
    """Places of a plan, and of a route."""

    wanted: Floats
    """(n, 2) metres north and east of home."""
    met: Floats
    """(n, 2) those of the same items, or (m, 2) targets."""
    one_by_one: bool

    @property
    def size_m(self) -> float:
        """How far places lie apart in the direction in which they do least, m; 0 with too few of them."""
        if len(np.unique(np.round(self.wanted), axis=0)) < _LEAST:
            return 0.0
        spread = np.linalg.svd(self.wanted - self.wanted.mean(axis=0), compute_uv=False)
        return float(spread[-1] / np.sqrt(len(self.wanted)))

    def apart_m(self, turn: Floats) -> float:
        """Return how far the plan, turned, lies from the route, m.

        Items: three of four lie no farther. Targets: how far the place that was met worst lies from any target.
        """
        wanted = self.wanted @ turn.T
        if self.one_by_one:
            return float(np.percentile(np.linalg.norm(wanted - self.met, axis=1), 75))
        away = np.linalg.norm(wanted[:, np.newaxis] - self.met[np.newaxis], axis=2)
        return float(away.min(axis=1).max())


def _compared(plan: Plan, places: Floats) -> _Compared | None:
    """Return the places that a plan and a route have to have in common, None where there are none."""
    homes = places[np.isfinite(places[:, [HOME_LAT, HOME_LON]]).all(axis=1)]
    items = plan.items
    rows = np.flatnonzero(with_place(items) & (items.seq >= plan.first))
    if plan.mission.mission_type or not len(homes) or not _LEAST <= len(rows) <= _MOST:
        return None
    home = homes[-1, [HOME_LAT, HOME_LON]]
    wanted = _from_home(np.column_stack((items.x[rows], items.y[rows])), home)
    met = _from_home(places[:, [LAT, LON]], home)
    if places[0, SEQ] < 0:
        return _Compared(wanted, met, one_by_one=False)
    _, a, b = np.intersect1d(items.seq[rows], places[:, SEQ], return_indices=True)
    return _Compared(wanted[a], met[b], one_by_one=True)


def _from_home(at: Floats, home: Floats) -> Floats:
    """Return (n, 2) metres north and east of home."""
    return np.column_stack(metres(at[:, 0], at[:, 1], home[0], home[1]))
