"""Positions that stand still, to the last digit, while the vehicle goes on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Verdict
from mavframecheck.checks.estimates import Found, PoseCheck, xyz
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.model import Scalar
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.wire import Place, Table

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

FIXES = ("GPS_RAW_INT", "GPS2_RAW", "GPS_INPUT", "HIL_GPS")
"""Positions of a receiver."""
_HORIZONTAL_IGNORED = constant("GPS_INPUT_IGNORE_FLAGS.VEL_HORIZ")
_UNKNOWN_SPEED = 65535


@dataclass(slots=True)
class _Standing(Found):
    """The last position of a stream, and where the vehicle was when it was first sent."""

    pose: Floats | None = None
    begun: Place | None = None
    since: int = 0
    """Rows with this position so far."""
    lat: float = np.nan
    lon: float = np.nan
    since_us: int = 0
    last_us: int = 0
    """Receive times of the first and the last row with this position."""
    heard_at: tuple[float, float] = (np.nan, np.nan)
    """Where the vehicle was when the stream was first heard, deg."""
    went_m: float = 0.0
    """How far it was away from there since."""
    way_m: float = 0.0
    """How far the vehicle went meanwhile, by the speed beside the position."""
    image: int = 0
    """Number of the first image with this position."""


def _first_known(carried: float, values: Floats, start: Ints) -> Floats:
    """Return (n,) the first value that is known from row `start` on; `carried` where that is negative."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return np.where(start < 0, carried, np.nan)
    at = known[np.minimum(np.searchsorted(known, np.maximum(start, 0)), len(known) - 1)]
    inside = (at >= start) & (at <= np.arange(len(values)))
    found = np.where(inside, values[at], np.nan)
    return np.where((start < 0) & np.isfinite(carried), carried, found)


class FrozenPose(PoseCheck[_Standing]):
    """Positions that stay the same to the last digit while the vehicle goes somewhere else."""

    def begin(self) -> _Standing:
        """Return the state of a new stream."""
        return _Standing()

    def follow(self, found: _Standing, table: Table, context: Context) -> None:
        """Judge every row by how long its position stood, and where the vehicle was at the beginning."""
        table = table.take(self.counts(table))
        if not len(table):
            return
        pose = self.place_in(table)
        before = pose[:1] + 1 if found.pose is None else found.pose[np.newaxis]
        fresh = np.any(pose != np.concatenate((before, pose[:-1])), axis=1)
        rows = np.arange(len(table))
        start = np.maximum.accumulate(np.where(fresh, rows, -1))
        count = rows - start + np.where(start < 0, found.since, 1)
        away = self.went(found, table, start, context)
        moved = (count >= self.params["min_rows"]) & (away >= self.params["min_moved_m"])
        self._note(found, table, np.flatnonzero(moved), start, count, away)
        found.pose, found.since = pose[-1], int(count[-1])
        if start[-1] >= 0:
            found.begun = table.frames.place(int(start[-1]))

    def counts(self, table: Table) -> Bools:
        """Return (n,) the rows that hold a position."""
        return np.ones(len(table), np.bool_)

    def place_in(self, table: Table) -> Floats:
        """Return (n, k) the position, to be compared digit by digit."""
        return xyz(table)

    def went(self, found: _Standing, table: Table, start: Ints, context: Context) -> Floats:
        """Return (n,) how far the vehicle is from where it was when the position was first sent, m."""
        lat, lon = (
            context.lookup(name, table, late=False).values
            for name in ("vehicle.lat", "vehicle.lon")
        )
        lat0 = _first_known(found.lat, lat, start)
        lon0 = _first_known(found.lon, lon, start)
        found.lat, found.lon = float(lat0[-1]), float(lon0[-1])
        _travel(found, lat, lon)
        away: Floats = distance_m(lat0, lon0, lat, lon)
        return away

    def verdict(self) -> Verdict:
        """Return the rows of streams during which the vehicle went far enough."""
        heard = [f for key, f in self._streams.items() if self.concerns_sender(key.sender)]
        rows = sum(f.rows for f in heard if f.went_m >= self.params["min_moved_m"])
        return Verdict(rows, "the vehicle hardly moves" if heard and not rows else "")

    def _note(
        self, found: _Standing, table: Table, hits: Ints, start: Ints, count: Ints, away: Floats
    ) -> None:
        if not len(hits):
            return
        if found.first is None:
            began = int(start[hits[0]])
            found.first = found.begun if began < 0 else table.frames.place(began)
        found.hit(table, hits)
        found.values = {
            **self.words(table, int(hits[0])),
            **found.values,
            "moved_m": max(float(found.values.get("moved_m") or 0.0), float(away[hits].max())),
            "rows": max(int(found.values.get("rows") or 0), int(count[hits].max())),
        }

    def words(self, table: Table, row: int) -> dict[str, Scalar]:
        """Return the position that stands, for the texts of the rule."""
        return {name: float(table[name][row]) for name in ("x", "y", "z")}


def _travel(found: _Standing, lat: Floats, lon: Floats) -> None:
    """Note how far the vehicle is from where it was when the stream was first heard."""
    known = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon))
    if not len(known):
        return
    if not np.isfinite(found.heard_at[0]):
        found.heard_at = float(lat[known[0]]), float(lon[known[0]])
    away = distance_m(*found.heard_at, lat[known], lon[known])
    found.went_m = max(found.went_m, float(away.max()))


class FrozenFix(FrozenPose):
    """Fixes of a receiver that stay the same to the last digit while it says that it moves."""

    messages = FIXES
    autopilots = True

    def counts(self, table: Table) -> Bools:
        """Return (n,) the rows with a fix and a time."""
        placed = (table["lat"] != 0) | (table["lon"] != 0)
        return np.asarray((table["fix_type"] >= 3) & placed & table.frames.t_valid)

    def place_in(self, table: Table) -> Floats:
        """Return (n, 2) latitude and longitude."""
        return np.column_stack([table[name].astype(np.float64) for name in ("lat", "lon")])

    def went(self, found: _Standing, table: Table, start: Ints, _context: Context) -> Floats:
        """Return (n,) how far the vehicle went by the fix itself, since an estimate may be what drifts away.

        Nothing yet where the position stands briefly.
        """
        t_us, speed = table.frames.t_us, _speed(table)
        before = np.concatenate(([found.last_us or t_us[0]], t_us[:-1]))
        dt = np.clip((t_us - before) * 1e-6, 0.0, self.params["longest_s"])
        path = np.cumsum(np.where(speed >= self.params["min_speed_mps"], speed * dt, 0.0))
        way = path - np.where(start < 0, -found.way_m, path[np.maximum(start, 0)])
        since = np.where(start < 0, found.since_us, t_us[np.maximum(start, 0)])
        found.way_m, found.since_us, found.last_us = float(way[-1]), int(since[-1]), int(t_us[-1])
        lasts = t_us - since >= self.params["min_s"] * 1e6
        return np.where(lasts, np.round(way, 3), 0.0)

    def verdict(self) -> Verdict:
        """Return the fixes followed."""
        return PoseCheck.verdict(self)

    def words(self, table: Table, row: int) -> dict[str, Scalar]:
        """Return the fix that stands."""
        return {"lat": float(table["lat"][row] * 1e-7), "lon": float(table["lon"][row] * 1e-7)}


class FrozenImages(FrozenPose):
    """Images of a camera that were all taken at one place, to the last digit, while the vehicle goes somewhere else."""

    messages = ("CAMERA_IMAGE_CAPTURED",)
    autopilots = True

    def counts(self, table: Table) -> Bools:
        """Return (n,) the images with a place."""
        return np.asarray((table["lat"] != 0) | (table["lon"] != 0))

    def place_in(self, table: Table) -> Floats:
        """Return (n, 2) latitude and longitude."""
        return np.column_stack([table[name].astype(np.float64) for name in ("lat", "lon")])

    def went(self, found: _Standing, table: Table, start: Ints, context: Context) -> Floats:
        """Return (n,) how far the vehicle went since the first image of a place.

        Nothing yet where there are few images since: a camera may be asked for one of them again.
        """
        away = super().went(found, table, start, context)
        image = table["image_index"].astype(np.int64)
        first = np.where(start < 0, found.image, image[np.maximum(start, 0)])
        found.image = int(first[-1])
        return np.where(image - first >= self.params["min_images"] - 1, away, 0.0)

    def words(self, table: Table, row: int) -> dict[str, Scalar]:
        """Return the place that stands."""
        return {"lat": float(table["lat"][row] * 1e-7), "lon": float(table["lon"][row] * 1e-7)}


def _speed(table: Table) -> Floats:
    """Return (n,) the horizontal speed that a fix says, m/s; NaN where it says none."""
    if table.name == "GPS_INPUT":
        given = table["ignore_flags"] & _HORIZONTAL_IGNORED == 0
        speed = np.hypot(table["vn"].astype(np.float64), table["ve"])
        return np.where(given & np.isfinite(speed), speed, np.nan)
    vel = table["vel"].astype(np.float64)
    return np.where(vel == _UNKNOWN_SPEED, np.nan, vel * 1e-2)
