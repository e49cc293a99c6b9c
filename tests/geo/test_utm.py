"""UTM zones against PROJ's own search, the projection there and back."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Proj

from mavframecheck.geo.utm import geodetic_from_utm, utm_from_geodetic, zone

LATITUDES = st.floats(-80, 84)
LONGITUDES = st.floats(-180, 179.999)


@pytest.mark.parametrize(
    ("lat", "lon", "number"),
    [
        *((0, -180, 1), (0, 180, 1), (0, 179.9, 60), (0, 0, 31), (0, -0.1, 30), (52, 21, 34)),
        *((60, 2.9, 31), (60, 5, 32), (55.9, 5, 31), (64, 5, 31)),
        *((78, 8.9, 31), (78, 9, 33), (78.2, 15.6, 33), (78, 21, 35), (78, 33, 37), (78, 42, 38)),
        *((84.1, 0, 0), (-80.1, 0, 0), (np.nan, 0, 0), (0, np.nan, 0), (0, 361, 31), (0, 541, 1)),
    ],
)
def test_zones(lat: float, lon: float, number: int) -> None:
    """Six degrees each but for Norway and Svalbard; none at the poles."""
    assert zone(lat, lon) == number


@given(LATITUDES, LONGITUDES)
def test_there_and_back(lat: float, lon: float) -> None:
    number, north = int(zone(lat, lon)), lat >= 0
    flat = utm_from_geodetic(lat, lon, number, north=north)

    back = geodetic_from_utm(flat[0], flat[1], number, north=north)

    assert Geodesic.WGS84.Inverse(lat, lon, back[0], back[1])["s12"] < 1e-6
    own = Proj(proj="utm", zone=number, south=not north, ellps="WGS84")(lon, lat)
    np.testing.assert_allclose(flat, own, atol=1e-3)
    assert 0 <= flat[1] <= 10_000_000


def test_what_is_no_place() -> None:
    assert np.isnan(utm_from_geodetic(np.nan, 0, 31, north=True)).all()
    with pytest.raises(ValueError, match="UTM has zones 1 to 60, not 61"):
        utm_from_geodetic(0, 0, 61, north=True)


def test_without_the_package() -> None:
    """Whoever lacks pyproj is told what to install, and everything else still works."""
    program = (
        "import sys; sys.modules['pyproj'] = None\n"
        "from mavframecheck.geo.utm import utm_from_geodetic, zone\n"
        "assert zone(52, 21) == 34\n"
        "utm_from_geodetic(52, 21, 34, north=True)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True
    )
    assert "pip install 'mavframecheck[utm]'" in done.stderr.splitlines()[-1]
