"""Distances and bearings against geographiclib, local axes against PROJ."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import assume, given
from hypothesis import strategies as st
from pyproj import Transformer

from mavframecheck.geo.geodesy import bearing_deg, distance_m, geodetic_from_ned, ned_from_geodetic

Floats = npt.NDArray[np.float64]

LATITUDES = st.floats(-90, 90)
LONGITUDES = st.floats(-180, 180)
HEIGHTS = st.floats(-1_000, 50_000)
NEAR = st.tuples(*[st.floats(-100_000, 100_000)] * 3)
WGS84 = Geodesic.WGS84


def turned(a: Any, b: Any) -> float:
    """Return the angle between two directions, degrees."""
    return abs((float(a) - float(b) + 180) % 360 - 180)


@given(LATITUDES, LONGITUDES, LATITUDES, LONGITUDES)
def test_distance_anywhere(lat1: float, lon1: float, lat2: float, lon2: float) -> None:
    """Also on opposite sides of the Earth, which the library's own search is made for."""
    truth = WGS84.Inverse(lat1, lon1, lat2, lon2)["s12"]
    within = 2e-6 if truth < 10e6 else 2e-3

    assert distance_m(lat1, lon1, lat2, lon2) == pytest.approx(truth, rel=within, abs=1e-6)


@given(LATITUDES, LONGITUDES, st.floats(0, 360), st.floats(-3, 6))
def test_distance_of_a_walk(lat: float, lon: float, azimuth: float, decades: float) -> None:
    """From a millimetre to 1 000 km in any direction."""
    end = WGS84.Direct(lat, lon, azimuth, 10**decades)

    found = distance_m(lat, lon, end["lat2"], end["lon2"])

    assert found == pytest.approx(10**decades, rel=2e-6, abs=1e-6)


@given(st.floats(-89, 89), LONGITUDES, st.floats(0, 360), st.floats(0, 6))
def test_bearing_of_a_walk(lat: float, lon: float, azimuth: float, decades: float) -> None:
    """From a metre to 1 000 km; at the poles themselves longitude decides what north is."""
    end = WGS84.Direct(lat, lon, azimuth, 10**decades)

    assert turned(bearing_deg(lat, lon, end["lat2"], end["lon2"]), azimuth) < 1e-3


@given(LATITUDES, LONGITUDES, LATITUDES, LONGITUDES)
def test_bearing_far_away(lat1: float, lon1: float, lat2: float, lon2: float) -> None:
    truth = WGS84.Inverse(lat1, lon1, lat2, lon2)
    assume(1 < truth["s12"] < 15e6 and abs(lat1) < 89)

    found = bearing_deg(lat1, lon1, lat2, lon2)

    assert turned(found, truth["azi1"]) < (0.12 if truth["s12"] < 10e6 else 0.5)
    assert 0 <= found < 360


def test_four_bearings() -> None:
    found = bearing_deg(0, 179.9, [1, 0, -1, 0], [179.9, -179.9, 179.9, 179])

    np.testing.assert_allclose(found, [0, 90, 180, 270])


def test_no_way_has_no_bearing() -> None:
    assert distance_m(47, 8, 47, 8) == 0
    assert np.isnan(bearing_deg(47, 8, 47, 8))


@given(st.tuples(LATITUDES, LONGITUDES, HEIGHTS), st.tuples(LATITUDES, LONGITUDES, HEIGHTS))
def test_ned_anywhere(place: tuple[float, ...], origin: tuple[float, ...]) -> None:
    """Against PROJ's topocentric axes, for positions however far away."""
    found = ned_from_geodetic(*place, *origin)

    np.testing.assert_allclose(found, proj_ned((*place, *origin)), rtol=0, atol=1e-6)


@given(NEAR, st.floats(-89.9, 89.9), LONGITUDES, HEIGHTS)
def test_ned_there_and_back(ned: tuple[float, ...], lat0: float, lon0: float, h0: float) -> None:
    lat, lon, h = geodetic_from_ned(ned, lat0, lon0, h0)

    np.testing.assert_allclose(proj_ned((lat, lon, h, lat0, lon0, h0)), ned, rtol=0, atol=1e-5)
    np.testing.assert_allclose(ned_from_geodetic(lat, lon, h, lat0, lon0, h0), ned, atol=1e-5)


@pytest.mark.parametrize("lat0", [0.0, 47.4, -35.36, 89.0])
@pytest.mark.parametrize("lon0", [0.0, 90.0, 179.999999, -180.0])
@pytest.mark.parametrize("h0", [0.0, -400.0, 2500.0])
def test_small_steps(lat0: float, lon0: float, h0: float) -> None:
    """The origin is zero, and a step north, east or up is one along its axis, across 180 degrees, too."""
    step = 1e-5
    north_m = Geodesic.WGS84.Inverse(lat0, lon0, lat0 + step, lon0)["s12"]
    east_m = Geodesic.WGS84.Inverse(lat0, lon0, lat0, lon0 + step)["s12"]
    steps = np.array([[0, 0, 0], [step, 0, 0], [0, step, 0], [0, 0, 1.0]])
    lat, lon, h = (steps + np.array([lat0, lon0, h0])).T
    found = ned_from_geodetic(lat, (lon + 180) % 360 - 180, h, lat0, lon0, h0)
    higher = 1 + h0 / 6.37e6
    expected = [[0, 0, 0], [north_m * higher, 0, 0], [0, east_m * higher, 0], [0, 0, -1]]
    np.testing.assert_allclose(found, expected, atol=2e-5)


def test_down_is_down() -> None:
    np.testing.assert_allclose(geodetic_from_ned([0, 0, -5], 47, 8, 400), [47, 8, 405])
    np.testing.assert_allclose(ned_from_geodetic(47, 8, 405, 47, 8, 400), [0, 0, -5], atol=1e-8)


@pytest.mark.parametrize("function", [distance_m, bearing_deg])
@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", range(4))
def test_no_place_has_no_distance(
    function: Callable[..., Floats], wrong: float, place: int
) -> None:
    """Nor does a latitude beyond the poles."""
    arguments = [47.0, 8.0, 48.0, 9.0]
    arguments[place] = wrong

    assert np.isnan(function(*arguments))
    assert np.isnan(function(90.1, 8, 48, 9))
    assert np.isnan(function(47, 8, -90.1, 9))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", range(6))
def test_no_place_has_no_axes(wrong: float, place: int) -> None:
    arguments = [47.0, 8.0, 400.0, 47.0, 8.0, 400.0]
    arguments[place] = wrong

    assert np.isnan(ned_from_geodetic(*arguments)).all()
    assert np.isnan(geodetic_from_ned(arguments[:3], *arguments[3:])).all()
    assert np.isnan(ned_from_geodetic(91, 8, 400, 47, 8, 400)).all()
    assert np.isnan(geodetic_from_ned([0, 0, 0], -91, 8, 400)).all()


def test_shapes_broadcast() -> None:
    """One bad row leaves its neighbours alone."""
    lat = np.array([47.0, np.nan, 48.0])

    ned = ned_from_geodetic(lat, 8, 400, 47, 8, 400)

    assert distance_m(lat, 8, 47, np.zeros((2, 1))).shape == (2, 3)
    assert bearing_deg(lat, 8, 47, np.zeros((2, 1))).shape == (2, 3)
    assert ned.shape == geodetic_from_ned(ned, 47, 8, 400).shape == (3, 3)
    assert geodetic_from_ned([1, 2, 3], lat, 8, 400).shape == (3, 3)
    assert ned_from_geodetic([], [], [], 47, 8, 400).shape == (0, 3)
    np.testing.assert_array_equal(np.isnan(ned).all(axis=1), [False, True, False])


def test_pymap3d_waits_until_it_is_used() -> None:
    program = (
        "import sys; from mavframecheck.geo import geodesy; geodesy.distance_m(0, 0, 1, 1); "
        "geodesy.bearing_deg(0, 0, 1, 1); assert 'pymap3d' not in sys.modules"
    )

    subprocess.run([sys.executable, "-c", program], check=True)


def proj_ned(places: tuple[float, ...]) -> Floats:
    """Return (3,) m, NED, as PROJ computes it from position and origin."""
    lat, lon, h, lat0, lon0, h0 = (float(place) for place in places)
    pipeline = Transformer.from_pipeline(
        "+proj=pipeline +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lat_0={lat0!r} +lon_0={lon0!r} +h_0={h0!r}"
    )
    east, north, up = pipeline.transform(np.radians(lon), np.radians(lat), h, radians=True)
    return np.array([north, east, -up])
