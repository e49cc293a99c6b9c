"""Covariances as messages carry them: flattened, in four layouts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def squared_correlation(flat: Floats, diagonal: tuple[int, ...]) -> Floats:
    """Return (n,) the largest ``c_ij^2 / (c_ii c_jj)`` of each covariance, NaN where none can be formed.

    `flat` is (n, k): an upper-right triangle or a full matrix, row by row, with its variances at
    `diagonal`. A covariance has no value above 1 (Cauchy-Schwarz); infinity stands for a correlation with
    something that has no variance. Elements that are NaN are left out.
    """
    rows, columns, places = _off_diagonal(flat.shape[1], diagonal)
    if not len(places):
        return np.full(len(flat), np.nan)
    variances = flat[:, list(diagonal)]
    with np.errstate(all="ignore"):
        product = variances[:, rows] * variances[:, columns]
        square = np.square(flat[:, places])
        ratio = np.where((product > 0) | (square > 0), square / np.maximum(product, 0), np.nan)
    largest: Floats = np.fmax.reduce(ratio, axis=1)
    return largest


def _off_diagonal(
    size: int, diagonal: tuple[int, ...]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return row, column and flat place of every off-diagonal element of a layout of `size` numbers."""
    order = len(diagonal)
    pairs = [
        (i, j) for i in range(order) for j in range(order) if (i < j if size < order**2 else i != j)
    ]
    if size == order:
        pairs = []
    full = size == order**2
    places = [i * order + j if full else diagonal[i] + j - i for i, j in pairs]
    i, j = zip(*pairs, strict=True) if pairs else ((), ())
    return np.array(i, np.int64), np.array(j, np.int64), np.array(places, np.int64)
