"""ECEF: the article's points, PROJ and geographiclib as oracles, there and back."""

from __future__ import annotations

import numpy as np
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Transformer

from mavframecheck.geo.geodesy import (
    FLATTENING,
    SEMI_MAJOR_M,
    ecef_from_geodetic,
    geodetic_from_ecef,
)

SEMI_MINOR_M = SEMI_MAJOR_M * (1 - FLATTENING)
PROJ = Transformer.from_crs(4979, 4978, always_xy=True)
LATITUDES = st.floats(-90, 90)
LONGITUDES = st.floats(-180, 180)
HEIGHTS = st.floats(-900_000, 1_000_000)


@pytest.mark.parametrize(
    ("lat", "lon", "height", "xyz"),
    [
        (0, 0, 0, [SEMI_MAJOR_M, 0, 0]),
        (0, 90, 0, [0, SEMI_MAJOR_M, 0]),
        (0, 180, 0, [-SEMI_MAJOR_M, 0, 0]),
        (0, -180, 0, [-SEMI_MAJOR_M, 0, 0]),
        (90, 0, 0, [0, 0, SEMI_MINOR_M]),
        (90, 123, 0, [0, 0, SEMI_MINOR_M]),
        (-90, 0, 100, [0, 0, -SEMI_MINOR_M - 100]),
        (0, 0, -400, [SEMI_MAJOR_M - 400, 0, 0]),
    ],
)
def test_points_of_known_meaning(lat: float, lon: float, height: float, xyz: list[float]) -> None:
    """Equator and prime meridian, 90 E, the antimeridian from both sides, the poles, below zero."""
    np.testing.assert_allclose(ecef_from_geodetic(lat, lon, height), xyz, atol=1e-8)
    back = geodetic_from_ecef(xyz)
    assert back[0] == pytest.approx(lat, abs=1e-11)
    assert back[2] == pytest.approx(height, abs=1e-8)


@given(LATITUDES, LONGITUDES, HEIGHTS)
def test_as_proj_and_back(lat: float, lon: float, height: float) -> None:
    xyz = ecef_from_geodetic(lat, lon, height)

    np.testing.assert_allclose(xyz, PROJ.transform(lon, lat, height), atol=1e-6)
    back = geodetic_from_ecef(xyz)
    assert back[2] == pytest.approx(height, abs=1e-6)
    gone = Geodesic.WGS84.Inverse(lat, lon, back[0], back[1])["s12"]
    assert gone < 1e-6


@given(LATITUDES, LONGITUDES, st.floats(1e6, 4e7))
def test_as_high_as_satellites(lat: float, lon: float, height: float) -> None:
    xyz = ecef_from_geodetic(lat, lon, height)

    np.testing.assert_allclose(ecef_from_geodetic(*geodetic_from_ecef(xyz)), xyz, atol=1e-3)


def test_a_chord_is_no_distance() -> None:
    """A quarter of the equator: through the Earth it is a tenth shorter."""
    chord = np.linalg.norm(ecef_from_geodetic(0, 90, 0) - ecef_from_geodetic(0, 0, 0))
    along = Geodesic.WGS84.Inverse(0, 0, 0, 90)["s12"]

    assert chord == pytest.approx(0.9 * along, rel=0.001)


def test_what_is_no_place() -> None:
    """Nothing near the centre of the Earth, beyond the poles or unknown comes out as a position."""
    for xyz in ([0, 0, 0], [0, 0, 42_000], [1000, 1000, 1000], [np.nan, 0, 7e6], [np.inf, 0, 0]):
        assert np.isnan(geodetic_from_ecef(xyz)).all()
    for place in ((90.1, 0, 0), (0, np.nan, 0), (0, 0, np.inf)):
        assert np.isnan(ecef_from_geodetic(*place)).all()
