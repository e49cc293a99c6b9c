"""Rotations named `target_from_source`: matrices that turn a vector's components, never its place.

``v_target = target_from_source @ v_source``. Angles are radians unless a name says degrees; shapes
are (..., 3, 3), and arguments may have any shapes that broadcast to one another.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

ENU_FROM_NED: Floats = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
"""Its own inverse: east and north change places, up is minus down."""
FLU_FROM_FRD: Floats = np.diag([1.0, -1, -1])
"""Its own inverse: left is minus right, up is minus down."""


def ned_from_ecef(lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike) -> Floats:
    """Return (..., 3, 3): the rows are north, east and down at a place, written in ECEF.

    `lat_deg` is geodetic, so that down is along the normal of the ellipsoid. At a pole, where every
    direction is south or north, longitude decides.
    """
    lat, lon = np.broadcast_arrays(np.radians(lat_deg), np.radians(lon_deg))
    s, c, sl, cl = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    zero = np.zeros_like(s)
    return _matrix([[-s * cl, -s * sl, c], [-sl, cl, zero], [-c * cl, -c * sl, -s]])


def ned_from_frd(roll: npt.ArrayLike, pitch: npt.ArrayLike, yaw: npt.ArrayLike) -> Floats:
    """Return (..., 3, 3): attitude from roll, pitch and yaw in ZYX order, yaw clockwise from north.

    ``Rz(yaw) @ Ry(pitch) @ Rx(roll)``: a body that has yawed by +90 degrees points its nose east.
    """
    r, p, y = np.broadcast_arrays(*(np.asarray(a, float) for a in (roll, pitch, yaw)))
    sr, cr, sp, cp, sy, cy = np.sin(r), np.cos(r), np.sin(p), np.cos(p), np.sin(y), np.cos(y)
    return _matrix(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


def wrapped(angle: npt.ArrayLike) -> Floats:
    """Return (...) angles, rad, between -pi (included) and pi."""
    turned: Floats = (np.asarray(angle, float) + np.pi) % (2 * np.pi) - np.pi
    return turned


def wrapped_deg(angle: npt.ArrayLike) -> Floats:
    """Return (...) angles, or differences of longitudes, deg, between -180 (included) and 180."""
    turned: Floats = (np.asarray(angle, float) + 180) % 360 - 180
    return turned


def is_rotation(matrix: npt.ArrayLike, tolerance: float = 1e-6) -> npt.NDArray[np.bool_]:
    """Return (...) whether (..., 3, 3) matrices are rotations: orthonormal, and no reflection."""
    m = np.asarray(matrix, float)
    near = np.abs(m @ np.swapaxes(m, -1, -2) - np.eye(3)).max(axis=(-1, -2)) <= tolerance
    return np.asarray(near & (np.linalg.det(np.where(np.isfinite(m), m, 0.0)) > 0))


def turn(target_from_source: npt.ArrayLike, vectors: npt.ArrayLike) -> Floats:
    """Return (..., 3) `vectors` in the target's axes."""
    matrices, columns = np.asarray(target_from_source, float), np.asarray(vectors, float)
    turned: Floats = np.einsum("...ij,...j->...i", matrices, columns)
    return turned


def turn_covariance(target_from_source: npt.ArrayLike, covariances: npt.ArrayLike) -> Floats:
    """Return (..., 3, 3) `covariances` in the target's axes: ``R P R^T``."""
    r = np.asarray(target_from_source, float)
    turned: Floats = r @ np.asarray(covariances, float) @ np.swapaxes(r, -1, -2)
    return turned


def _matrix(rows: list[list[Floats]]) -> Floats:
    """Return (..., 3, 3) from nine columns of one shape."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
