"""Positions as types: what fits together, what is refused, and where the numbers come out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Transformer

from mavframecheck.geo.geoid import undulation
from mavframecheck.geo.rotations import ned_from_ecef, ned_from_frd
from mavframecheck.semantics.enums import AltRef, Clock
from mavframecheck.semantics.positions import (
    NO_TIME,
    BodyVector,
    EcefPosition,
    EcefVector,
    GeodeticPosition,
    LocalPosition,
    LocalVector,
    Measured,
    MixingError,
    Origin,
    ProjectedPosition,
)

Floats = npt.NDArray[np.float64]
ELLIPSOID, MSL, HOME, TERRAIN = AltRef.ELLIPSOID, AltRef.MSL, AltRef.HOME, AltRef.TERRAIN
WARSAW = Origin("17", 52.0, 21.0, 121.4, ELLIPSOID)
ZURICH = Origin("18", 47.397742, 8.545594, 535.0, ELLIPSOID)
PROJ = Transformer.from_crs(4979, 4978, always_xy=True)

PLACES = st.builds(
    GeodeticPosition,
    st.floats(-89.9, 89.9),
    st.floats(-180, 180),
    st.floats(-500, 20_000),
    st.just(ELLIPSOID),
)
ORIGINS = st.builds(
    Origin,
    st.just("any"),
    st.floats(-89.9, 89.9),
    st.floats(-180, 180),
    st.floats(-500, 9000),
    st.just(ELLIPSOID),
)
STEPS = st.tuples(*[st.floats(-50_000, 50_000)] * 3)


def ned(*xyz: float, origin: Origin | None = WARSAW) -> LocalPosition:
    return LocalPosition(np.array([xyz]), "NED", origin)


def at(lat: float, lon: float, height: float, reference: AltRef = ELLIPSOID) -> GeodeticPosition:
    return GeodeticPosition(lat, lon, height, reference)


# What fits together


def test_positions_subtract_to_vectors_and_vectors_move_positions() -> None:
    step = ned(14.2, -3.7, -22.1) - ned(10, 0, 0)

    assert isinstance(step, LocalVector)
    np.testing.assert_allclose(step.xyz, [[4.2, -3.7, -22.1]])
    np.testing.assert_allclose((ned(10, 0, 0) + step).xyz, [[14.2, -3.7, -22.1]])
    np.testing.assert_allclose((step + ned(10, 0, 0)).xyz, [[14.2, -3.7, -22.1]])
    np.testing.assert_allclose((ned(10, 0, 0) - step).xyz, [[5.8, 3.7, 22.1]])
    np.testing.assert_allclose((2 * step - step + -step).xyz, 0)
    assert step.norm == pytest.approx(np.linalg.norm([4.2, -3.7, -22.1]))


def test_clocks_are_not_mixed() -> None:
    boot = Measured(clock=Clock.BOOT, time_ns=np.array([5_000_000_000, NO_TIME]))
    later = Measured(clock=Clock.BOOT, time_ns=np.array([7_500_000_000, 1]))
    unix = Measured(clock=Clock.UNIX, time_ns=np.array([10**18, 10**18]))

    np.testing.assert_array_equal(later.elapsed_s(boot), [2.5, np.nan])
    with pytest.raises(MixingError, match="a time on the unix clock from one on the boot clock"):
        boot.elapsed_s(unix)


# What is refused

A_NED = "a local NED position from origin 17"
APART = "they are not in one frame; convert one of them first"
GEODETIC = "a geodetic position on WGS84, heights above the ellipsoid"


@pytest.mark.parametrize(
    ("mix", "message"),
    [
        (
            lambda: ned(1, 2, 3) - ned(1, 2, 3, origin=ZURICH),
            f"cannot subtract a local NED position from origin 18 from {A_NED}: {APART}",
        ),
        (
            lambda: ned(1, 2, 3).to_axes("ENU") - ned(1, 2, 3),
            f"cannot subtract {A_NED} from a local ENU position from origin 17: {APART}",
        ),
        (
            lambda: ned(1, 2, 3) - EcefPosition(np.array([[1.0, 2, 3]])),
            f"cannot subtract an ECEF position on WGS84 from {A_NED}: {APART}",
        ),
        (
            lambda: ned(1, 2, 3) + ned(1, 2, 3),
            f"cannot add {A_NED} to {A_NED}: only a vector can move a position",
        ),
        (
            lambda: ned(1, 2, 3) + BodyVector(np.array([[1.0, 0, 0]])),
            f"cannot add a body FRD vector, m to {A_NED}: they are not in one frame; turn the vector first",
        ),
        (
            lambda: ned(1, 2, 3) + LocalVector(np.array([[1.0, 0, 0]]), "NED", WARSAW, "m/s"),
            f"cannot add a local NED vector of origin 17, m/s to {A_NED}: a position is moved by m, not by m/s",
        ),
        (
            lambda: BodyVector(np.ones((1, 3))) + LocalVector(np.ones((1, 3)), "NED", WARSAW),
            f"cannot add a local NED vector of origin 17, m to a body FRD vector, m: {APART}",
        ),
        (
            lambda: BodyVector(np.ones((1, 3))) - BodyVector(np.ones((1, 3)), unit="m/s"),
            "cannot subtract a body FRD vector, m/s from a body FRD vector, m: m/s are not m",
        ),
        (
            lambda: ned(1, 2, 3, origin=None) - ned(1, 2, 3, origin=None),
            (
                "cannot subtract a local NED position from an unknown origin from a local NED position "
                "from an unknown origin: nothing says where the origin is, so it may have moved"
            ),
        ),
        (
            lambda: at(52, 21, 100) - at(52, 21, 90),
            (
                f"cannot subtract {GEODETIC} from {GEODETIC}: degrees are not metres; convert both "
                "with to_ecef or to_local first"
            ),
        ),
        (
            lambda: at(52, 21, 100).height_difference_m(at(52, 21, 90, MSL)),
            (
                "cannot subtract a geodetic position on WGS84, heights above sea level from "
                f"{GEODETIC}: their heights have different zeros; see above()"
            ),
        ),
        (
            lambda: at(52, 21, 100, MSL).to_ecef(),
            (
                "ECEF needs heights above the ellipsoid, these are above sea level: convert with "
                "above('ellipsoid')"
            ),
        ),
        (
            lambda: at(52, 21, 100, TERRAIN).above(MSL),
            (
                "a height above terrain cannot become one above sea level: nothing says how high that "
                "level is"
            ),
        ),
        (
            lambda: at(52, 17.9, 0).to_utm() - at(52, 18.1, 0).to_utm(),
            (
                "cannot subtract a UTM position in zone 34N on WGS84, heights above the ellipsoid from "
                f"a UTM position in zone 33N on WGS84, heights above the ellipsoid: {APART}"
            ),
        ),
        (
            lambda: GeodeticPosition([52, 52], [17.9, 18.1], 0, ELLIPSOID).to_utm(),
            (
                "positions lie in UTM zones 33, 34 of one hemisphere: one zone of one hemisphere is one "
                "map; choose it, or take geodetic or local positions"
            ),
        ),
        (
            lambda: GeodeticPosition([1, -1], [21, 21], 0, ELLIPSOID).to_utm(),
            (
                "positions lie in UTM zone 34 of both hemispheres: one zone of one hemisphere is one "
                "map; choose it, or take geodetic or local positions"
            ),
        ),
        (
            lambda: ProjectedPosition(np.ones((1, 3)), 0, True, ELLIPSOID),
            "a UTM position needs its zone, 1 to 60",
        ),
        (
            lambda: LocalPosition(np.ones((1, 3)), "FRD", WARSAW).to_ecef(),
            "nothing says how a local FRD position from origin 17 is turned from north",
        ),
        (
            lambda: ned(1, 2, 3, origin=None).to_geodetic(),
            "nothing says where the origin of this local frame is",
        ),
        (
            lambda: BodyVector(np.ones((1, 3))).to_axes("NED"),
            "nothing turns FRD into NED without an attitude",
        ),
        (
            lambda: BodyVector(np.ones((1, 3))).to_local(np.diag([1.0, 1, -1]), WARSAW),
            "this attitude is no rotation: R R^T is not 1, or it is a reflection",
        ),
        (
            lambda: np.ones(3) + ned(1, 2, 3),
            f"cannot add plain ndarray to {A_NED}: numbers without a frame have no place",
        ),
    ],
)
def test_what_does_not_fit_says_why(mix: Callable[[], object], message: str) -> None:
    with pytest.raises(MixingError) as refused:
        mix()
    assert str(refused.value) == message


def test_a_new_origin_at_the_same_place_is_another_frame() -> None:
    """Only the registry knows whether two origins are one: their ids decide, not how near they are."""
    again = Origin("19", WARSAW.lat_deg, WARSAW.lon_deg, WARSAW.height_m, ELLIPSOID)
    with pytest.raises(MixingError):
        ned(1, 2, 3) - ned(1, 2, 3, origin=again)


# Points move, vectors only turn


@given(PLACES, ORIGINS)
def test_there_and_back(place: GeodeticPosition, origin: Origin) -> None:
    back = place.to_local(origin, "ENU").to_axes("NED").to_geodetic()

    assert back.height_reference is ELLIPSOID
    assert back.height_difference_m(place) == pytest.approx(0, abs=1e-5)
    oracle = Geodesic.WGS84.Inverse(
        place.lat_deg[0], place.lon_deg[0], back.lat_deg[0], back.lon_deg[0]
    )
    assert oracle["s12"] < 1e-5


@given(ORIGINS, STEPS, ORIGINS)
def test_differences_turn_as_vectors(
    origin: Origin, step: tuple[float, float, float], other: Origin
) -> None:
    """The difference of two points, turned, is the difference of the points, moved and turned."""
    a, b = ned(0, 0, 0, origin=origin), ned(*step, origin=origin)
    vector = b - a

    turned = vector.to_ecef()
    assert isinstance(turned, EcefVector)
    np.testing.assert_allclose((b.to_ecef() - a.to_ecef()).xyz, turned.xyz, atol=1e-6)
    np.testing.assert_allclose(
        (b.to_local(other) - a.to_local(other)).xyz, turned.to_local(other).xyz, atol=1e-6
    )
    assert turned.norm == pytest.approx(vector.norm)


@given(ORIGINS)
def test_an_origin_is_zero(origin: Origin) -> None:
    place = at(origin.lat_deg, origin.lon_deg, origin.height_m)
    np.testing.assert_allclose(place.to_local(origin).xyz, 0, atol=1e-8)
    np.testing.assert_allclose(ned(0, 0, 0, origin=origin).to_ecef().xyz[0], origin.ecef_m)


@pytest.mark.parametrize(
    ("north", "east", "up", "expected"),
    [(1e-5, 0, 0, [1, 0, 0]), (0, 1e-5, 0, [0, 1, 0]), (0, 0, 1, [0, 0, -1])],
)
def test_small_steps_have_the_right_sign(
    north: float, east: float, up: float, expected: list[float]
) -> None:
    """A step north, east and up goes along +x, +y and -z of NED, and along +y, +x and +z of ENU."""
    place = at(WARSAW.lat_deg + north, WARSAW.lon_deg + east, WARSAW.height_m + up)
    ned_m = place.to_local(WARSAW).xyz[0]
    np.testing.assert_allclose(ned_m / np.linalg.norm(ned_m), expected, atol=1e-5)
    enu_m = place.to_local(WARSAW, "ENU").xyz[0]
    np.testing.assert_allclose(enu_m, ned_m[[1, 0, 2]] * [1, 1, -1])


def test_across_the_antimeridian() -> None:
    """179.999 E and 179.999 W are 0.002 degrees apart, whatever their difference says."""
    west, east = at(0, -179.999, 0), at(0, 179.999, 0)
    oracle = Geodesic.WGS84.Inverse(0, 179.999, 0, -179.999)["s12"]

    assert east.distance_m(west) == pytest.approx(oracle)
    step = west.to_local(Origin("a", 0, 179.999, 0, ELLIPSOID)).xyz[0]
    np.testing.assert_allclose(step[:2], [0, oracle], atol=0.01)


def test_below_zero() -> None:
    """The Dead Sea: a negative height is a height."""
    place = at(31.5, 35.5, -430, MSL).above(ELLIPSOID)
    back = place.to_ecef().to_geodetic().above(MSL)
    assert back.height_m == pytest.approx(-430, abs=1e-6)
    np.testing.assert_allclose(
        place.to_ecef().xyz[0], PROJ.transform(35.5, 31.5, place.height_m[0]), atol=1e-6
    )


def test_body_vectors_turn_with_the_attitude() -> None:
    """Ten metres per second along the nose, yawed by +90 degrees, go east."""
    nose = BodyVector(np.array([[10.0, 0, 0]]), unit="m/s")

    flown = nose.to_local(ned_from_frd(0, 0, np.pi / 2), WARSAW)

    np.testing.assert_allclose(flown.xyz, [[0, 10, 0]], atol=1e-12)
    assert flown.unit == "m/s"
    np.testing.assert_array_equal(nose.to_axes("FLU").to_axes("FRD").xyz, nose.xyz)


# Heights


def test_heights_change_their_zero_through_the_geoid() -> None:
    place = at(52, 21, 100, MSL)
    separation = float(undulation(52, 21))

    above = place.above("ellipsoid")

    assert above.height_m == pytest.approx(100 + separation)
    assert above.above("msl").height_m == pytest.approx(100)
    home = at(52, 21, 20, HOME)
    assert home.above("msl", level_msl_m=80).height_m == pytest.approx(100)
    assert home.above("ellipsoid", level_msl_m=80).height_m == pytest.approx(100 + separation)
    with pytest.raises(MixingError, match="above home cannot become one above sea level"):
        home.above("msl")


def test_an_origin_above_the_sea_lies_on_the_geoid() -> None:
    sea = Origin("sea", 52.0, 21.0, 100.0, MSL)
    geodetic = ned(0, 0, -10, origin=sea).to_geodetic()
    assert geodetic.above("msl").height_m == pytest.approx(110, abs=1e-6)


# UTM


def test_utm_keeps_zone_hemisphere_and_heights() -> None:
    place = at(-33.9, 18.4, 30, MSL)
    flat = place.to_utm()

    assert (flat.zone, flat.hemisphere, flat.height_reference) == (34, "S", MSL)
    crs = Transformer.from_crs(4326, 32734, always_xy=True)
    np.testing.assert_allclose(flat.xyz[0, :2], crs.transform(18.4, -33.9), atol=1e-3)
    assert flat.to_geodetic().distance_m(place) == pytest.approx(0, abs=1e-6)


# Covariance


def test_covariance_turns_with_its_position() -> None:
    """North, east and down variances at the point come out along the axes of ECEF and back."""
    p = np.diag([0.04, 0.09, 0.16])[np.newaxis]
    measured = Measured(covariance_m2=p, covariance_frame="local_ned")
    place = GeodeticPosition(52, 21, 121.4, ELLIPSOID, measured)

    ecef = place.to_ecef()

    r = ned_from_ecef(52, 21)
    assert ecef.measured.covariance_frame == "ecef"
    assert ecef.measured.covariance_m2 is not None
    np.testing.assert_allclose(ecef.measured.covariance_m2[0], r.T @ p[0] @ r)
    enu = ecef.to_local(WARSAW, "ENU").measured
    assert enu.covariance_frame == "local_enu"
    assert enu.covariance_m2 is not None
    np.testing.assert_allclose(enu.covariance_m2[0], np.diag([0.09, 0.04, 0.16]), atol=1e-15)


def test_rows_are_taken_with_all_that_belongs_to_them() -> None:
    measured = Measured(time_ns=np.arange(3), clock=Clock.BOOT, valid=np.array([True, False, True]))
    places = GeodeticPosition([1, 2, 3], [4, 5, 6], [7, 8, 9], MSL, measured)

    taken = places.take(np.array([True, False, True]))

    assert taken.lat_deg.tolist() == [1, 3]
    assert taken.measured.time_ns is not None
    assert taken.measured.time_ns.tolist() == [0, 2]
    assert (taken.height_reference, taken.measured.clock) == (MSL, Clock.BOOT)
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        EcefPosition(np.ones((2, 2)))
