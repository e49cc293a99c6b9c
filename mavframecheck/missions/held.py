"""What vehicles hold: uploads that were accepted, and what they send back when they are asked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mavframecheck.missions.items import Items, join
from mavframecheck.missions.transactions import Mission

ALL_KINDS = 255
"""MAV_MISSION_TYPE_ALL, in MISSION_CLEAR_ALL."""

Known = Literal["uploaded", "read back", "cleared", "not known"]


@dataclass(frozen=True, slots=True)
class Held:
    """Mission, fence or rally points of one vehicle, as of the last transfer."""

    system: int
    mission_type: int
    """MAV_MISSION_TYPE: 0 mission, 1 fence, 2 rally points."""
    known: Known
    """How it is known; ``not known`` after an upload that failed or was not answered."""
    count: int
    items: Items
    """In order of `seq`; fewer than `count` where frames were lost."""
    source: Mission
    """The transfer that says so."""


@dataclass(frozen=True, slots=True)
class Readback:
    """What a vehicle sent back, and what was in it before."""

    before: Held
    mission: Mission


class Ledger:
    """Goes through transfers in their order."""

    def __init__(self, is_vehicle: Callable[[int], bool]) -> None:
        """Know nothing; `is_vehicle` tells of a sender whether it is an autopilot."""
        self._is_vehicle = is_vehicle
        self.held: dict[tuple[int, int], Held] = {}
        """By system and mission type."""
        self.readbacks: list[Readback] = []

    def enter(self, missions: Iterable[Mission]) -> Ledger:
        """Take in transfers, in the order in which they ended."""
        for mission in sorted(missions, key=lambda each: each.ended):
            if self._is_vehicle(mission.sender):
                self._sent_back(mission)
            else:
                self._uploaded(mission)
        return self

    def _sent_back(self, mission: Mission) -> None:
        key = mission.sender >> 8, mission.mission_type
        if not mission.complete:
            return
        if key in self.held:
            self.readbacks.append(Readback(self.held[key], mission))
        self.held[key] = Held(*key, "read back", len(mission.items), mission.items, mission)

    def _uploaded(self, mission: Mission) -> None:
        kinds = [mission.mission_type]
        if mission.mission_type == ALL_KINDS:
            kinds = [kind for system, kind in self.held if system == mission.target]
        for kind in kinds:
            key = mission.target, kind
            self.held[key] = self._after(mission, self.held.get(key), key)

    def _after(self, mission: Mission, before: Held | None, key: tuple[int, int]) -> Held:
        """Return what a vehicle holds after an upload."""
        if not mission.accepted or mission.count is None:
            return Held(*key, "not known", 0, mission.items.take(_NONE), mission)
        if not mission.partial:
            known: Known = "uploaded" if mission.count else "cleared"
            return Held(*key, known, mission.count, mission.items, mission)
        if before is None or before.known == "not known":
            return Held(*key, "not known", 0, mission.items.take(_NONE), mission)
        kept = np.flatnonzero(~np.isin(before.items.seq, mission.items.seq))
        both = join([before.items.take(kept), mission.items])
        items = both.take(np.argsort(both.seq, kind="stable"))
        return Held(*key, "uploaded", max(before.count, len(items)), items, mission)


_NONE = np.zeros(0, np.int64)
