"""The yaw of gimbals beside the heading of their vehicle: from where it counts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.rotations import wrapped
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.tracks import first_in_each
from mavframecheck.wire import Batch, Dialect, Place, Table

Floats = npt.NDArray[np.float64]

MESSAGE = "GIMBAL_DEVICE_ATTITUDE_STATUS"
MAX_STREAMS = 64
BIN_US = 500_000
"""One report is taken in each of these, us, ..."""
APART_US = 1_500_000
"""... and compared with the one before if that is no older than this."""
_LOCK, _VEHICLE, _EARTH = (
    constant(f"GIMBAL_DEVICE_FLAGS.{name}")
    for name in ("YAW_LOCK", "YAW_IN_VEHICLE_FRAME", "YAW_IN_EARTH_FRAME")
)
_TURNS = {
    (_VEHICLE, False): 0.0,
    (_VEHICLE, True): -1.0,
    (_EARTH, False): 1.0,
    (_EARTH, True): 0.0,
}
"""How far yaw turns per turn of the vehicle, by its frame and whether it is locked to north."""


@dataclass(slots=True)
class _Gimbal:
    """One gimbal, as long as its flags stay the same."""

    rows: int = 0
    first: Place | None = None
    last: Place | None = None
    bin: int = -1
    t_us: int = 0
    yaw: float = 0.0
    heading: float = 0.0
    """The last report that was taken."""
    turned: float = 0.0
    """How far the vehicle turned, rad."""
    both: float = 0.0
    squares: float = 0.0
    own: float = 0.0
    """Sums of turns of both, of the vehicle squared, of the gimbal squared."""

    def add(self, t_us: npt.NDArray[np.int64], yaw: Floats, heading: Floats) -> None:
        """Add reports, each beside the heading of the vehicle (rad)."""
        bins = t_us // BIN_US
        taken = first_in_each(bins, self.bin)
        if not len(taken):
            return
        known = self.bin >= 0
        t = np.concatenate(([self.t_us], t_us[taken]))[0 if known else 1 :]
        gimbal = np.concatenate(([self.yaw], yaw[taken]))[0 if known else 1 :]
        vehicle = np.concatenate(([self.heading], heading[taken]))[0 if known else 1 :]
        near = np.diff(t) <= APART_US
        turn, swing = wrapped(np.diff(vehicle))[near], wrapped(np.diff(gimbal))[near]
        self.turned += float(np.abs(turn).sum())
        self.both += float(turn @ swing)
        self.squares += float(turn @ turn)
        self.own += float(swing @ swing)
        self.bin, self.t_us = int(bins[taken[-1]]), int(t[-1])
        self.yaw, self.heading = float(gimbal[-1]), float(vehicle[-1])

    @property
    def slope(self) -> float:
        """Turn of the gimbal per turn of the vehicle."""
        return self.both / self.squares if self.squares else 0.0

    def left(self, slope: float) -> float:
        """Return the share of the turning that another slope leaves unexplained."""
        off = self.own - 2 * slope * self.both + slope**2 * self.squares
        return off / self.squares if self.squares else np.inf


class YawFrame(Check):
    """Gimbals whose yaw moves as it would in the other frame than their flags say."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no gimbal yet."""
        super().__init__(params, dialect)
        self._gimbals: dict[tuple[int, int, int], _Gimbal] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Add the reports of a batch."""
        table = batch.tables.get(MESSAGE)
        if table is None:
            return
        heading = context.lookup("vehicle.yaw", table, late=False)
        flags = table["flags"].astype(np.int64) & (_LOCK | _VEHICLE | _EARTH)
        one = ((flags & _VEHICLE) != 0) != ((flags & _EARTH) != 0)
        q = q4.unit(table["q"])
        good = one & heading.known & table.frames.t_valid & np.isfinite(q).all(axis=1)
        key = table.frames.sender.astype(np.int64) << 32 | flags << 8
        key |= table["gimbal_device_id"].astype(np.int64)
        for each in np.unique(key[good]).tolist():
            which = each >> 32, each & 0xFF, each >> 8 & 0xFFFFFF
            if which in self._gimbals or len(self._gimbals) < MAX_STREAMS:
                rows = np.flatnonzero(good & (key == each))
                angles = np.asarray(heading.values, np.float64)[rows]
                self._add(self._gimbals.setdefault(which, _Gimbal()), table, rows, q[rows], angles)

    def _add(
        self,
        gimbal: _Gimbal,
        table: Table,
        rows: npt.NDArray[np.int64],
        q: Floats,
        heading: Floats,
    ) -> None:
        gimbal.rows += len(rows)
        gimbal.first = gimbal.first or table.frames.place(int(rows[0]))
        gimbal.last = table.frames.place(int(rows[-1]))
        gimbal.add(table.frames.t_us[rows], q4.euler_from_quaternion(q)[:, 2], heading)

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every gimbal that moves as in the other frame."""
        for (sender, _, flags), gimbal in sorted(self._gimbals.items()):
            frame, locked = flags & (_VEHICLE | _EARTH), bool(flags & _LOCK)
            right, wrong = _TURNS[frame, locked], _TURNS[_VEHICLE + _EARTH - frame, locked]
            fits = gimbal.left(wrong) < self.params["max_left"] < gimbal.left(right) / 3
            if not (self._turned(gimbal) and fits) or gimbal.first is None or gimbal.last is None:
                continue
            values: dict[str, Scalar] = {
                "said": "the vehicle" if frame == _VEHICLE else "north",
                "meant": "north" if frame == _VEHICLE else "the vehicle",
                "locked": locked,
                "turned_deg": round(float(np.degrees(gimbal.turned)), 3),
                "slope": round(gimbal.slope, 6),
                "expected_slope": right,
            }
            whom = Subject(sender >> 8, sender & 0xFF, MESSAGE, "q")
            yield Observation(whom, gimbal.first, gimbal.last, gimbal.rows, values)

    def _turned(self, gimbal: _Gimbal) -> bool:
        return bool(np.degrees(gimbal.turned) >= self.params["min_turned_deg"])

    def verdict(self) -> Verdict:
        """Return the reports of gimbals whose vehicle turned enough to tell."""
        mine = [g for (sender, *_), g in self._gimbals.items() if self.concerns_sender(sender)]
        told = sum(gimbal.rows for gimbal in mine if self._turned(gimbal))
        if mine and not told:
            return Verdict(0, "the vehicle hardly turns")
        return Verdict(told)
