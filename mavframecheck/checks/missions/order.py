"""Numbers of items that do not add up (MFC902)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import (
    FENCE,
    MISSION,
    Bools,
    EachMission,
    Floats,
    Plan,
    Plans,
)
from mavframecheck.missions import Items
from mavframecheck.model import Scalar
from mavframecheck.semantics.constants import constant

_JUMP = constant("MAV_CMD.DO_JUMP")
_NUMBER, _MODE, _COMPLEX = "file_number", "file_altitude_mode", "file_complex_item"
"""The number that a file gives an item; what only a plan says."""


class Sequence(EachMission):
    """Items counted past the end, left out, given twice, and jumps to where nothing is."""

    kinds = (MISSION, FENCE)

    def judge(self, plan: Plan, _plans: Plans) -> Iterator[Observation]:
        """Yield each kind of mistake in a mission once."""
        mission, items = plan.mission, plan.items
        self.looked += len(items)
        if mission.count is None:
            return
        end = mission.first + mission.count
        outside = (items.seq >= end) | (items.seq < mission.first)
        yield from self._of(items, outside, "outside", end)
        if not plan.sent_back:
            twice = np.isin(items.seq, mission.again) & (items.seq >= plan.first)
            yield from self._of(items, twice, "again", end)
        for what, wrong in _miscounted(items).items():
            yield from self._of(items, wrong, what, end)
        if mission.complete and not mission.partial:
            yield from self._of(items, _lost_jumps(items), "jump", end)

    def _of(self, items: Items, wrong: Bools, what: str, end: int) -> Iterator[Observation]:
        rows = np.flatnonzero(wrong)
        if len(rows):
            row = int(rows[0])
            values: dict[str, Scalar] = {
                "what": what,
                "item": int(_numbers(items)[row] if what in ("gap", "again") else items.seq[row]),
                "items": len(rows),
                "end": end,
                "jump": float(items.params[row, 0]),
            }
            yield self.observed(items, rows, values, None if what != "jump" else "param1")


def _miscounted(items: Items) -> dict[str, Bools]:
    """Return the items of a waypoint file whose number is left out before them, or given again.

    A plan numbers only what jumps need: surveys and corridors take several numbers.
    """
    numbers = items.said.get(_NUMBER)
    if numbers is None or np.isfinite(items.said[_MODE]).any() or np.isnan(numbers).any():
        return {}
    if np.isfinite(items.said[_COMPLEX]).any():
        return {}
    step = np.diff(numbers, prepend=numbers[:1] - 1)
    return {"gap": np.asarray(step > 1), "again": np.asarray(step < 1)}


def _lost_jumps(items: Items) -> Bools:
    """Return (n,) jumps to an item that is not there, or to themselves."""
    numbers = _numbers(items)
    goal = items.params[:, 0]
    lost = ~np.isin(goal, numbers) | (goal == numbers)
    return np.asarray((items.command == _JUMP) & lost)


def _numbers(items: Items) -> Floats:
    """Return (n,) the numbers that a file gives items, else their `seq`."""
    numbers = items.said.get(_NUMBER, items.seq.astype(float))
    return np.where(np.isnan(numbers), items.seq, numbers)
