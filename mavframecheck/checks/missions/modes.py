"""Heights that a plan file says twice, and differently (MFC904)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import (
    REFERENCE,
    Bools,
    EachMission,
    Floats,
    Ints,
    Plan,
    Plans,
    with_height,
)
from mavframecheck.model import Scalar
from mavframecheck.semantics.enums import AltRef

_MODE, _ALTITUDE, _ABOVE_TERRAIN = "file_altitude_mode", "file_altitude", "file_terrain_altitude"
_LEVELS = {AltRef.MSL: "mean sea level", AltRef.HOME: "home", AltRef.TERRAIN: "terrain"}


class PlanHeights(EachMission):
    """Items whose AltitudeMode goes with another frame than elsewhere in the file, or whose heights disagree.

    Two numberings of AltitudeMode are in the field: only what the same file does elsewhere tells.
    """

    def judge(self, plan: Plan, _plans: Plans) -> Iterator[Observation]:
        """Yield the items whose mode contradicts their frame, then those with two heights."""
        items = plan.items
        if _MODE not in items.said:
            return
        modes, heights = items.said[_MODE], items.said[_ALTITUDE]
        levels = np.array(
            [_LEVELS.get(REFERENCE.get(f, AltRef.NONE), "") for f in items.frame.tolist()]
        )
        told = with_height(items) & (items.seq >= plan.first) & np.isfinite(modes) & (levels != "")
        self.looked += int(told.sum())
        odd, usual = self._odd(modes, levels, told)
        other = self._other_height(items.z, heights, items.said[_ABOVE_TERRAIN], told)
        for what, rows in (("mode", odd), ("height", np.flatnonzero(other))):
            if len(rows):
                row = int(rows[0])
                values: dict[str, Scalar] = {
                    "what": what,
                    "item": int(items.seq[row]),
                    "items": len(rows),
                    "mode": int(modes[row]),
                    "level": str(levels[row]),
                    "usual": usual,
                    "z": float(items.z[row]),
                    "altitude": float(heights[row]),
                }
                yield self.observed(items, rows, values, "frame" if what == "mode" else "z")

    def _odd(
        self, modes: Floats, levels: np.typing.NDArray[np.str_], told: Bools
    ) -> tuple[Ints, str]:
        """Return the items whose level is not the one that their mode has in most items, and that level."""
        for mode in np.unique(modes[told]).tolist():
            rows = np.flatnonzero(told & (modes == mode))
            ((usual, count),) = Counter(levels[rows].tolist()).most_common(1)
            odd = rows[levels[rows] != usual]
            if (
                len(odd)
                and count >= self.params["min_items"]
                and count >= self.params["share"] * len(rows)
            ):
                return odd, str(usual)
        return np.zeros(0, np.int64), ""

    def _other_height(self, z: Floats, altitude: Floats, above: Floats, told: Bools) -> Bools:
        """Return (n,) items whose height is not their Altitude; one worked out from the terrain is another."""
        off = np.abs(z - altitude) > self.params["max_off_m"]
        return np.asarray(told & off & ~np.isfinite(above))
