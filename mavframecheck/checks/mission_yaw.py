"""Headings of whole missions: a yaw of 0 in every item, where 0 is north and 'not set' is NaN."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict, place
from mavframecheck.checks.missions import MAX_MISSIONS, PLAIN_MISSION, flown
from mavframecheck.geo.geodesy import bearing_deg, distance_m
from mavframecheck.missions import Items, Mission, Transactions
from mavframecheck.model import Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect

Ints = npt.NDArray[np.int64]

AUTOPILOT = 1
"""Component of an autopilot."""
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


class ZeroYaw(Check):
    """Missions for a PX4 multirotor whose items all hold yaw 0, which turns the vehicle to north."""

    of_missions = True

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Remember nothing yet."""
        super().__init__(params, dialect)
        self._transactions = Transactions()
        self._vehicles: dict[int, tuple[str, int]] = {}
        """System -> family and MAV_TYPE, as first said."""
        self._missions: list[Mission] = []
        self._seen: set[tuple[int, int, bytes]] = set()
        self._judged = 0
        self._unknown = 0
        self._found: list[Observation] | None = None
        """What was found, once every mission was judged."""

    def update(self, batch: Batch, _context: Context) -> None:
        """Collect what vehicles say they are, and missions that end in this batch."""
        if "HEARTBEAT" in batch.tables:
            for sysid, known, mav_type in flown(batch.tables["HEARTBEAT"]):
                self._vehicles.setdefault(sysid, (known, mav_type))
        for mission in self._transactions.update(batch):
            self._keep(mission)

    def _keep(self, mission: Mission) -> None:
        """Keep a mission once, however often it is sent; what a vehicle sends back is no input."""
        if mission.mission_type != PLAIN_MISSION or len(self._missions) >= MAX_MISSIONS:
            return
        items = mission.items
        content = np.stack([items.seq, items.command], axis=1).tobytes() + items.params.tobytes()
        key = (mission.sender, mission.target, content + items.x.tobytes() + items.y.tobytes())
        if key not in self._seen:
            self._seen.add(key)
            self._missions.append(mission)

    def finish(self) -> Iterable[Observation]:
        """Return the missions whose headings were never set."""
        if self._found is None:
            for mission in self._transactions.finish():
                self._keep(mission)
            judged = [self._judge(mission) for mission in self._missions]
            self._found = [observation for observation in judged if observation is not None]
        return self._found

    def _judge(self, mission: Mission) -> Observation | None:
        items = mission.items
        rows = np.flatnonzero(np.isin(items.command, WITH_YAW))
        sent_back = mission.sender >> 8 in self._vehicles and mission.sender & 0xFF == AUTOPILOT
        if sent_back or len(rows) < self.params["min_items"]:
            return None
        known = self._vehicles.get(mission.target)
        if known is None:
            self._unknown += len(rows)
            return None
        if known[0] != "px4" or known[1] not in TURNS:
            return None
        self._judged += len(rows)
        if (items.params[rows, YAW] != 0).any() or not self._turns(items, rows):
            return None
        frames = items.frames
        message = self.dialect.layouts[int(frames.msgid[rows[0]])].name
        return Observation(
            Subject(mission.sender >> 8, mission.sender & 0xFF, message, "param4"),
            place(frames, int(rows[0])),
            place(frames, int(rows[-1])),
            len(rows),
            {"items": len(rows)},
        )

    def _turns(self, items: Items, rows: Ints) -> bool:
        """Return whether a leg leads another way than north: else 0 may be meant, or makes no difference."""
        placed = rows[np.isin(items.frame[rows], GLOBAL_FRAMES)]
        lat, lon = items.x[placed], items.y[placed]
        way = bearing_deg(lat[:-1], lon[:-1], lat[1:], lon[1:])
        long = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:]) > self.params["min_leg_m"]
        off_north = np.abs((way + 180) % 360 - 180) > self.params["min_turn_deg"]
        return bool((long & off_north).any())

    def verdict(self) -> Verdict:
        """Return the items of missions for PX4 multirotors."""
        self.finish()
        if self._unknown and not self._judged:
            return Verdict(0, "no HEARTBEAT of the autopilot says what it is")
        return Verdict(self._judged)
