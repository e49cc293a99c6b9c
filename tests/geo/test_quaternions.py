"""Quaternions beside SciPy's rotations."""

from __future__ import annotations

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.rotations import ned_from_frd

ANGLE = st.floats(-np.pi, np.pi)
PITCH = st.floats(-1.5, 1.5)
QUATERNION = (
    st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q4.unit(np.array(q)))
)
VECTOR = st.tuples(*[st.floats(-100, 100)] * 3).map(np.array)


def scipy_of(q: np.ndarray) -> Rotation:
    """Return the same rotation of SciPy, whose w is last."""
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Tell whether two quaternions are one rotation."""
    return bool(abs(abs(float(np.dot(a, b))) - 1) < 1e-9)


@given(roll=ANGLE, pitch=PITCH, yaw=ANGLE)
def test_euler(roll: float, pitch: float, yaw: float) -> None:
    """Angles in ZYX order, there and back, as SciPy and as the matrices have them."""
    q = q4.quaternion_from_euler(roll, pitch, yaw)
    oracle = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    npt.assert_allclose(q4.matrix_from_quaternion(q), oracle.as_matrix(), atol=1e-12)
    npt.assert_allclose(q4.matrix_from_quaternion(q), ned_from_frd(roll, pitch, yaw), atol=1e-12)
    npt.assert_allclose(
        q4.matrix_from_quaternion(q4.quaternion_from_euler(*q4.euler_from_quaternion(q))),
        oracle.as_matrix(),
        atol=1e-6,
    )


@given(a=QUATERNION, b=QUATERNION, v=VECTOR)
def test_algebra(a: np.ndarray, b: np.ndarray, v: np.ndarray) -> None:
    """Product, inverse and turned vectors."""
    npt.assert_allclose(q4.turn_by(a, v), scipy_of(a).apply(v), atol=1e-9)
    assert same(q4.product(a, b), np.roll((scipy_of(a) * scipy_of(b)).as_quat(), 1))
    npt.assert_allclose(q4.product(a, q4.inverse(a)), q4.IDENTITY, atol=1e-12)
    npt.assert_allclose(
        q4.angle_between(a, b), (scipy_of(a).inv() * scipy_of(b)).magnitude(), atol=1e-6
    )


@given(q=QUATERNION)
def test_matrix_there_and_back(q: np.ndarray) -> None:
    """A matrix has one quaternion, up to its sign."""
    assert same(q4.quaternion_from_matrix(q4.matrix_from_quaternion(q)), q)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
def test_half_turns(axis: list[int]) -> None:
    """Where w is 0 a formula through the trace alone fails."""
    matrix = Rotation.from_rotvec(np.pi * np.array(axis)).as_matrix()
    assert same(q4.quaternion_from_matrix(matrix), np.array([0.0, *axis]))


@given(yaw=ANGLE, q=QUATERNION)
def test_twist(yaw: float, q: np.ndarray) -> None:
    """A turn about z on the left is found again, whatever the attitude."""
    turned = q4.product(q4.about_z(yaw), q)
    found = q4.twist(q4.product(turned, q4.inverse(q)))
    assert abs(np.angle(np.exp(1j * (found - yaw)))) < 1e-9


@given(a=QUATERNION, share=st.floats(0, 1), axis=VECTOR, angle=st.floats(0, 0.5))
def test_between_neighbours(a: np.ndarray, share: float, axis: np.ndarray, angle: float) -> None:
    """Straight lines between near attitudes lie on SciPy's arcs."""
    length = float(np.linalg.norm(axis))
    step = Rotation.from_rotvec(axis / length * angle if length > 1e-3 else [0, 0, 0])
    b = np.roll((scipy_of(a) * step).as_quat(), 1)
    arc = Slerp([0, 1], Rotation.concatenate([scipy_of(a), scipy_of(b)]))
    expected = np.roll(arc(share).as_quat(), 1)
    assert q4.angle_between(q4.between(share, a, -b), expected) < np.radians(0.1)


def test_east() -> None:
    """A body that has yawed by 90 degrees points its nose east, and nothing has no direction."""
    npt.assert_allclose(
        q4.turn_by(q4.quaternion_from_euler(0, 0, np.pi / 2), [1, 0, 0]), [0, 1, 0], atol=1e-12
    )
    assert np.isnan(q4.unit(np.zeros(4))).all()
