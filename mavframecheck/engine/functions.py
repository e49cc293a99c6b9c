"""The functions that expressions may call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mavframecheck.geo.geodesy import bearing_deg, distance_m

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
        "does",
        "does_surely",
        "answer_to",
        "note_on",
    }
)
"""Functions of a field, by name; `engine.rows` answers them.

raw: as on the wire; si: in SI by the catalogue (latitude and longitude in degrees); used, ignored: by the
field's own ignore bit; unknown: a sentinel that says "not known" (any_unknown: in any element; any_nan:
any element is NaN, and that is no sentinel);
undefined: the bits of a mask, or the value of an enumeration, that the standard does not define; present: given by the sender (extension
fields); diagonal: (n, k) variances of a covariance; correlation: (n,) the largest squared correlation of a
covariance, above 1 when it is none; words: for texts, what a mask, frame or enumeration value means.
Of the field that holds the MAV_FRAME, by what the autopilot that the row is about does with it (acceptance
data): does: obeyed, misread, refused, ignored, stops or unknown; does_surely: whether every version that could
be meant does so; answer_to: what it says; note_on: what there is to know.
"""


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


def undulation(lat: Any, lon: Any) -> Any:
    """Return the height of the geoid above the ellipsoid (EGM96), m, at positions in degrees."""
    from mavframecheck.geo.geoid import undulation as of_geoid  # the grid is read when asked for

    return of_geoid(lat, lon)


def wrap_pi(angle: Any) -> Any:
    """Return an angle in -pi..pi, rad."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def fixed(value: Any, digits: int) -> Any:
    """Return numbers as texts with `digits` decimals, for texts of findings."""
    flat = [f"{number:.{int(digits)}f}" for number in np.ravel(value).tolist()]
    return np.array(flat).reshape(np.shape(value))


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "sqrt": np.sqrt,
    "hypot": np.hypot,
    "arctan2": np.arctan2,
    "wrap_pi": wrap_pi,
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
    "distance_m": distance_m,
    "bearing_deg": bearing_deg,
    "undulation": undulation,
    "fixed": fixed,
    "float32_step": float32_step,
}
