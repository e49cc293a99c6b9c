"""What a vehicle did beside what it was asked for: holds of setpoints, and the motion that followed."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion import axes
from mavframecheck.checks.motion.holds import FIELDS, Hold
from mavframecheck.checks.motion.series import APART_M, Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.alignment import yaw_matrix
from mavframecheck.geo.rotations import wrapped
from mavframecheck.semantics.constants import constant

Floats = npt.NDArray[np.float64]

X, Y, Z, VX, VY, VZ, YAW, YAW_RATE = range(len(FIELDS))
BEGIN_S = 2.0
"""A velocity is reached by then, s after it is asked for."""
SHORTEST_S = 1.0
"""Over less than this, s, no velocity is measured."""
EDGE_S = 0.3
"""What is read so long before the next setpoint, s, is not yet its response."""
LONGEST_S = 60.0
"""So long after its last row, s, a place that was asked for may be reached."""
STOPS_S = 1.5
STOPS_SHARE = 0.3
"""A vehicle whose speed would take it less than this share of its way further in `STOPS_S` has arrived."""
RESTS_MPS = 0.5
"""So has one that is slower than this, m/s."""
STEADY = np.radians(15.0)
"""Its heading turns by less than this, rad, where that of a body frame or a yaw counts."""
MIN_SAMPLES = 3
"""So many setpoints are needed."""
MIN_ASKED = {"position": 3.0, "velocity": 0.5, "body velocity": 0.5}
"""A way below this, m, or a velocity below this, m/s, says nothing of axes."""
MIN_RATE = 0.1
"""A yaw rate below this, rad/s, says nothing of its sign."""
MIN_SPREAD = np.radians(60.0)
"""Yaws that were asked for lie this far apart, rad, where they tell an offset or a sign."""
WRONG, RIGHT = np.radians(25.0), np.radians(10.0)
"""A yaw is off by more than this, rad, as labelled, and by less than that as it is meant."""


def _bits(*names: str) -> int:
    return sum(constant(f"POSITION_TARGET_TYPEMASK.{name}_IGNORE") for name in names)


_PLACE, _VELOCITY = _bits("X", "Y", "Z"), _bits("VX", "VY", "VZ")
_YAW, _YAW_RATE = _bits("YAW"), _bits("YAW_RATE")
_NED = constant("MAV_FRAME.LOCAL_NED")
_OFFSET = constant("MAV_FRAME.LOCAL_OFFSET_NED")
_BODY = tuple(constant(f"MAV_FRAME.{n}") for n in ("BODY_NED", "BODY_OFFSET_NED", "BODY_FRD"))
_LOCAL = "SET_POSITION_TARGET_LOCAL_NED"


class Sample(NamedTuple):
    """What was asked for, and what was done."""

    what: str
    """``position``, ``velocity``, ``body velocity``, ``yaw`` or ``yaw rate``."""
    asked: Floats
    """(3,) NED or heading axes; or (1,) rad, rad/s."""
    done: Floats
    hold: Hold


class Motion(NamedTuple):
    """What a vehicle did."""

    place: Series
    attitude: Series | None
    rate: float
    """Seconds of the vehicle's clock per second of receive time."""

    def at(self, t: float) -> Floats:
        """Return (3,) where it was, m NED."""
        where: Floats = self.place.places(np.array([t]))[0]
        return where

    def velocity(self, start: float, stop: float) -> Floats:
        """Return (3,) its mean velocity, m/s of its own clock; NaN where it jumped meanwhile."""
        went = self.at(stop) - self.at(start)
        jumped = not np.abs(went).max() < APART_M / 2
        return np.full(3, np.nan) if jumped else went / ((stop - start) * self.rate)

    def yaws(self, start: float, stop: float) -> Floats:
        """Return (k,) its unwrapped yaw in a stretch of time, rad, ten times a second; nothing unless known."""
        if self.attitude is None:
            return np.zeros(0)
        lies = self.attitude.attitudes(np.arange(start, stop, 0.1))
        known: npt.NDArray[np.bool_] = np.asarray(np.isfinite(lies).all(axis=1))
        enough = np.count_nonzero(known) >= len(known) / 2
        return np.unwrap(q4.euler_from_quaternion(lies[known])[:, 2]) if enough else np.zeros(0)


def samples(hold: Hold, motion: Motion) -> Iterator[Sample]:
    """Yield what a hold shows."""
    end = min(hold.until_s - EDGE_S, hold.last_s)
    begin = max(hold.start_s + BEGIN_S / motion.rate, (hold.start_s + end) / 2)
    if end - begin >= SHORTEST_S / motion.rate:
        yield from _velocity(hold, motion, begin, end)
        yield from _turning(hold, motion, begin, end)
    if hold.message == _LOCAL and hold.frame == _NED and hold.mask & _PLACE == 0:
        yield from _arrival(hold, motion)


def _velocity(hold: Hold, motion: Motion, begin: float, end: float) -> Iterator[Sample]:
    asked, done = hold.wanted[VX : VZ + 1], motion.velocity(begin, end)
    alone = hold.mask & _VELOCITY == 0 and hold.mask & _PLACE == _PLACE
    if not alone or not np.isfinite(asked).all() or not np.isfinite(done).all():
        return
    if hold.message != _LOCAL or hold.frame in (_NED, _OFFSET):
        yield Sample("velocity", asked, done, hold)
        return
    yaw = motion.yaws(begin, end)
    if hold.frame in _BODY and len(yaw) and np.ptp(yaw) < STEADY:
        yield Sample("body velocity", asked, yaw_matrix(-float(yaw.mean())) @ done, hold)


def _arrival(hold: Hold, motion: Motion) -> Iterator[Sample]:
    """Yield where the vehicle came to rest, or nearly so."""
    end = min(hold.until_s, hold.last_s + LONGEST_S, float(motion.place.t[-1])) - 0.1
    asked, done = hold.wanted[X : Z + 1], motion.at(end)
    went = float(np.linalg.norm(done - motion.at(hold.start_s)))
    speed = float(np.linalg.norm(motion.velocity(end - 1.0 / motion.rate, end)))
    rests = speed < max(RESTS_MPS, STOPS_SHARE / STOPS_S * went)
    if rests and np.isfinite(asked).all() and np.isfinite(done).all():
        yield Sample("position", asked, done, hold)


def _turning(hold: Hold, motion: Motion, begin: float, end: float) -> Iterator[Sample]:
    world = hold.message != _LOCAL or hold.frame in (_NED, _OFFSET)
    yaw = motion.yaws(begin, end)
    if not len(yaw) or not np.isfinite(hold.wanted[YAW:]).all():
        return
    if hold.mask & _YAW == 0 and world and np.ptp(yaw) < STEADY:
        yield Sample("yaw", hold.wanted[YAW : YAW + 1], yaw[-1:], hold)
    elif hold.mask & _YAW and hold.mask & _YAW_RATE == 0:
        rate = (yaw[-1] - yaw[0]) / ((end - begin) * motion.rate)
        yield Sample("yaw rate", hold.wanted[YAW_RATE : YAW_RATE + 1], np.array([rate]), hold)


class Answer(NamedTuple):
    """How a vehicle took what it was asked for."""

    kind: str
    """``agrees``, ``axes``, ``sign``, ``offset`` or ``undecided``."""
    says: str
    left: float
    labelled: float
    """Share of what was asked for that is left (a yaw: rad), as it was taken and as labelled."""
    yaw: float
    """Constant turn about the vertical, rad."""
    setpoints: int


def along_axes(found: list[Sample]) -> Answer | str:
    """Say in which axes setpoints were taken; all of one kind, or positions and velocities."""
    steps = [each for what in MIN_ASKED for each in _steps(found, what)]
    if len(steps) < MIN_SAMPLES:
        return f"fewer than {MIN_SAMPLES} setpoints were held until their effect showed"
    asked, done, at = (np.array(column) for column in zip(*steps, strict=True))
    fit = axes.compare_steps(asked, done, at)
    if isinstance(fit, axes.Undecided):
        return "the vehicle does not follow the setpoints"
    body = found[0].what == "body velocity"
    yaw = fit.yaw if fit.yaw_known and fit.kind == "turned" else 0.0
    kind = {"agrees": "agrees", "turned": "turned", "undecided": "undecided"}.get(fit.kind, "axes")
    says = _of_body(fit.says) if body else fit.says
    return Answer(kind, says, fit.residual_m, fit.labelled_m, yaw, len(steps))


def _steps(found: list[Sample], what: str) -> Iterator[tuple[Floats, Floats, float]]:
    """Yield what was asked for and done, per unit of what was asked for, and when: of positions, differences."""
    mine = [each for each in found if each.what == what]
    pairs = [(each.asked, each.done, each.hold.start_s) for each in mine]
    if what == "position":
        pairs = [
            (after.asked - before.asked, after.done - before.done, after.hold.start_s)
            for before, after in itertools.pairwise(mine)
        ]
    for asked, done, at in pairs:
        size = float(np.linalg.norm(asked))
        if size > MIN_ASKED[what] and np.linalg.norm(done) < APART_M / 2:
            yield asked / size, done / size, at


def _of_body(says: str) -> str:
    """Return words for the axes of the world as words for those of the body."""
    for world, body in (
        ("North", "Forward"),
        ("South", "Back"),
        ("East", "Right"),
        ("West", "Left"),
    ):
        says = says.replace(world, body)
    return says


def of_yaw(found: list[Sample]) -> Answer | str:
    """Say how the yaw of setpoints was taken."""
    asked = np.array([each.asked[0] for each in found])
    done = np.array([each.done[0] for each in found])
    if len(found) < MIN_SAMPLES or np.ptp(np.unwrap(np.sort(wrapped(asked)))) < MIN_SPREAD:
        return (
            f"fewer than {MIN_SAMPLES} yaws, {np.degrees(MIN_SPREAD):.0f} degrees apart, were held"
        )
    labelled = float(np.median(np.abs(wrapped(done - asked))))
    if labelled < WRONG:
        return Answer("agrees", "", labelled, labelled, 0.0, len(found))
    for kind, off in (
        ("sign", done + asked),
        ("offset", done - asked),
        ("sign and offset", done + asked),
    ):
        turn = 0.0 if kind == "sign" else float(np.angle(np.exp(1j * off).mean()))
        left = float(np.abs(wrapped(off - turn)).max())
        if left < RIGHT:
            return Answer(kind, "", left, labelled, turn, len(found))
    return Answer("undecided", "", labelled, labelled, 0.0, len(found))


def of_yaw_rate(found: list[Sample]) -> Answer | str:
    """Say whether yaw rates were taken with their sign."""
    asked = np.array([each.asked[0] for each in found])
    done = np.array([each.done[0] for each in found])
    told = np.abs(asked) > MIN_RATE
    if np.count_nonzero(told) < 2:
        return "fewer than two yaw rates were held"
    share = done[told] / asked[told]
    left, labelled = (float(np.abs(share - each).max()) for each in (-1.0, 1.0))
    kind = "sign" if left < 0.3 else "agrees" if labelled < 0.3 else "undecided"
    return Answer(kind, "", min(left, labelled), labelled, 0.0, int(np.count_nonzero(told)))
