"""How one set of vectors lies against another: turned, mirrored, stretched. Least squares in closed form.

Vectors come as rows, (n, 3), of two streams at the same moments; results are named
`target_from_source`. Rows with NaN must have been left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_ROUNDS = 5
_HUBER = 2.5
"""Rows off by more than this many times the usual count less (P. Huber, 1964)."""

_FIRM = 1e-9
"""Unknowns that rows do not tell apart are held at nothing by this share of what they tell."""
_LEAST_NOISE = 1e-3
"""Nothing is measured better, m."""


def yaw_between(source: npt.ArrayLike, target: npt.ArrayLike) -> float:
    """Return the turn about z, rad, that brings `source` nearest to `target`, both (n, 2 or 3)."""
    a, b = np.asarray(source, float), np.asarray(target, float)
    across = np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    along = np.sum(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])
    return float(np.arctan2(across, along))


def yaw_matrix(angle: float) -> Floats:
    """Return (3, 3) the turn about z by `angle`, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def rotation_between(source: npt.ArrayLike, target: npt.ArrayLike) -> Floats:
    """Return (3, 3) the rotation that brings `source` nearest to `target`, both (n, 3).

    Never a mirror image. Vectors along one line leave the turn about it open. Source: W. Kabsch (1976).
    """
    u, _, vt = np.linalg.svd(np.asarray(target, float).T @ np.asarray(source, float))
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation: Floats = u @ proper @ vt
    return rotation


class Linear(NamedTuple):
    """``target = matrix @ source``, as the rows tell it."""

    matrix: Floats
    """(3, 3)."""
    axes: Floats
    """(3, 3) columns: directions of the source, from the most moved to the least."""
    moved: Floats
    """(3,) root mean square of the source along each."""
    error: Floats
    """(3,) standard error of the image of a unit vector along each."""
    explained: float
    """Share of the target's motion that it explains, 0..1."""


def linear_between(source: Floats, target: Floats, independent: float) -> Linear:
    """Return the linear map that brings `source` nearest to `target`, both (n, 3), robustly.

    Of the rows, that may overlap, only so many are `independent`: it sets the errors.
    """
    weight = np.ones(len(source))
    for _ in range(_ROUNDS):
        moment = (source * weight[:, np.newaxis]).T @ source
        cross = (target * weight[:, np.newaxis]).T @ source
        matrix = cross @ np.linalg.pinv(moment, rcond=1e-9, hermitian=True)
        off = np.linalg.norm(target - source @ matrix.T, axis=1)
        usual = max(float(np.median(off)) * _HUBER, 1e-9)
        weight = np.minimum(1.0, usual / np.maximum(off, 1e-12))
    total = float(weight.sum())
    values, axes = np.linalg.eigh(moment / total)
    moved = np.sqrt(np.maximum(values[::-1], 0.0))
    noise = float(np.sqrt((weight * off**2).sum() / total))
    size = float((weight * np.square(target).sum(axis=1)).sum() / total)
    error = noise / (np.maximum(moved, 1e-9) * np.sqrt(max(independent, 1.0)))
    return Linear(matrix, axes[:, ::-1], moved, error, 1 - noise**2 / size if size > 0 else 0.0)


class Solution(NamedTuple):
    """Unknowns of ``columns @ unknowns = target``, as the rows tell them."""

    values: Floats
    """(k,)."""
    errors: Floats
    """(k,) standard errors."""


def robust_solution(columns: Floats, target: Floats, independent: float) -> Solution:
    """Return the unknowns that bring (n, d, k) `columns` nearest to (n, d) `target`, robustly.

    Of the n rows, that may overlap, only so many are `independent`: it sets the errors. Unknowns that the rows do not
    tell apart have large ones.
    """
    weight = np.ones(len(target))
    for _ in range(_ROUNDS):
        moment = np.einsum("n,ndi,ndj->ij", weight, columns, columns)
        inverse = np.linalg.inv(moment + _FIRM * np.diag(np.diagonal(moment) + 1.0))
        values = inverse @ np.einsum("n,ndi,nd->i", weight, columns, target)
        off = np.linalg.norm(target - columns @ values, axis=1)
        usual = max(float(np.median(off)) * _HUBER, 1e-9)
        weight = np.minimum(1.0, usual / np.maximum(off, 1e-12))
    total = float(weight.sum())
    noise = max(float((weight * off**2).sum() / total) / target.shape[1], _LEAST_NOISE**2)
    share = max(total / max(independent, 1.0), 1.0)
    return Solution(values, np.sqrt(np.diagonal(inverse) * noise * share))


def trimmed_rms(off: Floats, share: float = 0.9) -> float:
    """Return the root mean square of the smallest `share` of the lengths `off`, (n,)."""
    kept = np.sort(off)[: max(1, round(share * len(off)))]
    return float(np.sqrt(np.mean(np.square(kept)))) if len(off) else float("nan")
