"""Alignment beside SciPy's, and on vectors whose rotation is known."""

from __future__ import annotations

import numpy as np
import numpy.testing as npt
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mavframecheck.geo import alignment
from mavframecheck.geo.permutations import PERMUTATIONS

SEED = st.integers(0, 2**32 - 1)


def cloud(seed: int, count: int = 60) -> np.ndarray:
    """Return vectors in all directions, more level than up."""
    return np.random.default_rng(seed).normal(0, [3.0, 2.0, 0.5], (count, 3))


@given(seed=SEED)
def test_rotation_as_scipy(seed: int) -> None:
    """Kabsch, with noise on both."""
    source = cloud(seed)
    turn = Rotation.random(random_state=seed)
    target = turn.apply(source) + cloud(seed + 1) * 0.05
    expected, _ = Rotation.align_vectors(target, source)
    npt.assert_allclose(alignment.rotation_between(source, target), expected.as_matrix(), atol=1e-6)


def test_never_a_mirror_image() -> None:
    """Mirrored vectors give the nearest rotation."""
    source = cloud(3)
    found = alignment.rotation_between(source, source * [1, 1, -1])
    npt.assert_allclose(np.linalg.det(found), 1)


@given(seed=SEED, yaw=st.floats(-3.1, 3.1))
def test_yaw(seed: int, yaw: float) -> None:
    """A turn about the vertical is found, whatever happens to heights."""
    source = cloud(seed)
    target = source @ alignment.yaw_matrix(yaw).T
    target[:, 2] = 7.0
    assert abs(np.angle(np.exp(1j * (alignment.yaw_between(source, target) - yaw)))) < 1e-9


@given(seed=SEED, which=st.integers(0, 47), scale=st.floats(1e-3, 1e3))
def test_linear(seed: int, which: int, scale: float) -> None:
    """The map of any permutation and scale, with every tenth vector torn off."""
    source = cloud(seed, 200)
    matrix = PERMUTATIONS[which] * scale
    target = source @ matrix.T
    target[::10] += 100 * scale
    found = alignment.linear_between(source, target, 200)
    npt.assert_allclose(found.matrix / scale, PERMUTATIONS[which], atol=0.35)


def test_what_did_not_move_is_not_known() -> None:
    """Vectors on a plane say nothing about the direction across."""
    source = cloud(5) * [1, 1, 0]
    found = alignment.linear_between(source, source + cloud(6) * 0.01, 60)
    assert found.moved[2] < 1e-6
    assert found.moved[1] > 1
    assert found.error[2] > 1 > found.error[0]
    assert found.explained > 0.99
