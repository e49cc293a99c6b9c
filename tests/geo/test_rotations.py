"""Rotations: what the founding article asks to be tested of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.geo.rotations import (
    ENU_FROM_NED,
    FLU_FROM_FRD,
    is_rotation,
    ned_from_ecef,
    ned_from_frd,
    turn,
    turn_covariance,
    wrapped,
    wrapped_deg,
)

Floats = npt.NDArray[np.float64]
ANGLES = st.floats(-10, 10)
ATTITUDES = st.builds(ned_from_frd, ANGLES, ANGLES, ANGLES)
PLACES = st.builds(ned_from_ecef, st.floats(-90, 90), st.floats(-720, 720))
VECTORS = st.tuples(*[st.floats(-1e7, 1e7)] * 3).map(np.array)
NOSE = np.array([1.0, 0.0, 0.0])


@given(ATTITUDES | PLACES, VECTORS)
def test_every_rotation(matrix: Floats, vector: Floats) -> None:
    """The inverse is the transpose, the determinant is 1, the norm is kept."""
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.inv(matrix), matrix.T, atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1)
    assert is_rotation(matrix)
    turned = turn(matrix, vector)
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(vector))
    np.testing.assert_allclose(turn(matrix.T, turned), vector, atol=1e-6)


@given(ATTITUDES, ATTITUDES)
def test_there_and_back(a: Floats, b: Floats) -> None:
    """T_AB T_BA is nothing at all, and rotations chain."""
    a_from_b = a @ b.T
    np.testing.assert_allclose(a_from_b @ (b @ a.T), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(a_from_b @ b, a, atol=1e-12)


@pytest.mark.parametrize(
    ("roll", "pitch", "yaw", "nose", "right_wing"),
    [
        (0, 0, 0, [1, 0, 0], [0, 1, 0]),
        (0, 0, 90, [0, 1, 0], [-1, 0, 0]),
        (0, 0, 180, [-1, 0, 0], [0, -1, 0]),
        (0, 90, 0, [0, 0, -1], [0, 1, 0]),
        (90, 0, 0, [1, 0, 0], [0, 0, 1]),
        (0, 30, 90, [0, np.cos(np.pi / 6), -0.5], [-1, 0, 0]),
    ],
)
def test_where_nose_and_wing_point(
    roll: float, pitch: float, yaw: float, nose: list[float], right_wing: list[float]
) -> None:
    """Yaw +90 turns the nose east, pitch up lifts it, roll puts the right wing down."""
    attitude = ned_from_frd(*np.radians([roll, pitch, yaw]))

    np.testing.assert_allclose(attitude @ NOSE, nose, atol=1e-15)
    np.testing.assert_allclose(attitude @ [0, 1, 0], right_wing, atol=1e-15)


def test_axes_of_a_place() -> None:
    """At 0 N 0 E north is z, east is y and down points to the centre."""
    np.testing.assert_allclose(ned_from_ecef(0, 0), [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(ned_from_ecef(90, 0)[2], [0, 0, -1], atol=1e-15)
    assert ned_from_ecef(np.zeros((4, 2)), 10.0).shape == (4, 2, 3, 3)


def test_exchanges_of_axes() -> None:
    """North, east, down becomes east, north, up; both are proper rotations and their own inverses."""
    np.testing.assert_array_equal(turn(ENU_FROM_NED, [[1, 2, 3]]), [[2, 1, -3]])
    np.testing.assert_array_equal(turn(FLU_FROM_FRD, [[1, 2, 3]]), [[1, -2, -3]])
    for matrix in (ENU_FROM_NED, FLU_FROM_FRD):
        assert is_rotation(matrix)
        np.testing.assert_array_equal(matrix @ matrix, np.eye(3))


def test_a_reflection_is_no_rotation() -> None:
    assert not is_rotation(np.diag([1.0, 1, -1]))
    assert not is_rotation(2 * np.eye(3))
    assert not is_rotation(np.full((3, 3), np.nan))


@given(ATTITUDES, st.tuples(*[st.floats(0.01, 100)] * 3))
def test_covariance_turns_with_its_vector(matrix: Floats, variances: tuple[float, ...]) -> None:
    """The variance along a turned direction is what it was along the direction."""
    turned = turn_covariance(matrix, np.diag(variances))

    for axis, variance in zip(matrix.T, variances):
        assert axis @ turned @ axis == pytest.approx(variance)


@given(st.floats(-1e4, 1e4))
def test_wrapped_angles_are_the_same_directions(angle: float) -> None:
    """A wrapped angle lies within half a turn and differs by whole turns."""
    for before, after, whole in (
        (np.radians(angle), wrapped(np.radians(angle)), 2 * np.pi),
        (angle, wrapped_deg(angle), 360.0),
    ):
        turns = float((before - after) / whole)
        assert -whole / 2 <= after <= whole / 2
        assert turns == pytest.approx(round(turns), abs=1e-6)
