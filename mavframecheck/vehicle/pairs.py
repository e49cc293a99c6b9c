"""Local and global positions of the same moment: together they say where the local origin lies.

A local frame of an autopilot is a projection on a sphere: PX4 takes a radius of 6 371 000 m, ArduPilot one
of 6 378 100 m. `RADIUS_M` lies between them, and `SHARE` of the distance allows for either, for the
ellipsoid, and for what the projections do differently.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mavframecheck.wire import Table

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Rows = npt.NDArray[np.void]

RADIUS_M = 6_374_550.0
SHARE = 0.007
"""Of the distance from the origin: how far an implied origin may be off with nothing wrong."""
NEAR_M = 1.0
"""And this much besides, m: noise, and estimators that shift a little."""
APART_MS = 300
"""Stamps of the two further apart than this make no pair."""
ACCELERATION = 10.0
"""How much a vehicle may accelerate between the two, m/s2."""
_MS = 1e-3

_SEEN = [("number", "i8"), ("t_us", "i8"), ("offset", "i8"), ("size", "i8"), ("t_ms", "i8")]
_LOCAL = np.dtype([*_SEEN, *((name, "f8") for name in ("x", "y", "z", "vx", "vy", "vz"))])
_GLOBAL = np.dtype([*_SEEN, ("lat", "f8"), ("lon", "f8"), ("alt", "f8")])
PAIR = np.dtype(
    [
        *_LOCAL.descr,
        *((name, "f8") for name in ("lat", "lon", "alt", "lat0", "lon0", "alt0", "slack")),
    ]
)
"""A pair: frame that completed it (`t_us` -1: no believable stamp), vehicle clock (ms), local position and
velocity (m, m/s, NED), global position moved to the same moment (deg, m AMSL), the origin that follows
(`lat0`, `lon0` deg, `alt0` m AMSL) and how far that may be off (`slack`, m)."""


def metres(lat: Floats, lon: Floats, lat0: Floats, lon0: Floats) -> tuple[Floats, Floats]:
    """Return (n,) north and east of a position from another, m, as autopilots project: on a sphere, flat."""
    east = np.radians((lon - lon0 + 180) % 360 - 180) * _cosine((lat + lat0) / 2)
    return np.radians(lat - lat0) * RADIUS_M, east * RADIUS_M


def moved(lat: Floats, lon: Floats, north: Floats, east: Floats) -> tuple[Floats, Floats]:
    """Return (n,) latitude and longitude, deg, after going `north` and `east`, m: undoes `metres`."""
    there = lat + np.degrees(north / RADIUS_M)
    turned = lon + np.degrees(east / (RADIUS_M * _cosine((lat + there) / 2)))
    return there, (turned + 180) % 360 - 180


def _cosine(lat: Floats) -> Floats:
    return np.maximum(np.cos(np.radians(lat)), 1e-3)


class Pairing:
    """Puts the positions of one vehicle together to pairs, batch by batch."""

    def __init__(self) -> None:
        """Start with no position seen."""
        self._local = np.zeros(0, _LOCAL)
        self._global = np.zeros(0, _GLOBAL)
        """The last row of each."""

    @property
    def last_global(self) -> Rows:
        """The last global position, 0 or 1 rows."""
        return self._global

    def update(self, local: Table | None, globe: Table | None) -> Rows:
        """Return (n,) the pairs that a batch completes, in frame order."""
        known = max(
            (int(rows["number"][-1]) for rows in (self._local, self._global) if len(rows)),
            default=-1,
        )
        locals_ = np.concatenate((self._local, _local_rows(local)))
        globals_ = np.concatenate((self._global, _global_rows(globe)))
        self._local, self._global = locals_[-1:], globals_[-1:]
        if not (len(locals_) and len(globals_)):
            return np.zeros(0, PAIR)
        before_local = np.searchsorted(globals_["number"], locals_["number"]) - 1
        before_global = np.searchsorted(locals_["number"], globals_["number"]) - 1
        by_local = np.column_stack((np.arange(len(locals_)), before_local))
        by_global = np.column_stack((before_global, np.arange(len(globals_))))
        which = np.concatenate((by_local, by_global))
        which = which[(which >= 0).all(axis=1)]
        pairs = _pairs(locals_[which[:, 0]], globals_[which[:, 1]])
        pairs = pairs[(pairs["number"] > known) & (pairs["slack"] < np.inf)]
        return pairs[np.argsort(pairs["number"], kind="stable")]

    def forget(self) -> None:
        """Forget the last positions: the vehicle was started anew."""
        self._local, self._global = self._local[:0], self._global[:0]


def _seen(table: Table, dtype: np.dtype[np.void]) -> Rows:
    frames = table.frames
    rows = np.zeros(len(table), dtype)
    rows["number"], rows["offset"], rows["size"] = frames.number, frames.offset, frames.size
    rows["t_us"] = np.where(frames.t_valid, frames.t_us, -1)
    rows["t_ms"] = table["time_boot_ms"]
    return rows


def _local_rows(table: Table | None) -> Rows:
    if table is None:
        return np.zeros(0, _LOCAL)
    rows = _seen(table, _LOCAL)
    for name in ("x", "y", "z", "vx", "vy", "vz"):
        rows[name] = table[name]
    sound = np.isfinite(rows["x"] + rows["y"] + rows["z"] + rows["vx"] + rows["vy"] + rows["vz"])
    kept: Rows = rows[sound]
    return kept


def _global_rows(table: Table | None) -> Rows:
    if table is None:
        return np.zeros(0, _GLOBAL)
    rows = _seen(table, _GLOBAL)
    rows["lat"], rows["lon"], rows["alt"] = (
        table["lat"] / 1e7,
        table["lon"] / 1e7,
        table["alt"] / 1e3,
    )
    placed: Rows = rows[(rows["lat"] != 0) | (rows["lon"] != 0)]
    return placed


def _pairs(local: Rows, globe: Rows) -> Rows:
    """Return (n,) pairs of rows; `slack` is infinite where they are too far apart in time."""
    pairs = np.zeros(len(local), PAIR)
    later = local["number"] >= globe["number"]
    for name in ("number", "t_us", "offset", "size"):
        pairs[name] = np.where(later, local[name], globe[name])
    for name in ("t_ms", "x", "y", "z", "vx", "vy", "vz"):
        pairs[name] = local[name]
    dt = (local["t_ms"] - globe["t_ms"]) * _MS
    lat, lon = moved(globe["lat"], globe["lon"], local["vx"] * dt, local["vy"] * dt)
    pairs["lat"], pairs["lon"], pairs["alt"] = lat, lon, globe["alt"] - local["vz"] * dt
    pairs["lat0"], pairs["lon0"] = moved(lat, lon, -local["x"], -local["y"])
    pairs["alt0"] = pairs["alt"] + local["z"]
    slack = NEAR_M + ACCELERATION / 2 * dt**2
    pairs["slack"] = np.where(np.abs(dt) <= APART_MS * _MS, slack, np.inf)
    return pairs
