"""The ground: how high it lies at places, from a terrain model in a GeoTIFF (rasterio, an optional package)."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, Protocol

import numpy as np
import numpy.typing as npt

from mavframecheck.geo.geodesy import distance_m
from mavframecheck.geo.geoid import undulation

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

TILE = 512
"""Pixels along the side of the squares that are read: a model of any size fits into memory."""
LARGEST_BLOCK = 2**26
"""Pixels that a file may store as one piece: a piece is unpacked as a whole."""
LOWEST_M, HIGHEST_M = -12_000.0, 9_000.0
"""No ground lies outside of this; what does is a void that the file does not mark."""
VOID_M = -9999.0
"""What marks voids in many files that do not say so."""
_LATLON = "EPSG:4326"
_VERTICAL = re.compile(r'\bVERT(?:CRS|_CS)\["([^"]+)"(.*)', re.DOTALL)
_UNIT = re.compile(r'UNIT\["[^"]*",\s*([0-9.eE+-]+)')
_ELLIPSOIDAL = re.compile(r"CS\[ellipsoidal,\s*3\]")
_DOWN = re.compile(r'AXIS\["[^"]*",\s*down\b', re.IGNORECASE)
_UNITS = {
    **dict.fromkeys(("", "m", "metre", "meter", "metres", "meters"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet", "international foot"), 0.3048),
    **dict.fromkeys(("ftus", "us-ft", "us survey foot"), 1200 / 3937),
    **dict.fromkeys(("cm", "centimetre", "centimeter"), 0.01),
}
"""What a band may say of its unit, in lower case, and how many metres it is."""


class TerrainError(Exception):
    """A terrain model that cannot be used; the message says what to do."""


class Ground(Protocol):
    """What knows how high the ground lies."""

    @property
    def step_m(self) -> float:
        """How far apart the known points are, m."""

    def heights(self, lat: Floats, lon: Floats) -> Floats:
        """Return (n,) m above mean sea level at (n,) degrees; NaN where it is not known."""


class Level(NamedTuple):
    """Ground of one height everywhere."""

    height_m: float
    """m above mean sea level."""
    step_m: float = 100.0

    def heights(self, lat: Floats, lon: Floats) -> Floats:
        """Return the same height for all places."""
        return np.where(np.isfinite(lat + lon), self.height_m, np.nan)


class Datum(NamedTuple):
    """What the heights of a terrain model are above."""

    metres: float
    """Metres of one unit."""
    ellipsoidal: bool
    words: str
    """Ends the sentence "its heights are..."."""


class Terrain:
    """A terrain model in a GeoTIFF, in any coordinate reference system that PROJ knows.

    Only the squares are read in which somebody asks for a height.
    """

    def __init__(self, path: str) -> None:
        """Open the file; TerrainError where it is no terrain model, or rasterio is not there."""
        self._rasterio = _rasterio()
        self.name = Path(path).name
        if not Path(path).is_file():  # GDAL takes names of other things, such as addresses
            self._fail("there is no such file")
        with self._answering(
            "no GeoTIFF that can be read: gdal_translate makes one of other formats"
        ):
            # The driver is named, as others may fetch what a file names.
            self._file = self._rasterio.open(path, driver="GTiff")
        with self._answering("what it says of itself makes no sense: the file is damaged"):
            self._refuse_what_is_none()
            self._to_pixel = ~self._file.transform
            self._west, self._south, self._east, self._north = self._bounds()
            wkt = str(self._file.crs.to_wkt(version="WKT2_2019"))
            self.datum = datum(wkt, self._file.units[0] or "", self.name)
            self.step_m = self._step_m()

    @property
    def note(self) -> str:
        """Say what the model is, for a reader of the report."""
        return (
            f"terrain model {self.name}: a point every {self.step_m:.3g} m; "
            f"its heights are {self.datum.words}"
        )

    def heights(self, lat: Floats, lon: Floats) -> Floats:
        """Return (n,) m above mean sea level at (n,) degrees, bilinear between the centres of pixels.

        NaN outside of the model, where a neighbouring pixel is a void, and where no place is.
        """
        found = np.full(len(lat), np.nan)
        rows = np.flatnonzero(self._inside(lat, lon))
        if len(rows):
            column, row = self._pixels(lat[rows], lon[rows])
            found[rows] = self._between(row, column) * self.datum.metres
        return found - undulation(lat, lon) if self.datum.ellipsoidal else found

    @contextmanager
    def _answering(self, problem: str) -> Iterator[None]:
        """Say `problem` of the file where rasterio raises anything: its errors have no common base."""
        try:
            with warnings.catch_warnings(action="ignore"):  # what matters of them is an error here
                yield
        except TerrainError:
            raise
        except Exception as error:
            raise TerrainError(f"terrain model {self.name}: {problem}") from error

    def _refuse_what_is_none(self) -> None:
        """Raise TerrainError where the file cannot be heights of places on Earth."""
        file = self._file
        if file.count != 1:
            self._fail(
                f"{file.count} bands where one with heights belongs: gdal_translate -b 1 takes out the first"
            )
        if file.dtypes[0].startswith("complex"):
            self._fail("complex numbers where heights belong")
        if file.crs is None:
            self._fail(
                "it does not say its coordinate reference system: gdal_edit.py -a_srs EPSG:... adds it"
            )
        if file.transform.is_identity or not file.transform.determinant:
            self._fail("it does not say where on Earth its pixels lie")
        high, wide = file.block_shapes[0]
        if high * wide > LARGEST_BLOCK:
            self._fail(
                f"it is stored in pieces of {wide} x {high} pixels, too large to unpack: "
                "gdal_translate -co TILED=YES writes it in small ones"
            )

    def _fail(self, problem: str) -> NoReturn:
        raise TerrainError(f"terrain model {self.name}: {problem}")

    def _bounds(self) -> tuple[float, float, float, float]:
        """Return west, south, east and north, degrees; east is more than west, perhaps beyond 180."""
        file = self._file
        x, y = _moved(
            file.transform,
            np.array([0.0, file.width, 0, file.width]),
            np.array([0.0, 0, file.height, file.height]),
        )
        corners = (float(x.min()), float(y.min()), float(x.max()), float(y.max()))
        self._left = corners[0]
        with self._answering("its coordinate reference system is none of places on Earth"):
            west, south, east, north = self._rasterio.warp.transform_bounds(
                file.crs, _LATLON, *corners
            )
        return west, south, east + 360 * (east <= west), north

    def _inside(self, lat: Floats, lon: Floats) -> npt.NDArray[np.bool_]:
        """Return (n,) places inside the bounds: PROJ refuses all where one is far outside."""
        east = np.mod(lon - self._west, 360) <= self._east - self._west
        return np.asarray((lat >= self._south) & (lat <= self._north) & east)

    def _pixels(self, lat: Floats, lon: Floats) -> tuple[Floats, Floats]:
        """Return (n,) columns and rows; the centre of the first pixel is 0.5, 0.5."""
        with self._answering("its coordinate reference system does not hold where its pixels are"):
            x, y = self._rasterio.warp.transform(_LATLON, self._file.crs, lon, lat)
        if self._file.crs.is_geographic:  # one place has many longitudes
            x = self._left + np.mod(np.asarray(x) - self._left, 360)
        return _moved(self._to_pixel, np.asarray(x, float), np.asarray(y, float))

    def _step_m(self) -> float:
        """Return the distance of neighbouring pixels in the middle of the model, m."""
        column, row = self._file.width / 2, self._file.height / 2
        x, y = _moved(
            self._file.transform,
            np.array([column, column + 1, column]),
            np.array([row, row, row + 1]),
        )
        lon, lat = map(np.asarray, self._rasterio.warp.transform(self._file.crs, _LATLON, x, y))
        step_m = float(distance_m(lat[:1], lon[:1], lat[1:], lon[1:]).min())
        if not step_m > 0:
            self._fail("its pixels have no size")
        return step_m

    def _between(self, row: Floats, column: Floats) -> Floats:
        """Return (n,) values between the centres of the pixels around, in units of the band."""
        high, wide = self._file.height, self._file.width
        outside = (row < 0) | (row > high) | (column < 0) | (column > wide)
        y, x = np.clip(row - 0.5, 0, high - 1), np.clip(column - 0.5, 0, wide - 1)
        y, x = np.where(outside, 0, np.nan_to_num(y)), np.where(outside, 0, np.nan_to_num(x))
        tile = (y // TILE).astype(np.int64) * (wide // TILE + 1) + (x // TILE).astype(np.int64)
        order = np.argsort(tile, kind="stable")
        values = np.empty(len(y))
        for part in np.split(order, np.flatnonzero(np.diff(tile[order])) + 1):
            values[part] = self._in_tile(y[part], x[part])
        return np.where(outside, np.nan, values)

    def _in_tile(self, y: Floats, x: Floats) -> Floats:
        """Return (n,) values at rows and columns, centres being whole, that all lie in one tile."""
        top, left = int(y[0] // TILE) * TILE, int(x[0] // TILE) * TILE
        grid = self._read(top, left)
        south, east = np.floor(y - top).astype(np.int64), np.floor(x - left).astype(np.int64)
        down, right = y - top - south, x - left - east
        below = np.minimum(south + 1, grid.shape[0] - 1)
        beside = np.minimum(east + 1, grid.shape[1] - 1)
        upper = _mixed(grid[south, east], grid[south, beside], right)
        lower = _mixed(grid[below, east], grid[below, beside], right)
        return _mixed(upper, lower, down)

    def _read(self, top: int, left: int) -> Floats:
        """Return a tile and a pixel more on its far sides, NaN where there is no height."""
        high = min(TILE + 1, self._file.height - top)
        wide = min(TILE + 1, self._file.width - left)
        window = self._rasterio.windows.Window(left, top, wide, high)
        with self._answering("its pixels cannot be read: the file is damaged or cut off"):
            band = self._file.read(1, window=window, masked=True)
        raw = band.astype(float).filled(np.nan)
        void = (raw == VOID_M) & (self._file.scales[0] == 1)
        values = np.where(void, np.nan, raw * self._file.scales[0] + self._file.offsets[0])
        metres = values * self.datum.metres
        known = (metres > LOWEST_M) & (metres < HIGHEST_M)
        return np.where(known, values, np.nan)


def _moved(affine: Any, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return (n,) coordinates through an affine transformation; its own product has other ways every year."""
    return affine.a * x + affine.b * y + affine.c, affine.d * x + affine.e * y + affine.f


def _mixed(one: Floats, other: Floats, share: Floats) -> Floats:
    """Return what lies at `share` of the way; a void does not count where its share is nothing."""
    first = np.where(share == 1, 0.0, one * (1 - share))
    second = np.where(share == 0, 0.0, other * share)
    return np.asarray(first + second)


def datum(wkt: str, band_unit: str, name: str) -> Datum:
    """Return what heights are above, by the reference system (WKT 2) of a file, else by its band.

    Any level of the sea counts as mean sea level: they differ by a metre or two. A system that says
    nothing of heights leaves it open; then mean sea level is assumed, as in nearly every model.
    """
    vertical = _VERTICAL.search(wkt)
    if vertical is None:
        metres = _UNITS.get(band_unit.strip().lower())
        if metres is None:
            raise TerrainError(
                f"terrain model {name}: the unit of its heights is {band_unit[:40]!r}, which is not known here"
            )
        if _ELLIPSOIDAL.search(wkt):
            return Datum(metres, True, "above the ellipsoid, and converted by EGM96")
        return Datum(
            metres, False, "taken as above mean sea level: it does not say what they are above"
        )
    called, rest = vertical[1], vertical[2]
    if _DOWN.search(rest):
        raise TerrainError(f"terrain model {name}: {called} counts downwards: it holds depths")
    unit = _UNIT.search(rest)
    metres = float(unit[1]) if unit else 1.0
    if "ellips" in called.lower():
        return Datum(metres, True, f"above the ellipsoid ({called}), and converted by EGM96")
    return Datum(metres, False, f"above mean sea level ({called})")


def _rasterio() -> Any:
    """Return rasterio with all of it that is used; TerrainError where it is not installed."""
    try:
        import rasterio
        import rasterio.errors
        import rasterio.warp
        import rasterio.windows
    except ImportError as error:
        raise TerrainError(
            "a terrain model needs the package rasterio: pip install 'mavframecheck[dem]'"
        ) from error
    return rasterio
