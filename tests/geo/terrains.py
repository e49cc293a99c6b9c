"""Small terrain models, written for tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj
import pytest

Floats = npt.NDArray[np.float64]
Shape = Callable[[Floats, Floats], Floats]
"""Height, m, of coordinates of the model."""

HOME = (47.397742, 8.545594)
DEGREES = (8.5, 47.43, 0.0005)
"""West, north and pixel of a model around home, degrees."""


def written(
    path: Path,
    shape: Shape,
    *,
    crs: Any = "EPSG:4326",
    grid: tuple[float, float, float] = DEGREES,
    size: tuple[int, int] = (140, 180),
    dtype: str = "float64",
    **profile: Any,
) -> str:
    """Write what `shape` is at the centres of `size` (rows, columns) pixels; return the path.

    `grid` is west, north and the side of a pixel, in units of `crs`.
    """
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed (the extra dem)")
    west, north, pixel = grid
    x = west + (np.arange(size[1]) + 0.5) * pixel
    y = north - (np.arange(size[0]) + 0.5) * pixel
    values = shape(*np.meshgrid(x, y)).astype(dtype)
    place = rasterio.Affine(pixel, 0, west, 0, -pixel, north)
    options = {"driver": "GTiff", "count": 1, "dtype": dtype, "crs": crs, "transform": place}
    with rasterio.open(path, "w", height=size[0], width=size[1], **options | profile) as file:
        for band in range(1, file.count + 1):
            file.write(values, band)
    return str(path)


def plane(x: Floats, y: Floats) -> Floats:
    """Return a slope: 500 m at home, 1000 m more a degree to the north, 400 m less a degree to the east."""
    return 500 + 1000 * (y - HOME[0]) - 400 * (x - HOME[1])


def places(count: int = 500, seed: int = 1) -> tuple[Floats, Floats]:
    """Return latitudes and longitudes within a kilometre or two of home."""
    random = np.random.default_rng(seed)
    return HOME[0] + random.uniform(-0.015, 0.015, count), HOME[1] + random.uniform(
        -0.03, 0.03, count
    )


def projected(crs: str, lat: Floats, lon: Floats) -> tuple[Floats, Floats]:
    """Return x and y of places, by PROJ."""
    x, y = pyproj.Transformer.from_crs(4326, crs, always_xy=True).transform(lon, lat)
    return np.asarray(x), np.asarray(y)
