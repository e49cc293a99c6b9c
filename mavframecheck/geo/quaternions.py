"""Unit quaternions, w first, named `target_from_source` like the matrices of `rotations`.

Shapes are (..., 4) and broadcast to one another; angles are radians. `q` and ``-q`` are one rotation.
Formulas: J. Diebel, Representing Attitude (2006); where his are for the inverse rotation, transposed.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

IDENTITY: Floats = np.array([1.0, 0, 0, 0])
_SHORTEST = 1e-12


def _elements(q: npt.ArrayLike) -> tuple[Floats, ...]:
    """Return w, x, y and z, each (...)."""
    given = np.asarray(q, float)
    return tuple(given[..., k] for k in range(4))


def unit(q: npt.ArrayLike) -> Floats:
    """Return (..., 4) quaternions of length 1; NaN where there is nothing to scale."""
    given = np.asarray(q, float)
    length = np.linalg.norm(given, axis=-1, keepdims=True)
    known = (length > _SHORTEST) & np.isfinite(length)
    scaled: Floats = given / np.where(known, length, np.nan)
    return scaled


def product(c_from_b: npt.ArrayLike, b_from_a: npt.ArrayLike) -> Floats:
    """Return (..., 4) `c_from_a`: first the right one turns, then the left one."""
    w1, x1, y1, z1 = _elements(c_from_b)
    w2, x2, y2, z2 = _elements(b_from_a)
    return np.stack(
        [
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ],
        axis=-1,
    )


def inverse(b_from_a: npt.ArrayLike) -> Floats:
    """Return (..., 4) `a_from_b` of unit quaternions."""
    turned: Floats = np.asarray(b_from_a, float) * np.array([1.0, -1, -1, -1])
    return turned


def quaternion_from_euler(roll: npt.ArrayLike, pitch: npt.ArrayLike, yaw: npt.ArrayLike) -> Floats:
    """Return (..., 4) `ned_from_frd` of angles in ZYX order: first yaw, then pitch, then roll.

    NaN where an angle is none.
    """
    halves = (np.asarray(a, float) / 2 for a in (roll, pitch, yaw))
    r, p, y = np.broadcast_arrays(*(np.where(np.isfinite(a), a, np.nan) for a in halves))
    sr, cr, sp, cp, sy, cy = np.sin(r), np.cos(r), np.sin(p), np.cos(p), np.sin(y), np.cos(y)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


def euler_from_quaternion(ned_from_frd: npt.ArrayLike) -> Floats:
    """Return (..., 3) roll, pitch and yaw, rad, of unit quaternions; at pitch +-90 only yaw - roll is told."""
    w, x, y, z = _elements(ned_from_frd)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)


def matrix_from_quaternion(target_from_source: npt.ArrayLike) -> Floats:
    """Return (..., 3, 3) the same rotation as a matrix."""
    w, x, y, z = _elements(target_from_source)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(target_from_source: npt.ArrayLike) -> Floats:
    """Return (..., 4) unit quaternions, w >= 0, of rotation matrices.

    The column of ``4 q q^T`` with the largest diagonal element: exact at every angle (Shepperd 1978).
    """
    m = np.asarray(target_from_source, float)
    a, b, c = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    wx, wy, wz = (m[..., i, j] - m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    xy, xz, yz = (m[..., i, j] + m[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
    outer = [
        [1 + a + b + c, wx, wy, wz],
        [wx, 1 + a - b - c, xy, xz],
        [wy, xy, 1 - a + b - c, yz],
        [wz, xz, yz, 1 - a - b + c],
    ]
    square = np.stack([np.stack(row, axis=-1) for row in outer], axis=-2)
    largest = np.argmax(np.diagonal(square, axis1=-2, axis2=-1), axis=-1)
    column = np.take_along_axis(square, largest[..., np.newaxis, np.newaxis], axis=-1)[..., 0]
    q = unit(column)
    return np.where(q[..., :1] < 0, -q, q)


def turn_by(target_from_source: npt.ArrayLike, vectors: npt.ArrayLike) -> Floats:
    """Return (..., 3) `vectors` in the target's axes."""
    q, v = np.asarray(target_from_source, float), np.asarray(vectors, float)
    axis, w = q[..., 1:], q[..., :1]
    twice = 2 * np.cross(axis, v)
    turned: Floats = v + w * twice + np.cross(axis, twice)
    return turned


def angle_between(a: npt.ArrayLike, b: npt.ArrayLike) -> Floats:
    """Return (...) the angle, rad in 0..pi, by which two attitudes differ."""
    w, *xyz = _elements(product(inverse(a), b))
    angle: Floats = 2 * np.arctan2(np.sqrt(sum(np.square(each) for each in xyz)), np.abs(w))
    return angle


def twist(rotation: npt.ArrayLike) -> Floats:
    """Return (...) how far rotations turn about z, rad: the angle that leaves the least of them behind."""
    q = np.asarray(rotation, float)
    angle: Floats = 2 * np.arctan2(q[..., 3], q[..., 0])
    return np.arctan2(np.sin(angle), np.cos(angle))


def about_z(angle: npt.ArrayLike) -> Floats:
    """Return (..., 4) turns about z, clockwise seen from above where z is down."""
    half = np.asarray(angle, float) / 2
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def mean(rotations: npt.ArrayLike) -> Floats:
    """Return (4,) the rotation nearest to all (n, 4) of them, whatever their signs.

    The eigenvector of the largest eigenvalue of the sum of ``q q^T``. Source: F. L. Markley et al. (2007).
    """
    q = np.asarray(rotations, float)
    _, vectors = np.linalg.eigh(q.T @ q)
    found: Floats = vectors[:, -1] * (1.0 if vectors[0, -1] >= 0 else -1.0)
    return found


def between(share: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike) -> Floats:
    """Return (..., 4) attitudes a `share` (0..1) of the way from `a` to `b`, on the shorter way.

    The straight line between them, scaled: for neighbours 30 degrees apart it is 0.1 degrees off the arc.
    """
    first, second = np.asarray(a, float), np.asarray(b, float)
    part = np.asarray(share, float)[..., np.newaxis]
    near = np.where(np.sum(first * second, axis=-1, keepdims=True) < 0, -second, second)
    return unit(first * (1 - part) + near * part)
