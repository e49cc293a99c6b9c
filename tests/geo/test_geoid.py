"""The geoid against NGA's own test points, PROJ with the source grid, and what holds on a sphere."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.geo import geoid
from mavframecheck.geo.geoid import undulation
from tests.geo import reference
from tools import make_geoid

LATITUDES = st.floats(-90, 90)
LONGITUDES = st.floats(-720, 720)
ROUNDING_M = 0.0051
"""Centimetres are stored, and PROJ's table has four decimals."""


@pytest.mark.parametrize(
    ("lat", "lon", "metres", "within"),
    [
        (47.397, 8.545, 47.34, 0.02),  # Zurich
        (-35.363, 149.165, 19.44, 0.02),  # Canberra
        # NGA's readme of EGM96, OUTINTPT.DAT: splines through the same grid
        (38.6281550, 269.7791550, -31.628, 0.06),
        (-14.6212170, 305.0211140, -2.969, 0.06),
        (46.8743190, 102.4487290, -43.575, 0.06),
        (-23.6174460, 133.8747120, 15.871, 0.06),
        (38.6254730, 359.9995000, 50.066, 0.06),
        (-0.4667440, 0.0023000, 17.329, 0.06),
    ],
)
def test_known_places(lat: float, lon: float, metres: float, within: float) -> None:
    assert undulation(lat, lon) == pytest.approx(metres, abs=within)


def test_equals_the_stored_answers_of_proj() -> None:
    lat, lon, metres = reference.table()

    assert len(metres) == 200
    np.testing.assert_allclose(undulation(lat, lon), metres, rtol=0, atol=ROUNDING_M)


@reference.needs_grid
def test_equals_proj_with_the_source_grid() -> None:
    """100 000 places, uniform in degrees, so that the polar cells have their share."""
    rng = np.random.default_rng(15)
    lat, lon = rng.uniform(-90, 90, 100_000), rng.uniform(-180, 180, 100_000)

    difference = undulation(lat, lon) - reference.undulation(lat, lon)

    assert np.abs(difference).max() < ROUNDING_M


@reference.needs_grid
def test_stored_answers_are_those_of_proj() -> None:
    lat, lon, metres = reference.table()

    np.testing.assert_array_equal(np.stack(reference.places()), np.stack((lat, lon)))
    np.testing.assert_allclose(reference.undulation(lat, lon), metres, rtol=0, atol=1e-4)


@reference.needs_grid
def test_the_script_makes_the_shipped_grid() -> None:
    """From the source that the README names; compared undone, as another zlib may compress otherwise."""
    source = reference.GRID.read_bytes()

    assert hashlib.sha256(source).hexdigest() in readme()
    np.testing.assert_array_equal(make_geoid.centimetres(source), geoid._grid())


def test_packing_undoes_itself() -> None:
    """What the script packs is the shipped file's content again."""
    deltas = [zlib.decompress(b) for b in (make_geoid.packed(geoid._grid()), shipped())]

    assert deltas[0] == deltas[1]


def test_another_grid_is_refused() -> None:
    other = make_geoid.HEADER.pack(-90, 0, 0.5, 0.5, 361, 720)

    with pytest.raises(SystemExit, match="not the whole Earth"):
        make_geoid.centimetres(other)


def test_file_is_the_one_of_the_readme() -> None:
    assert hashlib.sha256(shipped()).hexdigest() in readme()
    assert f"| {len(shipped())} |" in readme()
    assert len(shipped()) < 1_200_000


@given(lat=LATITUDES, lon=LONGITUDES)
def test_is_within_what_the_earth_has(lat: float, lon: float) -> None:
    assert -107 <= float(undulation(lat, lon)) <= 86


@given(lat=LATITUDES, lon=LONGITUDES)
def test_a_turn_of_longitude_changes_nothing(lat: float, lon: float) -> None:
    assert undulation(lat, lon + 360) == pytest.approx(undulation(lat, lon), abs=1e-6)


@given(lat=LATITUDES, lon=LONGITUDES, north=st.floats(-1e-4, 1e-4), east=st.floats(-1e-4, 1e-4))
def test_is_continuous(lat: float, lon: float, north: float, east: float) -> None:
    """No jump anywhere, the edges of the grid included: 1e-4 degrees are 11 m, the steepest slope 1e-3."""
    beside = undulation(np.clip(lat + north, -90, 90), lon + east)

    assert beside == pytest.approx(undulation(lat, lon), abs=0.02)


@given(lat=LATITUDES, step=st.floats(0, 1e-4))
def test_is_continuous_at_180(lat: float, step: float) -> None:
    assert undulation(lat, 180) == undulation(lat, -180)
    assert undulation(lat, 180 - step) == pytest.approx(undulation(lat, step - 180), abs=0.02)


@given(lon=LONGITUDES)
def test_a_pole_has_one_value(lon: float) -> None:
    """13.606 m and -29.534 m in the source."""
    assert undulation([90, -90], lon) == pytest.approx([13.61, -29.53], abs=1e-9)


@pytest.mark.parametrize(
    ("lat", "lon"),
    [(np.nan, 8), (47, np.nan), (90.1, 8), (-1e30, 8), (np.inf, 8), (47, np.inf), (47, -np.inf)],
)
def test_no_place_has_no_undulation(lat: float, lon: float) -> None:
    assert np.isnan(undulation(lat, lon))


def test_shapes_broadcast() -> None:
    assert undulation(0, 0).shape == ()
    assert undulation([], []).shape == (0,)
    assert undulation(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)
    np.testing.assert_array_equal(np.isnan(undulation([1, np.nan, 2], 5)), [False, True, False])


def test_nothing_is_read_before_the_first_call() -> None:
    program = (
        "from mavframecheck.geo import geoid; assert geoid._closed_grid.cache_info().currsize == 0"
    )

    subprocess.run([sys.executable, "-c", program], check=True)


def shipped() -> bytes:
    """Return the content of the data file."""
    return geoid.DATA.read_bytes()


def readme() -> str:
    """Return what the data folder says about itself."""
    return geoid.DATA.with_name("README.md").read_text(encoding="utf-8")
