"""The 48 ways in which three axes may hold north, east and down: 24 turns, 24 with a mirror in them.

Each is a matrix P with one +1 or -1 in every row and column, ``v_stream = P @ v_ned``: row i says what
axis i of a stream holds.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

AXES = ("x", "y", "z")
_HELD = (("North", "South"), ("East", "West"), ("Down", "Up"))
_KNOWN = {
    "NED": "north-east-down",
    "ENU": "ENU",
    "NWU": "north-west-up (FLU)",
    "NEU": "NED with z up",
    "END": "x and y exchanged",
}


def signed_permutations() -> Floats:
    """Return (48, 3, 3) all of them; the first one is the identity."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            found.append(matrix)
    return np.array(found)


PERMUTATIONS = signed_permutations()
QUARTER_TURNS: Floats = np.array(
    [
        [[c, -s, 0], [s, c, 0], [0, 0, 1]]
        for c, s in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    ]
)
"""(4, 3, 3) turns about the vertical by 0, 90, 180 and 270 degrees."""


def _classes() -> Floats:
    """Return (12, 3, 3) one permutation for all that a turn about the vertical makes of it."""
    found: list[Floats] = []
    for matrix in PERMUTATIONS:
        family = matrix @ QUARTER_TURNS
        if not any((each == family).all(axis=(1, 2)).any() for each in found):
            found.append(family[np.argmax(np.trace(family, axis1=1, axis2=2))])
    return np.array(found)


CLASSES = _classes()
"""(12, 3, 3): what is left to tell where the heading of a frame is free; the first one is the identity."""


class AxisWords(NamedTuple):
    """A permutation in words."""

    held: tuple[str, str, str]
    """What x, y and z hold: ``East``, ``North``, ``Up``..."""
    name: str
    """``ENU``, ``north-west-up (FLU)``, or the letters."""
    mirrored: bool

    @property
    def sentence(self) -> str:
        """Return ``x holds East, y holds North, z is up``."""
        return ", ".join(_says(axis, what) for axis, what in zip(AXES, self.held, strict=True))


def _says(axis: str, what: str) -> str:
    return f"{axis} is {what.lower()}" if what in _HELD[2] else f"{axis} holds {what}"


def held_by(row: npt.ArrayLike) -> str:
    """Return what an axis holds whose row of a permutation is `row`, (3,)."""
    values = np.asarray(row, float)
    column = int(np.argmax(np.abs(values)))
    return _HELD[column][int(values[column] < 0)]


def words(permutation: npt.ArrayLike) -> AxisWords:
    """Return a signed permutation, (3, 3), in words."""
    matrix = np.asarray(permutation, float)
    held = (held_by(matrix[0]), held_by(matrix[1]), held_by(matrix[2]))
    letters = "".join(what[0] for what in held)
    return AxisWords(held, _KNOWN.get(letters, letters), bool(np.linalg.det(matrix) < 0))


def shared_words(permutations: Floats) -> str:
    """Return what several permutations, (k, 3, 3), agree about: ``y holds North, z is up``; may be empty."""
    same = (permutations == permutations[0]).all(axis=(0, 2))
    rows = permutations[0]
    return ", ".join(_says(AXES[i], held_by(rows[i])) for i in range(3) if same[i])


def nearest(matrix: npt.ArrayLike) -> Floats:
    """Return (3, 3) the signed permutation nearest to a matrix."""
    overlap = np.einsum("kij,ij->k", PERMUTATIONS, np.asarray(matrix, float))
    found: Floats = PERMUTATIONS[int(np.argmax(overlap))]
    return found
