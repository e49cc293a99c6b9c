"""Coordinates with too few decimals (MFC909)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import (
    FENCE,
    MISSION,
    RALLY,
    EachMission,
    Plan,
    Plans,
    with_place,
)

_DECIMALS = 7
"""Of a coordinate on the wire."""
_METRES = 111_195.0
"""Of a degree of latitude."""


class Rounded(EachMission):
    """Missions in which every latitude and longitude ends after a few decimals."""

    kinds = (MISSION, FENCE, RALLY)

    def judge(self, plan: Plan, _plans: Plans) -> Iterator[Observation]:
        """Yield a mission whose places all lie on a coarse grid."""
        items = plan.items
        rows = np.flatnonzero(with_place(items) & (items.seq >= plan.first))
        places = np.round(np.stack([items.x[rows], items.y[rows]], axis=1) * 10**_DECIMALS)
        if len(np.unique(places, axis=0)) < self.params["min_places"]:
            return
        self.looked += len(rows)
        decimals = _DECIMALS - _trailing_zeros(places.astype(np.int64))
        if decimals <= self.params["few_decimals"]:
            step_m = _METRES * 10.0**-decimals
            yield self.observed(
                items, rows, {"decimals": decimals, "items": len(rows), "step_m": step_m}
            )


def _trailing_zeros(values: np.typing.NDArray[np.int64]) -> int:
    """Return how many decimal digits are zero at the end of all `values`."""
    zeros = 0
    while zeros < _DECIMALS and not (values % 10 ** (zeros + 1)).any():
        zeros += 1
    return zeros
