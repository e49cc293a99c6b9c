"""Universal Transverse Mercator: 60 strips of the Earth laid flat, north and south of the equator.

Easting and northing are metres on the map, not on the ground: their scale is 0.9996 in the middle of
a zone. Two numbers without zone and hemisphere are no place. The projection itself is PROJ's, which
comes with ``pip install 'mavframecheck[utm]'``.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SOUTHERNMOST_DEG, NORTHERNMOST_DEG = -80.0, 84.0
"""UTM ends here; the poles have a projection of their own."""
_NORTHERN, _SOUTHERN = 32600, 32700
"""EPSG codes of WGS 84 / UTM, less the zone."""


def zone(lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike) -> Ints:
    """Return the UTM zone of places, 1 to 60; 0 beyond 80 S and 84 N, and where nothing is known.

    Six degrees each from 180 W, but for south-west Norway (32 reaches to 3 E) and Svalbard (31, 33, 35
    and 37 only). A place at 84 N belongs to the zone below it.
    """
    lat, lon = np.broadcast_arrays(np.asarray(lat_deg, float), np.asarray(lon_deg, float))
    inside = (lat >= SOUTHERNMOST_DEG) & (lat <= NORTHERNMOST_DEG) & np.isfinite(lon)
    east = np.mod(np.where(inside, lon, 0.0) + 180, 360) - 180
    number = np.minimum((east + 180) // 6 + 1, 60).astype(np.int64)
    number = np.where((lat >= 56) & (lat < 64) & (east >= 3) & (east < 12), 32, number)
    svalbard = 31 + 2 * np.searchsorted([9.0, 21.0, 33.0], east, side="right")
    number = np.where((lat >= 72) & (east >= 0) & (east < 42), svalbard, number)
    return np.where(inside, number, 0)


def utm_from_geodetic(
    lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike, zone: int, *, north: bool
) -> Floats:
    """Return (..., 2) m: easting and northing in one zone and hemisphere. Source: PROJ."""
    x, y = _transformer(zone, north).transform(*_columns(lon_deg, lat_deg))
    return _finite(x, y)


def geodetic_from_utm(
    easting_m: npt.ArrayLike, northing_m: npt.ArrayLike, zone: int, *, north: bool
) -> Floats:
    """Return (..., 2) latitude and longitude, degrees: undoes `utm_from_geodetic`."""
    columns = _columns(easting_m, northing_m)
    lon, lat = _transformer(zone, north).transform(*columns, direction="INVERSE")
    return _finite(lat, lon)


def _columns(first: npt.ArrayLike, second: npt.ArrayLike) -> list[Floats]:
    return [np.array(each, float) for each in np.broadcast_arrays(first, second)]


def _finite(*columns: npt.ArrayLike) -> Floats:
    """Return the columns side by side; PROJ says infinity for what it cannot do."""
    stacked = np.stack([np.asarray(column, float) for column in columns], axis=-1)
    return np.where(np.isfinite(stacked), stacked, np.nan)


@cache
def _transformer(zone: int, north: bool) -> Any:
    """Return PROJ's transformation from longitude and latitude on WGS 84 to a zone of UTM."""
    if not 1 <= zone <= 60:
        raise ValueError(f"UTM has zones 1 to 60, not {zone}")
    try:
        from pyproj import Transformer
    except ImportError as error:
        raise ModuleNotFoundError(
            "UTM needs the package pyproj: pip install 'mavframecheck[utm]'", name="pyproj"
        ) from error
    return Transformer.from_crs(4326, (_NORTHERN if north else _SOUTHERN) + zone, always_xy=True)
