"""The 48 signed permutations, and their words."""

from __future__ import annotations

import numpy as np
import pytest

from mavframecheck.geo import permutations
from mavframecheck.geo.rotations import ENU_FROM_NED, FLU_FROM_FRD


def test_all_of_them() -> None:
    """There are 48, all different, orthonormal; half of them are rotations."""
    found = permutations.PERMUTATIONS
    assert len({each.tobytes() for each in found + 0.0}) == 48
    assert np.allclose(found @ found.transpose(0, 2, 1), np.eye(3))
    assert np.count_nonzero(np.linalg.det(found) > 0) == 24
    assert np.array_equal(found[0], np.eye(3))


def test_classes() -> None:
    """With a free heading twelve are left, the identity first, and together they make all 48."""
    made = {
        (each @ turn + 0.0).tobytes()
        for each in permutations.CLASSES
        for turn in permutations.QUARTER_TURNS
    }
    assert len(permutations.CLASSES) == 12
    assert len(made) == 48
    assert np.array_equal(permutations.CLASSES[0], np.eye(3))


@pytest.mark.parametrize(
    ("matrix", "sentence", "name", "mirrored"),
    [
        (np.eye(3), "x holds North, y holds East, z is down", "north-east-down", False),
        (ENU_FROM_NED, "x holds East, y holds North, z is up", "ENU", False),
        (FLU_FROM_FRD, "x holds North, y holds West, z is up", "north-west-up (FLU)", False),
        (np.diag([1.0, 1, -1]), "x holds North, y holds East, z is up", "NED with z up", True),
    ],
)
def test_words(matrix: np.ndarray, sentence: str, name: str, *, mirrored: bool) -> None:
    """What people read."""
    found = permutations.words(matrix)
    assert (found.sentence, found.name, found.mirrored) == (sentence, name, mirrored)


def test_every_one_has_its_own_words() -> None:
    """No two permutations read the same."""
    sentences = {permutations.words(each).sentence for each in permutations.PERMUTATIONS}
    assert len(sentences) == 48


def test_shared_words() -> None:
    """Only what all agree about is said."""
    both = np.array([ENU_FROM_NED, np.diag([1.0, 1, -1])])
    assert permutations.shared_words(both) == "z is up"


def test_nearest() -> None:
    """A permutation that is a little off is found again."""
    generator = np.random.default_rng(1)
    for each in permutations.PERMUTATIONS:
        assert np.array_equal(permutations.nearest(each + generator.normal(0, 0.2, (3, 3))), each)
