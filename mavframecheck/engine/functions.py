"""The functions that expressions may call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mavframecheck.geo.geodesy import bearing_deg, distance_m
from mavframecheck.semantics.names import FAMILY_NAMES

FIELD_FUNCTIONS = frozenset(
    {
        "raw",
        "optional",
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
        "takes",
        "reference",
        "groups_used",
        "used_zero",
        "ignored_given",
    }
)
"""Functions of a field, by name; `vehicle.rows` answers them.

raw: as on the wire (optional: NaN in a message that has no such field); si: in SI by the catalogue (latitude and longitude in degrees); used, ignored: by the
field's own ignore bit; unknown: a sentinel that says "not known" (any_unknown: in any element; any_nan:
any element is NaN, and that is no sentinel);
undefined: the bits of a mask, or the value of an enumeration, that the standard does not define; present: given by the sender (extension
fields); diagonal: (n, k) variances of a covariance; correlation: (n,) the largest squared correlation of a
covariance, above 1 when it is none; words: for texts, what a mask, frame or enumeration value means.
Of the field that holds the MAV_FRAME, by what the autopilot that the row is about does with it (acceptance
data): does: obeyed, misread, refused, ignored, stops or unknown; does_surely: whether every version that could
be meant does so; answer_to: what it says; note_on: what there is to know; takes: the frames that it obeys.
reference: what a height is measured from, in the words of `AltRef` (msl, home, terrain, ellipsoid...): by its
catalogue entry, by the selector in the same row, else by what the autopilot takes it for.
Of a mask: groups_used: how many groups of fields it lets count (position, velocity, rates...); used_zero:
whether all that it lets count is exactly zero; ignored_given: whether it ignores groups as a whole and each of
them holds something.
In a message that has no such field (COMMAND_LONG has no frame), these say what becomes of it as it is.
"""


def some(column: Any) -> Any:
    """Return (n,) whether any element of each row of an array field holds."""
    return np.any(column, axis=-1)


def every(column: Any) -> Any:
    """Return (n,) whether all elements of each row of an array field hold."""
    return np.all(column, axis=-1)


def extent(column: Any) -> Any:
    """Return (n,) how many elements of each row there are up to the last one that holds."""
    column = np.asarray(column)
    from_the_end = np.argmax(column[..., ::-1], axis=-1)
    return np.where(np.any(column, axis=-1), column.shape[-1] - from_the_end, 0)


def smallest(column: Any) -> Any:
    """Return (n,) the smallest element of each row, NaN only where all are."""
    return np.fmin.reduce(column, axis=-1)


def norm(column: Any) -> Any:
    """Return (n,) the Euclidean length of each row of an array field."""
    return np.sqrt(np.sum(np.square(column), axis=-1))


def float32_step(value: Any) -> Any:
    """Return the distance from a number to the next larger 32-bit float, in the unit of the number."""
    return np.spacing(np.abs(value).astype(np.float32)).astype(np.float64)


def power_of_ten(ratio: Any) -> Any:
    """Return the power of ten nearest to a positive number: 1000 for 870, 0.1 for 0.12; NaN for no such number."""
    return np.where(ratio > 0, 10.0 ** np.round(np.log10(ratio)), np.nan)


def undulation(lat: Any, lon: Any) -> Any:
    """Return the height of the geoid above the ellipsoid (EGM96), m, at positions in degrees."""
    from mavframecheck.geo.geoid import undulation as of_geoid  # the grid is read when asked for

    return of_geoid(lat, lon)


def outside(value: Any, one: Any, other: Any) -> Any:
    """Return how far a number lies outside the stretch between two others, 0 within; one may be NaN."""
    low, high = np.fmin(one, other), np.fmax(one, other)
    return np.maximum(np.maximum(low - value, value - high), 0.0)


def least(*named: Any) -> Any:
    """Return the name whose number is least: ``least('home', 3.0, 'sea level', 480.0)`` is ``home``.

    NaN never wins; of equals the first one does. Empty where all are NaN.
    """
    names, numbers = named[::2], np.broadcast_arrays(*(np.asarray(n, float) for n in named[1::2]))
    stacked = np.where(np.isnan(numbers), np.inf, numbers)
    best = np.array(names)[np.argmin(stacked, axis=0)]
    return np.where(np.isnan(numbers).all(axis=0), "", best)


def wrap_pi(angle: Any) -> Any:
    """Return an angle in -pi..pi, rad."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def called(family: Any) -> Any:
    """Return what people call an autopilot family (``PX4``); ``the autopilot`` where it is not known."""
    names = [FAMILY_NAMES.get(word, "the autopilot") for word in np.ravel(family).tolist()]
    return np.array(names).reshape(np.shape(family))


def rounded(value: Any, digits: int = 0) -> Any:
    """Return numbers rounded to `digits` decimals, halves to the even one."""
    return np.round(value, int(digits))


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
    "round": rounded,
    "sin": np.sin,
    "cos": np.cos,
    "degrees": np.degrees,
    "radians": np.radians,
    "isnan": np.isnan,
    "isfinite": np.isfinite,
    "some": some,
    "every": every,
    "extent": extent,
    "smallest": smallest,
    "norm": norm,
    "distance_m": distance_m,
    "bearing_deg": bearing_deg,
    "undulation": undulation,
    "outside": outside,
    "least": least,
    "called": called,
    "fixed": fixed,
    "float32_step": float32_step,
    "power_of_ten": power_of_ten,
}
