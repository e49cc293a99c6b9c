"""Missions that mix heights above home and above the sea (MFC203)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import REFERENCE, EachMission, Plan, Plans, with_height
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.missions import Items
from mavframecheck.semantics.enums import AltRef


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


class AltitudeProfile(EachMission):
    """Missions that mix heights above home and above the sea, with a leg that climbs like no other.

    The profile is implausible when the two ends of a leg are far apart in height, steeply, while the
    numbers in the items are close to each other: then one of the frames is wrong.
    """

    def judge(self, plan: Plan, plans: Plans) -> Iterator[Observation]:
        """Yield the steepest such leg of a mission."""
        home = plans.home_m(plan)
        if home is None and _mixes(plan.items, plan.first):
            self.missing = "nothing says how high home is"
            return
        self.looked += 1
        legs = _legs(plan.items, plan.first, home) if home is not None else ()
        wild = [leg for leg in legs if self._wild(leg)]
        if not wild:
            return
        worst = max(wild, key=lambda leg: abs(leg.climb_m))
        items = plan.items
        numbers = Counter(REFERENCE[frame] for frame in items.frame[with_height(items)].tolist())
        yield self.observed(
            items,
            np.array([leg.second for leg in wild]),
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


def _mixes(items: Items, first: int) -> bool:
    frames = items.frame[with_height(items) & (items.seq >= first)].tolist()
    return {AltRef.MSL, AltRef.HOME} <= {REFERENCE[frame] for frame in frames}


def _legs(items: Items, first: int, home: float) -> Iterator[Leg]:
    """Yield the legs between neighbours, one above home and one above the sea."""
    rows = np.flatnonzero(with_height(items) & (items.seq >= first))
    references = [REFERENCE[frame] for frame in items.frame[rows].tolist()]
    base = {AltRef.MSL: 0.0, AltRef.HOME: home}
    away = distance_m(items.x[rows[:-1]], items.y[rows[:-1]], items.x[rows[1:]], items.y[rows[1:]])
    for k in range(len(rows) - 1):
        one, other = references[k], references[k + 1]
        if one != other and one in base and other in base:
            z, z_next = float(items.z[rows[k]]), float(items.z[rows[k + 1]])
            climb = base[other] + z_next - base[one] - z
            yield Leg(int(rows[k]), int(rows[k + 1]), climb, abs(z_next - z), float(away[k]))


def _words(items: Items, row: int) -> str:
    return "above home" if REFERENCE[int(items.frame[row])] == AltRef.HOME else "above the sea"
