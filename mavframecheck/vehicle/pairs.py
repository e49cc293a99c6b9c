"""Local and global positions of the same moment: together they say where the local origin lies.

A local frame of an autopilot is a projection on a sphere: PX4 takes a radius of 6 371 000 m, ArduPilot one
of 6 378 100 m. `RADIUS_M` lies between them, and `SHARE` of the distance allows for either, for the
ellipsoid, and for what the projections do differently.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mavframecheck.geo.rotations import wrapped_deg
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
THINNED_MS = 200
"""Of positions that come faster only the first in each such stretch of the vehicle's clock is paired."""
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
    east = np.radians(wrapped_deg(lon - lon0)) * _cosine((lat + lat0) / 2)
    return np.radians(lat - lat0) * RADIUS_M, east * RADIUS_M


def moved(lat: Floats, lon: Floats, north: Floats, east: Floats) -> tuple[Floats, Floats]:
    """Return (n,) latitude and longitude, deg, after going `north` and `east`, m: undoes `metres`."""
    there = lat + np.degrees(north / RADIUS_M)
    turned = lon + np.degrees(east / (RADIUS_M * _cosine((lat + there) / 2)))
    return there, wrapped_deg(turned)


def _cosine(lat: Floats) -> Floats:
    return np.maximum(np.cos(np.radians(lat)), 1e-3)


class Pairing:
    """Puts the positions of one vehicle together to pairs, batch by batch."""

    def __init__(self) -> None:
        """Start with no position seen."""
        self._local = np.zeros(0, _LOCAL)
        self._global = np.zeros(0, _GLOBAL)
        """The last row of each that was kept."""
        self._thin_local, self._thin_global = _Thinning(), _Thinning()

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
        locals_ = np.concatenate((self._local, _local_rows(local, self._thin_local)))
        globals_ = np.concatenate((self._global, _global_rows(globe, self._thin_global)))
        self._local, self._global = locals_[-1:], globals_[-1:]
        if not (len(locals_) and len(globals_)):
            return np.zeros(0, PAIR)
        one, other = _neighbours(locals_["number"], globals_["number"])
        number = np.maximum(locals_["number"][one], globals_["number"][other])
        apart_ms = np.abs(locals_["t_ms"][one] - globals_["t_ms"][other])
        kept = np.flatnonzero((number > known) & (apart_ms <= APART_MS))
        kept = kept[np.argsort(number[kept], kind="stable")]
        return _pairs(locals_.take(one[kept]), globals_.take(other[kept]))

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


def _neighbours(one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """Return the places of each frame of either stream, and of the last one of the other before it."""
    before_one = np.searchsorted(other, one) - 1
    before_other = np.searchsorted(one, other) - 1
    first = np.concatenate((np.arange(len(one)), before_other))
    second = np.concatenate((before_one, np.arange(len(other))))
    both = np.flatnonzero((first >= 0) & (second >= 0))
    return first[both], second[both]


class _Thinning:
    """Keeps the first row of each stretch of `THINNED_MS` of one stream, batch by batch."""

    def __init__(self) -> None:
        self._last = -1

    def of(self, table: Table, sound: npt.NDArray[np.bool_]) -> Table:
        """Return the rows to keep of those that are `sound`."""
        rows = np.flatnonzero(sound)
        stretch = table["time_boot_ms"][rows].astype(np.int64) // THINNED_MS
        kept = table.take(rows[np.diff(stretch, prepend=self._last) != 0])
        self._last = int(stretch[-1]) if len(stretch) else self._last
        return kept


def _local_rows(table: Table | None, thinning: _Thinning) -> Rows:
    if table is None:
        return np.zeros(0, _LOCAL)
    names = ("x", "y", "z", "vx", "vy", "vz")
    kept = thinning.of(table, np.isfinite(sum(table[name] for name in names)))
    rows = _seen(kept, _LOCAL)
    for name in names:
        rows[name] = kept[name]
    return rows


def _global_rows(table: Table | None, thinning: _Thinning) -> Rows:
    if table is None:
        return np.zeros(0, _GLOBAL)
    kept = thinning.of(table, (table["lat"] != 0) | (table["lon"] != 0))
    rows = _seen(kept, _GLOBAL)
    rows["lat"], rows["lon"], rows["alt"] = kept["lat"] / 1e7, kept["lon"] / 1e7, kept["alt"] / 1e3
    return rows


def _pairs(local: Rows, globe: Rows) -> Rows:
    """Return (n,) pairs of rows, which are no further apart than `APART_MS`."""
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
    pairs["slack"] = NEAR_M + ACCELERATION / 2 * dt**2
    return pairs
