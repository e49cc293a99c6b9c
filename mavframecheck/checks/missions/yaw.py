"""Headings of whole missions: a yaw of 0 in every item, where 0 is north and 'not set' is NaN (MFC602)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import EachMission, Ints, Plan, Plans
from mavframecheck.geo.geodesy import bearing_deg, distance_m
from mavframecheck.geo.rotations import wrapped_deg
from mavframecheck.missions import Items
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES

YAW = 3
"""Where params holds param4."""
WITH_YAW = np.array(
    [constant(f"MAV_CMD.{name}") for name in ("NAV_WAYPOINT", "NAV_TAKEOFF", "NAV_LAND")]
)
"""Commands whose param4 is a heading in degrees, NaN for 'as the vehicle likes'."""
TURNS = frozenset(
    constant(f"MAV_TYPE.{name}")
    for name in (
        *("QUADROTOR", "COAXIAL", "HELICOPTER", "HEXAROTOR", "OCTOROTOR", "TRICOPTER"),
        *("DODECAROTOR", "DECAROTOR"),
    )
)
"""MAV_TYPE of vehicles that turn to a heading while they fly another way."""


class ZeroYaw(EachMission):
    """Missions for a PX4 multirotor whose items all hold yaw 0, which turns the vehicle to north."""

    def judge(self, plan: Plan, _plans: Plans) -> Iterator[Observation]:
        """Yield a mission whose headings were never set; what a vehicle sends back is no input."""
        items = plan.items
        rows = np.flatnonzero(np.isin(items.command, WITH_YAW))
        if plan.sent_back or len(rows) < self.params["min_items"]:
            return
        if not plan.family:
            self.missing = "no HEARTBEAT of the autopilot says what it is"
        elif plan.family == "px4" and plan.mav_type in TURNS:
            self.looked += len(rows)
            if not (items.params[rows, YAW] != 0).any() and self._turns(items, rows):
                yield self.observed(items, rows, {"items": len(rows)}, "param4")

    def _turns(self, items: Items, rows: Ints) -> bool:
        """Return whether a leg leads another way than north: else 0 may be meant, or makes no difference."""
        placed = rows[np.isin(items.frame[rows], GLOBAL_FRAMES)]
        lat, lon = items.x[placed], items.y[placed]
        way = bearing_deg(lat[:-1], lon[:-1], lat[1:], lon[1:])
        long = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:]) > self.params["min_leg_m"]
        off_north = np.abs(wrapped_deg(way)) > self.params["min_turn_deg"]
        return bool((long & off_north).any())
