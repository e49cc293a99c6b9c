"""How far beside the vehicle's point of reference a stream measures: the part of its way that turns with the attitude.

A sensor `arm` (m, forward-right-down) beside that point goes ``R(attitude) @ arm`` where the vehicle goes nothing.
Level steps of both over the same seconds are compared, so that neither origins nor slow drift matter. What a delay, a
scale and a heading that are a little off leave is fitted along: each looks like an arm where the vehicle flies in one
manner only. So does an arm down or up, which shows in tilts alone, and these come with every acceleration: it is
fitted, too, and never told.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion import axes
from mavframecheck.checks.motion.series import Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.alignment import Solution, robust_solution, trimmed_rms

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

SPAN_S = 2.0
"""Steps are taken over this time, s: a vehicle turns far in it, and an estimate drifts little."""
SPEED_S = 0.6
"""Speeds are taken over this time, s."""
MIN_TURN = np.radians(20.0)
"""A step tells of an arm where the attitude turns by more than this, rad, ..."""
MIN_TURNING_S = 6.0
"""... and so long must there be such steps, s."""
SURE = 5.0
"""An arm is so many times longer than its standard error, ..."""
CLEAR = 2.0
"""... so many times longer than what is left of the steps, ..."""
CLEARLY = 0.6
"""... and leaves less than this share of what is left without it."""
SAME = 0.35
"""Both halves of the turning say the same arm, but for this share of it."""
_LEVEL, _NO_ARM = slice(0, 2), slice(3, None)
"""Unknowns: arm forward and right; all but the arm."""


class Lever(NamedTuple):
    """The arm from the vehicle's point of reference to where a stream measures."""

    arm: Floats
    """(2,) m forward and right."""
    error_m: float
    """Its standard error."""
    left_m: float
    """Root mean square of what is left of level steps while the vehicle turns, ..."""
    labelled_m: float
    """... and the same without an arm."""
    seconds: float
    """How long it turned."""
    steady: bool
    """Whether both halves of the turning say the same arm."""

    @property
    def length_m(self) -> float:
        """Return how long the arm is, level."""
        return float(np.linalg.norm(self.arm))

    @property
    def shows_m(self) -> float:
        """Return how long an arm must be to show."""
        return max(SURE * self.error_m, CLEAR * self.left_m)

    @property
    def there(self) -> bool:
        """Return whether there is one beyond doubt."""
        clear = self.length_m >= self.shows_m and self.left_m <= CLEARLY * self.labelled_m
        return clear and self.steady

    @property
    def says(self) -> str:
        """Return the arm in words, without a part that is none: ``0.45 m forward and 0.10 m left``."""
        names = (("forward", "back"), ("right", "left"))
        told = max(0.05, 3 * self.error_m)
        parts = zip(self.arm.tolist(), names, strict=True)
        return " and ".join(f"{abs(m):.2f} m {name[m < 0]}" for m, name in parts if abs(m) >= told)


class Steps(NamedTuple):
    """Equations of level steps: ``columns @ unknowns = further``."""

    at: Floats
    """(n,) receive time, s."""
    columns: Floats
    """(n, 2, 6): of the arm (3), of a delay in s, of a scale, of a heading in rad."""
    further: Floats
    """(n, 2) how much further than the vehicle the stream went, m north and east."""
    turning: Bools
    """(n,) whether the attitude turned meanwhile."""
    grid_s: float

    def solved(self, rows: Bools | slice = slice(None), unknowns: slice = slice(None)) -> Solution:
        """Return the unknowns that fit some of the steps best."""
        further = self.further[rows]
        independent = len(further) * min(1.0, self.grid_s / SPAN_S)
        return robust_solution(self.columns[rows][:, :, unknowns], further, independent)

    def left(self, unknowns: slice = slice(None)) -> float:
        """Return what some of the unknowns leave of the steps in which the vehicle turns, m."""
        said = self.columns[:, :, unknowns] @ self.solved(unknowns=unknowns).values
        return trimmed_rms(np.linalg.norm(self.further - said, axis=1)[self.turning], 0.97)


def compare(stream: Series, place: Series, lies: Series, fit: axes.Fit) -> Lever | str:
    """Say how far beside `place` (NED) a stream measures, or why that cannot be told.

    `lies` is the attitude of the vehicle; the axes of the stream, and its delay, are those of `fit`.
    """
    steps = steps_of(stream, place, lies, fit)
    seconds = float(np.count_nonzero(steps.turning) * steps.grid_s)
    if seconds < MIN_TURNING_S:
        return "the vehicle hardly turns while both are heard"
    whole = steps.solved()
    arm, errors = whole.values[_LEVEL], whole.errors[_LEVEL]
    first: Bools = np.cumsum(steps.turning) <= np.count_nonzero(steps.turning) / 2
    apart = steps.solved(first).values[_LEVEL] - steps.solved(~first).values[_LEVEL]
    steady = bool(np.linalg.norm(apart) <= SAME * np.linalg.norm(arm))
    without = steps.left(_NO_ARM)
    return Lever(arm, float(np.linalg.norm(errors)), steps.left(), without, seconds, steady)


def steps_of(stream: Series, place: Series, lies: Series, fit: axes.Fit) -> Steps:
    """Return the equations of the steps of which everything is known."""
    at, grid_s = axes.grid(stream.t)
    begin, end = (at - fit.delay_s + half for half in (-SPAN_S / 2, SPAN_S / 2))
    went = place.steps((begin + end) / 2, SPAN_S)[:, :2]
    further = (stream.steps(at, SPAN_S) @ fit.matrix)[:, :2] - went
    slower = (place.steps(begin, SPEED_S) - place.steps(end, SPEED_S))[:, :2] / SPEED_S
    before, after = lies.attitudes(begin), lies.attitudes(end)
    turned = q4.matrix_from_quaternion(after) - q4.matrix_from_quaternion(before)
    aside = np.column_stack((-went[:, 1], went[:, 0]))
    columns = np.concatenate((turned[:, :2], np.stack((slower, went, aside), axis=-1)), axis=-1)
    known = np.isfinite(columns).all(axis=(1, 2)) & np.isfinite(further).all(axis=1)
    turning = q4.angle_between(before, after)[known] > MIN_TURN
    return Steps(at[known], columns[known], further[known], turning, grid_s)
