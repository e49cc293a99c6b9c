"""The cases of a distortion, and what must be said of each: worked out here, not by the judge's own words."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from benchmarks.injection.plan import Distortion

_HELD = (("North", "South"), ("East", "West"), ("down", "up"))


class Case(NamedTuple):
    """A distortion with one value, of one stream."""

    distortion: Distortion
    set: dict[str, str]
    value: float
    codes: tuple[str, ...]
    says: str
    held: Mapping[str, str] = MappingProxyType({})
    """Field -> what it holds, where axes are permuted."""

    @property
    def name(self) -> str:
        """What is done, with the value."""
        if self.distortion.permute:
            return f"{self.distortion.name}: {', '.join(self.set.values())}"
        return self.distortion.name + (f" {self.value:g}" if self.distortion.values else "")


def cases(distortion: Distortion) -> Iterator[Case]:
    """Yield the cases of a distortion."""
    if distortion.permute is not None:
        yield from _permutations(distortion, distortion.permute)
        return
    for value in distortion.values or (0.0,):
        says = distortion.says.replace("{k}", f"{value:g}")
        yield Case(distortion, distortion.set, value, distortion.codes, says)


def _permutations(distortion: Distortion, fields: tuple[str, str, str]) -> Iterator[Case]:
    """Yield every wrong order and sign of three fields, with the code and the words that it must get."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            codes, says = _answer(matrix, fields, free=distortion.free_heading)
            if codes:
                values = [f"{'-' * (sign < 0)}{fields[k]}" for k, sign in zip(order, signs)]
                held = {name: _HELD[k][sign < 0] for name, k, sign in zip(fields, order, signs)}
                yield Case(distortion, dict(zip(fields, values)), 0.0, (codes,), says, held)


def _answer(
    matrix: npt.NDArray[np.float64], fields: tuple[str, str, str], *, free: bool
) -> tuple[str, str]:
    """Return the code and the words for axes `matrix`, stream from NED; none where they are right."""
    z_up = matrix[2, 2] < 0
    proper = np.linalg.det(matrix) > 0
    if not matrix[2, 2]:
        return "MFC401", _held(matrix, fields, (2,) if free else (0, 1, 2))
    only_z = z_up and not proper and (free or matrix[0, 0] > 0 < matrix[1, 1])
    if only_z:
        return "MFC402", f"{fields[2]} grows when the vehicle climbs"
    if free:
        if proper and not z_up:
            return "", ""
        return "MFC401", f"to the left of {fields[0]}, {_held(matrix, fields, (2,))}"
    if proper and not z_up:
        points = round(np.degrees(np.arctan2(matrix[0, 1], matrix[0, 0])))
        side = {90: "clockwise", -90: "counter-clockwise"}.get(points, "(counter-)?clockwise")
        about = "(8[5-9]|9[0-5])" if abs(points) == 90 else "1(7[5-9]|80)"
        return ("MFC403", f"by {about} degrees {side}") if points else ("", "")
    return "MFC401", _held(matrix, fields, (0, 1, 2))


def _held(
    matrix: npt.NDArray[np.float64], fields: tuple[str, str, str], axes: tuple[int, ...]
) -> str:
    words = []
    for axis in axes:
        column = int(np.flatnonzero(matrix[axis])[0])
        words.append(
            f"{fields[axis]} (is|holds) (?i:{_HELD[column][int(matrix[axis, column] < 0)]})"
        )
    return ", ".join(words)
