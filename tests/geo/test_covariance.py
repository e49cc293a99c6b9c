"""Covariances in the layouts of messages, against numpy's matrices and plain loops."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.geo.covariance import squared_correlation

Matrix = npt.NDArray[np.float64]
UPPER_6 = (0, 6, 11, 15, 18, 20)
UPPER_9 = (0, 9, 17, 24, 30, 35, 39, 42, 44)
FULL_3, FULL_6 = (0, 4, 8), (0, 7, 14, 21, 28, 35)


def upper(matrix: Matrix) -> list[float]:
    """Return the upper-right triangle, row by row, as MAVLink wants it."""
    order = len(matrix)
    return [float(matrix[i, j]) for i in range(order) for j in range(i, order)]


def covariance(seed: int, order: int) -> Matrix:
    """Return a random covariance: positive definite by its making."""
    root = np.random.default_rng(seed).normal(size=(order, order + 2))
    return np.asarray(root @ root.T)


def slow(matrix: Matrix) -> float:
    """Return the largest squared correlation by explicit loops."""
    largest = math.nan
    for i in range(len(matrix)):
        for j in range(len(matrix)):
            if i == j or math.isnan(matrix[i, j]):
                continue
            product, square = matrix[i, i] * matrix[j, j], matrix[i, j] ** 2
            if math.isnan(product) or (product <= 0 and square == 0):
                continue
            value = square / product if product > 0 else math.inf
            largest = value if math.isnan(largest) else max(largest, value)
    return largest


@pytest.mark.parametrize(("diagonal", "order"), [(UPPER_6, 6), (UPPER_9, 9)])
def test_the_diagonal_of_a_triangle(diagonal: tuple[int, ...], order: int) -> None:
    """The oracle of these tests: where variances stand when a matrix is flattened."""
    matrix = np.diag(np.arange(1.0, order + 1))
    flat = upper(matrix)
    assert [flat[k] for k in diagonal] == list(range(1, order + 1))


@given(st.integers(0, 2**31), st.sampled_from([6, 9]))
def test_triangles(seed: int, order: int) -> None:
    matrix = covariance(seed, order)
    diagonal = UPPER_6 if order == 6 else UPPER_9
    found = squared_correlation(np.array([upper(matrix)]), diagonal)
    assert found[0] == pytest.approx(slow(matrix))
    assert found[0] <= 1 + 1e-12
    assert np.linalg.eigvalsh(matrix).min() > 0


@given(st.integers(0, 2**31), st.sampled_from([3, 6]))
def test_full_matrices(seed: int, order: int) -> None:
    matrix = covariance(seed, order)
    diagonal = FULL_3 if order == 3 else FULL_6
    found = squared_correlation(matrix.reshape(1, -1), diagonal)
    assert found[0] == pytest.approx(slow(matrix))


@given(
    values=st.lists(st.floats(-10, 10, width=32) | st.just(math.nan), min_size=9, max_size=9),
)
def test_any_full_matrix(values: list[float]) -> None:
    """Also one that is no covariance: negative variances, NaN, zeros."""
    matrix = np.array(values).reshape(3, 3)
    found = squared_correlation(matrix.reshape(1, -1), FULL_3)[0]
    expected = slow(matrix)
    assert (math.isnan(found) and math.isnan(expected)) or found == pytest.approx(expected)


@given(st.integers(0, 2**31), st.floats(1.05, 3))
def test_beyond_one_means_no_covariance(seed: int, factor: float) -> None:
    """A correlation above 1 goes with a negative eigenvalue, by numpy."""
    matrix = covariance(seed, 3)
    limit = math.sqrt(matrix[0, 0] * matrix[1, 1])
    matrix[0, 1] = matrix[1, 0] = factor * limit
    assert squared_correlation(matrix.reshape(1, -1), FULL_3)[0] > 1
    assert np.linalg.eigvalsh(matrix).min() < 0


def test_correlation_with_something_that_does_not_vary() -> None:
    flat = np.zeros((1, 21))
    flat[0, [0, 1]] = [1.0, 0.5]
    assert squared_correlation(flat, UPPER_6)[0] == math.inf


def test_nothing_to_correlate() -> None:
    """Variances alone, zeros alone: no number, and no error."""
    assert math.isnan(squared_correlation(np.ones((1, 3)), (0, 1, 2))[0])
    assert math.isnan(squared_correlation(np.zeros((1, 21)), UPPER_6)[0])
    assert len(squared_correlation(np.zeros((0, 21)), UPPER_6)) == 0


def test_rows_do_not_mix() -> None:
    matrices = [covariance(seed, 6) for seed in range(20)]
    found = squared_correlation(np.array([upper(m) for m in matrices]), UPPER_6)
    assert found.tolist() == pytest.approx([slow(m) for m in matrices])
