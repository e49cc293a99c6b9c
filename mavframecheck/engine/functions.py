"""The functions that expressions may call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

FIELD_FUNCTIONS = frozenset(
    {
        "raw",
        "si",
        "used",
        "ignored",
        "unknown",
        "any_unknown",
        "any_nan",
        "undefined",
        "present",
        "quaternion",
        "diagonal",
        "correlation",
        "words",
    }
)
"""Functions of a field, by name; `engine.rows` answers them.

raw: as on the wire; si: in SI by the catalogue (latitude and longitude in degrees); used, ignored: by the
field's own ignore bit; unknown: a sentinel that says "not known" (any_unknown: in any element; any_nan:
any element is NaN, and that is no sentinel);
undefined: the bits of a mask, or the value of an enumeration, that the standard does not define; present: given by the sender (extension
fields); diagonal: (n, k) variances of a covariance; correlation: (n,) the largest squared correlation of a
covariance, above 1 when it is none; words: for texts, what a mask, frame or enumeration value means.
"""

EARTH_RADIUS_KM = 6371.0088


def distance_km(lat1: Any, lon1: Any, lat2: Any, lon2: Any) -> Any:
    """Return the great-circle distance, km, of positions in degrees, within 0.5 % of the ellipsoid's.

    Source: haversine formula on the mean sphere (IUGG R1).
    """
    phi1, phi2 = np.radians(lat1), np.radians(lat2)
    half = np.sin((phi2 - phi1) / 2) ** 2
    half = half + np.cos(phi1) * np.cos(phi2) * np.sin(np.radians(np.subtract(lon2, lon1)) / 2) ** 2
    return 2 * EARTH_RADIUS_KM * np.arcsin(np.sqrt(np.clip(half, 0, 1)))


def some(column: Any) -> Any:
    """Return (n,) whether any element of each row of an array field holds."""
    return np.any(column, axis=-1)


def every(column: Any) -> Any:
    """Return (n,) whether all elements of each row of an array field hold."""
    return np.all(column, axis=-1)


def smallest(column: Any) -> Any:
    """Return (n,) the smallest element of each row, NaN only where all are."""
    return np.fmin.reduce(column, axis=-1)


def norm(column: Any) -> Any:
    """Return (n,) the Euclidean length of each row of an array field."""
    return np.sqrt(np.sum(np.square(column), axis=-1))


def float32_step(value: Any) -> Any:
    """Return the distance from a number to the next larger 32-bit float, in the unit of the number."""
    return np.spacing(np.abs(value).astype(np.float32)).astype(np.float64)


def fixed(value: Any, digits: int) -> Any:
    """Return numbers as texts with `digits` decimals, for texts of findings."""
    flat = [f"{number:.{int(digits)}f}" for number in np.ravel(value).tolist()]
    return np.array(flat).reshape(np.shape(value))


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "sqrt": np.sqrt,
    "round": np.round,
    "sin": np.sin,
    "cos": np.cos,
    "degrees": np.degrees,
    "radians": np.radians,
    "isnan": np.isnan,
    "isfinite": np.isfinite,
    "some": some,
    "every": every,
    "smallest": smallest,
    "norm": norm,
    "distance_km": distance_km,
    "fixed": fixed,
    "float32_step": float32_step,
}
