"""The geoid: how far mean sea level lies above the WGS 84 ellipsoid."""

from __future__ import annotations

import zlib
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

DATA = Path(__file__).parent / "data" / "egm96.bin"
STEPS = 4
"""Grid points in a degree, along both axes."""
ROWS, COLUMNS = 180 * STEPS + 1, 360 * STEPS
"""Rows from 90 S to 90 N, both included; columns from 180 W eastwards, 180 E being 180 W again."""


def undulation(lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike) -> Floats:
    """Return the height of the EGM96 geoid above the WGS 84 ellipsoid, m: ellipsoid height = MSL + it.

    Arguments are degrees, of any shapes that broadcast to one another: the shape of the result. Any
    longitude will do, 190 being 170 W. NaN where the latitude is no latitude or either is not finite.
    Bilinear between points a quarter of a degree apart, stored to the centimetre: against a grid
    three times as fine the root mean square is 0.04 m, the worst 1.0 m (in steep mountains).
    Source: see `data/README.md`. The first call reads 0.7 MB.
    """
    lat, lon = np.broadcast_arrays(np.asarray(lat_deg, float), np.asarray(lon_deg, float))
    known = (np.abs(lat) <= 90) & np.isfinite(lon)
    y = (np.where(known, lat, 0.0) + 90) * STEPS
    turns = np.where(known, lon, 0.0) / 360 + 0.5
    x = (turns - np.floor(turns)) * COLUMNS
    row = np.minimum(y.astype(np.intp), ROWS - 2)
    column = np.minimum(x.astype(np.intp), COLUMNS - 1)
    return np.where(known, _between(row, column, y - row, x - column), np.nan)


def _between(
    row: npt.NDArray[np.intp], column: npt.NDArray[np.intp], y: Floats, x: Floats
) -> Floats:
    """Return metres at the fractions `y`, `x` (0 to 1) of the cells whose south-west corners are given."""
    grid = _closed_grid()
    width = grid.shape[1]
    points, corner = grid.reshape(-1), row * width + column
    south = points.take(corner) * (1 - x) + points.take(corner + 1) * x
    north = points.take(corner + width) * (1 - x) + points.take(corner + width + 1) * x
    metres: Floats = (south * (1 - y) + north * y) / 100
    return metres


@cache
def _closed_grid() -> npt.NDArray[np.int16]:
    """Return the grid with its westernmost column once more at the end: every cell has four corners."""
    heights = _grid()
    return np.concatenate((heights, heights[:, :1]), axis=1)


def _grid() -> npt.NDArray[np.int16]:
    """Return (ROWS, COLUMNS) cm, southernmost row first, westernmost column first."""
    deltas = np.frombuffer(zlib.decompress(DATA.read_bytes()), "<i2").reshape(ROWS, COLUMNS)
    along = np.cumsum(deltas, axis=1, dtype=np.int16)
    return np.cumsum(along, axis=0, dtype=np.int16)
