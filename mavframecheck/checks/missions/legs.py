"""Legs that no vehicle flies: from one place to the next, too far or too steep (MFC901)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import (
    CLIMBED,
    FLOWN,
    REFERENCE,
    Bools,
    EachMission,
    Floats,
    Ints,
    Plan,
    Plans,
    with_place,
)
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.missions import Items
from mavframecheck.semantics.enums import AltRef

_LEVEL = ("ardurover",)
"""Families whose vehicles do not climb."""
_NEAR_NULL_DEG = 1e-3
_OTHER_MISTAKE = 0.05
"""A leg that a mirror image or an exchange shortens to this share is another rule's business."""


class ImplausibleLeg(EachMission):
    """Legs longer than vehicles fly, or that climb more than they lead on."""

    def judge(self, plan: Plan, plans: Plans) -> Iterator[Observation]:
        """Yield the worst leg of a mission, with the number of such legs."""
        items = plan.items
        somewhere = np.maximum(np.abs(items.x), np.abs(items.y)) > _NEAR_NULL_DEG
        flown = with_place(items) & somewhere & np.isin(items.command, FLOWN)
        rows = np.flatnonzero(flown & (items.seq >= plan.first))
        if len(rows) < 2:
            return
        self.looked += len(rows) - 1
        a, b = rows[:-1], rows[1:]
        away_m = distance_m(items.x[a], items.y[a], items.x[b], items.y[b])
        far = away_m > self.params["far_km"] * 1e3
        if far.any():
            far &= ~(_otherwise_m(items, a, b) < _OTHER_MISTAKE * away_m)
        climb_m = items.z[b] - items.z[a]
        steep = self._steep(plan, a, b, climb_m, away_m)
        home = plans.home_m(plan)
        if home is not None:
            steep &= np.abs(np.abs(climb_m) - abs(home)) > self.params["home_m"]
        bad = np.flatnonzero(far | steep)
        if len(bad):
            worst = bad[np.argmax(np.where(far, away_m, np.abs(climb_m))[bad])]
            values = {
                "seq_from": int(items.seq[a[worst]]),
                "seq_to": int(items.seq[b[worst]]),
                "away_m": float(away_m[worst]),
                "climb_m": float(climb_m[worst]),
                "far": bool(far[worst]),
            }
            yield self.observed(items, b[bad], values)

    def _steep(self, plan: Plan, a: Ints, b: Ints, climb_m: Floats, away_m: Floats) -> Bools:
        """Return (n,) legs that climb or sink too much; heights of two kinds are not compared."""
        items = plan.items
        reference = np.array([REFERENCE.get(frame, AltRef.NONE) for frame in items.frame.tolist()])
        told = (reference[a] == reference[b]) & np.isin(reference[a], (AltRef.MSL, AltRef.HOME))
        told &= np.isin(items.command[a], CLIMBED) & np.isin(items.command[b], CLIMBED)
        told &= plan.family not in _LEVEL
        winged = plan.family == "arduplane"
        grade = self.params["wing_grade" if winged else "rotor_grade"]
        least_m = self.params["wing_climb_m" if winged else "rotor_climb_m"]
        steep = (np.abs(climb_m) >= least_m) & (np.abs(climb_m) > grade * away_m)
        return np.asarray(told & steep & (away_m > self.params["min_away_m"]))


def _otherwise_m(items: Items, a: Ints, b: Ints) -> Floats:
    """Return (n,) how long a leg is with latitude and longitude of one end exchanged, or a sign reversed."""
    found = np.full(len(a), np.inf)
    for one, other in ((a, b), (b, a)):
        lat, lon = items.x[one], items.y[one]
        for north, east in ((lon, lat), (-lat, lon), (lat, -lon), (-lat, -lon)):
            legal = np.abs(north) <= 90
            away = distance_m(np.where(legal, north, 0), east, items.x[other], items.y[other])
            found = np.where(legal, np.fmin(found, away), found)
    return found
