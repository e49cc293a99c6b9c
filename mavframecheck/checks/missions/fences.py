"""Fences that enclose nothing, or not what their numbers say (MFC905)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import FENCE, Bools, EachMission, Floats, Ints, Plan, Plans
from mavframecheck.geo.rotations import wrapped_deg
from mavframecheck.missions import Items
from mavframecheck.model import Scalar
from mavframecheck.semantics.constants import constant

_POLYGONS = np.array(
    [constant(f"MAV_CMD.NAV_FENCE_POLYGON_VERTEX_{n}") for n in ("INCLUSION", "EXCLUSION")]
)
_CIRCLES = np.array(
    [constant(f"MAV_CMD.NAV_FENCE_CIRCLE_{name}") for name in ("INCLUSION", "EXCLUSION")]
)
CORNERS = 3
MOST_COMPARED = 2000
"""Corners of a polygon whose edges are compared with each other."""
_FLAT_M2 = 1.0


class FenceGeometry(EachMission):
    """Polygons whose corners and their number disagree, that cross themselves or are flat; circles without radius."""

    kinds = (FENCE,)

    def judge(self, plan: Plan, _plans: Plans) -> Iterator[Observation]:
        """Yield each polygon and circle that is none."""
        items = plan.items
        circles = np.flatnonzero(np.isin(items.command, _CIRCLES))
        for row in circles[~(items.params[circles, 0] > 0)].tolist():
            yield self._found(items, np.array([row]), "radius", 0, "param1")
        polygons = list(_polygons(items)) if plan.mission.complete else []
        self.looked += len(circles) + len(polygons)
        for rows in polygons:
            yield from self._polygon(items, rows)

    def _polygon(self, items: Items, rows: Ints) -> Iterator[Observation]:
        said = int(np.nan_to_num(items.params[rows[0], 0]))
        if said != len(rows) or (items.params[rows, 0] != said).any():
            yield self._found(items, rows, "count", said, "param1")
        elif len(rows) < CORNERS:
            yield self._found(items, rows, "corners", said)
        else:
            corners = _metres(items.x[rows], items.y[rows])
            if abs(_area_m2(corners)) < _FLAT_M2 and not _crosses(corners).any():
                yield self._found(items, rows, "flat", said)
            elif (crossing := _crosses(corners)).any():
                yield self._found(items, rows[crossing], "crosses", said)

    def _found(
        self, items: Items, rows: Ints, what: str, said: int, field: str | None = None
    ) -> Observation:
        values: dict[str, Scalar] = {
            "what": what,
            "item": int(items.seq[rows[0]]),
            "corners": len(rows),
            "said": said,
            "radius_m": float(items.params[rows[0], 0]),
        }
        return self.observed(items, rows, values, field)


def _polygons(items: Items) -> Iterator[Ints]:
    """Yield the rows of each polygon: as many as its first corner says, of one kind, one after the other."""
    corner = np.isin(items.command, _POLYGONS)
    row = 0
    while row < len(items):
        if not corner[row]:
            row += 1
            continue
        same = items.command[row:] == items.command[row]
        run = int(np.argmin(same)) if not same.all() else len(same)
        said = items.params[row, 0]
        size = int(said) if 0 < said <= run else run
        yield np.arange(row, row + size)
        row += size


def _metres(lat: Floats, lon: Floats) -> Floats:
    """Return (n, 2) metres north and east of the first corner, near enough to tell crossings."""
    east = wrapped_deg(lon - lon[0])
    return np.stack([lat - lat[0], east * np.cos(np.radians(lat[0]))], axis=1) * 111_195.0


def _area_m2(corners: Floats) -> float:
    ahead = np.roll(corners, -1, axis=0)
    return float(np.sum(corners[:, 0] * ahead[:, 1] - corners[:, 1] * ahead[:, 0]) / 2)


def _crosses(corners: Floats) -> Bools:
    """Return (n,) edges (each from its corner to the next) that cross another one."""
    n = len(corners)
    crossing = np.zeros(n, np.bool_)
    if n > MOST_COMPARED:
        return crossing
    a, b = corners, np.roll(corners, -1, axis=0)
    for k in range(n - 1):
        others = np.arange(k + 2, n if k else n - 1)
        p, q = a[others], b[others]
        apart = _side(a[k], b[k], p) * _side(a[k], b[k], q) < 0
        apart &= _side(p, q, a[k]) * _side(p, q, b[k]) < 0
        crossing[others] |= apart
        crossing[k] |= apart.any()
    return crossing


def _side(a: Floats, b: Floats, p: Floats) -> Floats:
    """Return on which side of the line from a to b a point lies: the sign."""
    u, v = b - a, p - a
    return np.asarray(np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]))
