"""Heights of the ground: against slopes that are known, in other coordinates by PROJ, and files that are none."""

from __future__ import annotations

import logging
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest

from mavframecheck.geo.geoid import undulation
from mavframecheck.geo.terrain import Level, Terrain, TerrainError, datum
from tests.geo.terrains import HOME, Floats, places, plane, projected, written

pytest.importorskip("rasterio", reason="rasterio is not installed (the extra dem)")


def at_home(terrain: Terrain) -> float:
    return float(terrain.heights(*np.array(HOME).reshape(2, 1))[0])


def test_a_slope_is_met_between_pixels(tmp_path: Path) -> None:
    """Bilinear interpolation is exact on a plane."""
    terrain = Terrain(written(tmp_path / "a.tif", plane))
    lat, lon = places()
    np.testing.assert_allclose(terrain.heights(lat, lon), plane(lon, lat), atol=1e-9)


def test_in_utm(tmp_path: Path) -> None:
    """A slope in metres of UTM, asked for in degrees."""

    def slope(x: Floats, y: Floats) -> Floats:
        return 600 + (x - 465_000) / 50 - (y - 5_249_000) / 20

    grid = (462_000.0, 5_253_000.0, 25.0)
    terrain = Terrain(
        written(tmp_path / "a.tif", slope, crs="EPSG:32632", grid=grid, size=(300, 300))
    )
    lat, lon = places()
    expected = slope(*projected("EPSG:32632", lat, lon))
    np.testing.assert_allclose(terrain.heights(lat, lon), expected, atol=1e-5)
    assert terrain.step_m == pytest.approx(25.0, rel=1e-3)


def test_a_model_larger_than_a_tile(tmp_path: Path) -> None:
    """Whatever side of a tile a place is on, from however it is stored."""
    grid = (8.4, 47.5, 0.0002)
    path = written(tmp_path / "a.tif", plane, grid=grid, size=(1100, 1300), tiled=True)
    lat, lon = places(4000)
    np.testing.assert_allclose(Terrain(path).heights(lat, lon), plane(lon, lat), atol=1e-9)


def test_outside_nothing_is_known(tmp_path: Path) -> None:
    terrain = Terrain(written(tmp_path / "a.tif", plane, crs="EPSG:4326"))
    lat = np.array([HOME[0], 10.0, HOME[0], np.nan, 90.0, -90.0, 91.0])
    lon = np.array([HOME[1], HOME[1], -170.0, HOME[1], 8.5, 8.5, 8.55])
    np.testing.assert_array_equal(np.isfinite(terrain.heights(lat, lon)), [True] + 6 * [False])


def test_far_outside_of_a_projection(tmp_path: Path) -> None:
    """PROJ refuses all places where one is beyond what it can do."""
    grid = (462_000.0, 5_253_000.0, 25.0)
    path = written(
        tmp_path / "a.tif", lambda x, _: 0 * x, crs="EPSG:32632", grid=grid, size=(300, 300)
    )
    terrain = Terrain(path)
    heights = terrain.heights(np.array([HOME[0], 0.0, 95.0]), np.array([HOME[1], 99.0, 1e3]))
    np.testing.assert_array_equal(np.isfinite(heights), [True, False, False])


def test_the_edge(tmp_path: Path) -> None:
    """In the outer half of the outer pixels their value holds."""
    path = written(tmp_path / "a.tif", lambda x, _: x, grid=(8.0, 48.0, 1.0), size=(2, 2))
    heights = Terrain(path).heights(np.full(4, 47.0), np.array([8.0, 8.25, 9.0, 9.9]))
    np.testing.assert_allclose(heights, [8.5, 8.5, 9.0, 9.5])


@pytest.mark.parametrize("void", [-32768.0, -9999.0, 20_000.0])
@pytest.mark.parametrize("said", [True, False])
def test_voids(void: float, said: bool, tmp_path: Path) -> None:
    """Voids are not known, nor what is between them and their neighbours; also where nobody marks them."""

    def holed(x: Floats, y: Floats) -> Floats:
        return np.where((np.abs(x - HOME[1]) < 0.001) & (np.abs(y - HOME[0]) < 0.001), void, 500.0)

    path = written(tmp_path / "a.tif", holed, nodata=void if said else None)
    terrain = Terrain(path)
    lon = HOME[1] + np.linspace(-0.01, 0.01, 401)
    heights = terrain.heights(np.full(401, HOME[0]), lon)
    assert np.isnan(heights[200])
    assert set(heights[np.isfinite(heights)].tolist()) == {500.0}
    assert 30 < np.count_nonzero(np.isnan(heights)) < 80


def test_scale_and_offset(tmp_path: Path) -> None:
    rasterio: Any = pytest.importorskip("rasterio")
    path = written(tmp_path / "a.tif", lambda x, _: 0 * x + 4000, dtype="int16")
    with rasterio.open(path, "r+") as file:
        file.scales, file.offsets = (0.1,), (100.0,)
    assert at_home(Terrain(path)) == pytest.approx(500.0)


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 1.0), ("ft", 0.3048), ("US survey foot", 1200 / 3937)]
)
def test_units(unit: str, metres: float, tmp_path: Path) -> None:
    rasterio: Any = pytest.importorskip("rasterio")
    path = written(tmp_path / "a.tif", lambda x, _: 0 * x + 1000)
    with rasterio.open(path, "r+") as file:
        file.units = (unit,)
    assert at_home(Terrain(path)) == pytest.approx(1000 * metres)


def test_any_longitude(tmp_path: Path) -> None:
    """A model across 180 degrees, written beyond it, and asked for on both sides."""
    path = written(tmp_path / "a.tif", lambda x, _: x, grid=(178.0, 2.0, 0.1), size=(40, 40))
    lon = np.array([179.0, 181.0, -179.0, 541.0, -177.0])
    expected = [179.0, 181.0, 181.0, 181.0, np.nan]
    np.testing.assert_allclose(Terrain(path).heights(np.zeros(5), lon), expected)


def test_the_whole_earth(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tif", lambda _, y: y, grid=(-180.0, 90.0, 1.0), size=(180, 360))
    lat, lon = np.array([0.0, 45.0, -60.0]), np.array([-180.0, 8.0, 179.9])
    np.testing.assert_allclose(Terrain(path).heights(lat, lon), lat)


def test_a_turned_model(tmp_path: Path) -> None:
    """Rows need not run from west to east."""
    rasterio: Any = pytest.importorskip("rasterio")
    along, across = 0.0005 * np.cos(np.radians(30)), 0.0005 * np.sin(np.radians(30))
    place = rasterio.Affine(along, across, 8.5, across, -along, 47.4)
    column, row = np.meshgrid(np.arange(200) + 0.5, np.arange(200) + 0.5)
    x = 8.5 + along * column + across * row
    y = 47.4 + across * column - along * row
    path = str(tmp_path / "a.tif")
    options = {"driver": "GTiff", "count": 1, "dtype": "float64", "crs": "EPSG:4326"}
    with rasterio.open(path, "w", height=200, width=200, transform=place, **options) as file:
        file.write(plane(x, y), 1)
    lat, lon = y[50:150:7, 60:140:7].ravel() + 1e-4, x[50:150:7, 60:140:7].ravel() + 1e-4
    np.testing.assert_allclose(Terrain(path).heights(lat, lon), plane(lon, lat), atol=1e-9)


@pytest.mark.parametrize(
    ("crs", "words", "ellipsoidal"),
    [
        ("EPSG:4326", "it does not say what they are above", False),
        ("EPSG:4979", "above the ellipsoid", True),
        ("EPSG:4326+5773", "EGM96 height", False),
        ("EPSG:9518", "EGM2008 height", False),
        ("EPSG:2056+5728", "LN02 height", False),
    ],
)
def test_what_heights_are_above(crs: str, words: str, ellipsoidal: bool, tmp_path: Path) -> None:
    """By the reference system that GDAL reads from the file; the geoid is that of PROJ's oracle, EGM96."""
    grid = (2_682_000.0, 1_251_000.0, 25.0) if "2056" in crs else (8.5, 47.43, 0.0005)
    path = written(
        tmp_path / "a.tif", lambda x, _: 0 * x + 500, crs=crs, grid=grid, size=(300, 300)
    )
    terrain = Terrain(path)
    assert words in terrain.note
    shift = float(undulation(*HOME)) if ellipsoidal else 0.0
    assert at_home(terrain) == pytest.approx(500 - shift, abs=1e-6)


def test_feet_of_the_reference_system() -> None:
    wkt = pyproj.CRS("EPSG:4326+6360").to_wkt()
    found = datum(wkt, "", "a.tif")
    assert found.metres == pytest.approx(1200 / 3937)
    assert "NAVD88" in found.words


def test_depths_are_no_heights() -> None:
    with pytest.raises(TerrainError, match="depths"):
        datum(pyproj.CRS("EPSG:4326+5715").to_wkt(), "", "a.tif")


def test_a_unit_that_nobody_knows() -> None:
    with pytest.raises(TerrainError, match="'K'"):
        datum(pyproj.CRS(4326).to_wkt(), "K", "a.tif")


def refused(path: str) -> str:
    with pytest.raises(TerrainError) as caught:
        Terrain(path).heights(*np.array(HOME).reshape(2, 1))
    said = str(caught.value)
    assert "\n" not in said
    assert Path(path).name in said
    return said


def test_what_is_no_terrain_model(tmp_path: Path) -> None:
    """Each is refused in one sentence that names the file."""
    text = tmp_path / "a.txt"
    text.write_text("QGC WPL 110\n", "utf-8")
    assert "no GeoTIFF" in refused(str(text))
    assert "no such file" in refused(str(tmp_path / "none.tif"))
    assert "no such file" in refused("/vsicurl/http://localhost/a.tif")
    assert "3 bands" in refused(written(tmp_path / "c.tif", plane, count=3))
    assert "coordinate reference system" in refused(written(tmp_path / "d.tif", plane, crs=None))
    assert "complex" in refused(written(tmp_path / "e.tif", plane, dtype="complex64"))


@pytest.mark.filterwarnings("ignore:Dataset has no geotransform")
def test_no_place(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tif", plane, transform=None)
    assert "where on Earth" in refused(path)


def test_a_local_system(tmp_path: Path) -> None:
    crs = pyproj.CRS(
        'ENGCRS["site",EDATUM["site"],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["m",1]]'
    ).to_wkt()
    assert "none of places on Earth" in refused(written(tmp_path / "a.tif", plane, crs=crs))


def test_pieces_that_do_not_fit(tmp_path: Path) -> None:
    """One tile of a hundred million pixels, packed to nothing: it is not unpacked."""
    rasterio: Any = pytest.importorskip("rasterio")
    path = str(tmp_path / "a.tif")
    place = rasterio.Affine(1e-4, 0, 8, 0, -1e-4, 48)
    options = {"driver": "GTiff", "count": 1, "dtype": "uint8", "crs": "EPSG:4326"}
    options |= {
        "tiled": True,
        "blockxsize": 10_000,
        "blockysize": 10_000,
        "compress": "deflate",
        "sparse_ok": True,
        "transform": place,
    }
    with rasterio.open(path, "w", height=10_000, width=10_000, **options):
        pass
    assert "10000 x 10000" in refused(path)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.7, 0.999])
def test_a_file_that_was_cut_off(share: float, tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    whole = Path(written(tmp_path / "whole.tif", plane)).read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    refused(str(path))


def test_damage_anywhere(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Any bytes end in heights or in a TerrainError."""
    caplog.set_level(logging.CRITICAL)
    whole = Path(written(tmp_path / "whole.tif", plane, compress="deflate")).read_bytes()
    random = np.random.default_rng(5)
    path = tmp_path / "a.tif"
    for _ in range(150):
        broken = bytearray(whole)
        for at in random.integers(0, len(whole) if random.random() < 0.3 else 600, 4).tolist():
            broken[at] = int(random.integers(256))
        path.write_bytes(broken)
        try:
            heights = Terrain(str(path)).heights(*places(20))
        except TerrainError:
            continue
        assert heights.shape == (20,)


def test_level_ground() -> None:
    np.testing.assert_array_equal(
        Level(3.0).heights(np.array([1.0, np.nan]), np.zeros(2)), [3.0, np.nan]
    )


def test_without_rasterio(tmp_path: Path) -> None:
    """Who lacks it is told how to get it."""
    program = (
        "import sys; sys.modules['rasterio'] = None\n"
        "from mavframecheck.geo.terrain import Terrain, TerrainError\n"
        "try: Terrain('a.tif')\n"
        "except TerrainError as error: print(error)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    assert run.stdout == (
        "a terrain model needs the package rasterio: pip install 'mavframecheck[dem]'\n"
    )
