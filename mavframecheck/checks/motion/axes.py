"""Which way the axes of a stream point: its displacements beside those of a reference."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion.series import Series
from mavframecheck.geo import permutations
from mavframecheck.geo.alignment import (
    Linear,
    linear_between,
    trimmed_rms,
    yaw_between,
    yaw_matrix,
)

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

SPANS_S = (1.0, 4.0)
"""Displacements are taken over the first of these, s, over which the vehicle moved enough."""
GRID_S = 0.1
"""Times at which they are compared lie at least this far apart, s."""
DELAYS_S: Floats = np.arange(-0.5, 2.01, 0.05)
"""Delays that are tried, s."""
MIN_MOVED_M = 0.15
"""Along a direction that is judged: root mean square of the displacements, m."""
MIN_STEP_M = 0.3
"""A displacement counts from here on, m."""
MIN_SECONDS = 5.0
"""So long must it move, s of displacements that do not overlap."""
MAX_ERROR = 0.12
"""Standard error of a direction that is judged, rad."""
MIN_EXPLAINED = 0.8
"""Share of the stream's motion that follows the reference."""
FITS = 0.36
"""An axis that is off by less than this, rad (20 degrees), points where it should."""
MISFITS = 0.5
"""One that is off by more than this, rad (29 degrees), does not."""
CLEARLY = 0.4
"""The axes that fit leave less than this share of what those of the label leave."""
MIN_LENGTH = 0.2
"""A direction in which the stream moves less than this share of the reference says nothing."""


class Frame(NamedTuple):
    """What a stream says that its axes are."""

    axes: Floats
    """(3, 3) `frame_from_ned`."""
    free_heading: bool
    """Whether it may be turned about the vertical."""
    name: str


NED = Frame(np.eye(3), free_heading=False, name="north, east, down")


class Fit(NamedTuple):
    """How a stream lies against a reference."""

    kind: str
    """``agrees``, ``vertical`` (z alone is reversed), ``permuted``, ``quarter``, ``turned``."""
    matrix: Floats
    """(3, 3) `stream_from_ned` that fits best."""
    says: str
    """What the axes hold, as far as it was found."""
    yaw: float
    """Heading of the frame, rad: the turn about the vertical that fits best."""
    yaw_known: bool
    heights_known: bool
    residual_m: float
    labelled_m: float
    """Root mean square of what is left of the displacements, with `matrix`, and as labelled, m."""
    scale: float
    """Displacements of the stream per displacement of the reference."""
    delay_s: float
    """How much later than the reference it comes, receive time."""
    delay_known: bool
    track_m: float
    """How far the vehicle went while it was compared."""
    step_m: float
    """Usual displacement of the vehicle over `span_s`, m."""
    span_s: float
    """Over how long displacements were taken, s."""
    name: str
    """The axes in one word: ``ENU``."""
    times: tuple[float, float]


class Undecided(NamedTuple):
    """Why nothing can be said."""

    why: str


class _Steps(NamedTuple):
    """Displacements of both over the same stretches of time."""

    stream: Floats
    reference: Floats
    at: Floats
    span_s: float
    delay_s: float
    explained: Floats
    """(delays,) how well each delay explains them."""

    @property
    def independent(self) -> float:
        """How many displacements do not overlap."""
        return max(1.0, len(self.at) * GRID_S / self.span_s)


def compare(stream: Series, reference: Series, frame: Frame) -> Fit | Undecided:
    """Say how the displacements of `stream` lie against those of `reference`, which are NED."""
    why = "the vehicle hardly moves"
    for span_s in SPANS_S:
        steps = _steps(stream, reference, span_s)
        if isinstance(steps, Undecided):
            why = steps.why
            continue
        return _judge(steps, frame)
    return Undecided(why)


def _steps(stream: Series, reference: Series, span_s: float) -> _Steps | Undecided:
    at = _grid(stream.t)
    moved = stream.steps(at, span_s)
    best, explained = None, np.full(len(DELAYS_S), -np.inf)
    for k, delay_s in enumerate(DELAYS_S.tolist()):
        went = reference.steps(at - delay_s, span_s)
        both, rows, there = _moving(moved, went)
        if np.count_nonzero(there) * GRID_S < MIN_SECONDS:
            continue
        explained[k] = _explained(rows[0], rows[1])
        if best is None or explained[k] > explained[best[0]]:
            best = (k, delay_s, rows, at[both][there])
    if best is None:
        return Undecided("the vehicle hardly moves while both are heard")
    k, delay_s, rows, times = best
    return _Steps(rows[0], rows[1], times, span_s, delay_s, explained)


def _grid(t: Floats) -> Floats:
    """Return the times of samples, thinned."""
    places = np.floor(t / GRID_S)
    return t[np.diff(places, prepend=-np.inf) > 0]


def _moving(moved: Floats, went: Floats) -> tuple[Bools, tuple[Floats, Floats], Bools]:
    """Return (n,) where both are known, the displacements where either is moving, and which those are."""
    both = np.isfinite(moved).all(axis=1) & np.isfinite(went[:, :2]).all(axis=1)
    a, b = moved[both], np.nan_to_num(went[both])
    there = np.linalg.norm(b, axis=1) > MIN_STEP_M
    return both, (a[there], b[there]), there


def _explained(moved: Floats, went: Floats) -> float:
    cross, moment = moved.T @ went, went.T @ went
    matrix = cross @ np.linalg.pinv(moment, rcond=1e-6, hermitian=True)
    left = np.square(moved - went @ matrix.T).sum()
    size = np.square(moved).sum()
    return float(1 - left / size) if size > 0 else -np.inf


def _judge(steps: _Steps, frame: Frame) -> Fit | Undecided:
    linear = linear_between(steps.reference, steps.stream, steps.independent)
    if linear.explained < MIN_EXPLAINED:
        return Undecided("its motion does not follow the vehicle's")
    scale = float(
        np.linalg.norm(linear.matrix @ linear.axes * linear.moved) / np.linalg.norm(linear.moved)
    )
    seen = _Directions.of(linear, scale)
    if not len(seen.went):
        return Undecided("no direction in which it moves enough")
    return _conclude(steps, frame, seen, scale)


class _Directions(NamedTuple):
    """Directions in which the reference moved, and where the stream moved then."""

    went: Floats
    """(k, 3) unit vectors, NED."""
    moved: Floats
    """(k, 3) unit vectors."""

    @classmethod
    def of(cls, linear: Linear, scale: float) -> _Directions:
        """Take the directions that are told well enough."""
        images = (linear.matrix @ linear.axes).T
        lengths = np.linalg.norm(images, axis=1)
        told = (linear.moved >= MIN_MOVED_M) & (lengths >= MIN_LENGTH * scale)
        told &= linear.error <= MAX_ERROR * np.maximum(lengths, 1e-12)
        went = linear.axes.T[told]
        return cls(went, images[told] / lengths[told, np.newaxis])

    def off(self, matrix: Floats) -> float:
        """Return by how much the worst direction misses what `matrix` says, rad."""
        return float(np.linalg.norm(self.moved - self.went @ matrix.T, axis=1).max())

    def knows(self, along: Floats) -> bool:
        """Return whether a direction lies within what was told."""
        return bool(np.linalg.norm(self.went @ along) > 0.9)


def _conclude(steps: _Steps, frame: Frame, seen: _Directions, scale: float) -> Fit:
    level = [seen.knows(axis) for axis in np.eye(3)]
    yaw_known, heights_known = level[0] and level[1], level[2]
    yaw = _yaw(steps, frame.axes, scale)
    expected = frame.axes @ yaw_matrix(yaw) if frame.free_heading else frame.axes
    kind, matrix, says, name = "agrees", expected, "", ""
    if seen.off(expected) > MISFITS:
        kind, matrix, says, name = _other(steps, frame, seen, scale, yaw_known=yaw_known)
    elif not frame.free_heading and yaw_known:
        turned = frame.axes @ yaw_matrix(yaw)
        if _left(steps, turned, scale) < 0.7 * _left(steps, expected, scale):
            kind, matrix = "turned", turned
    peak = steps.explained.max()
    sharp = np.count_nonzero(steps.explained > peak - 0.3 * (1 - peak) - 0.002) <= 6
    return Fit(
        kind,
        matrix,
        says,
        yaw,
        yaw_known,
        heights_known,
        _left(steps, matrix, scale),
        _left(steps, expected, scale),
        scale,
        steps.delay_s,
        bool(sharp),
        float(np.linalg.norm(steps.reference, axis=1).mean() * steps.independent),
        float(np.linalg.norm(steps.reference, axis=1).mean()),
        steps.span_s,
        name,
        (float(steps.at[0]), float(steps.at[-1])),
    )


def _yaw(steps: _Steps, axes: Floats, scale: float) -> float:
    return yaw_between(steps.reference, steps.stream @ axes / scale)


def _left(steps: _Steps, matrix: Floats, scale: float) -> float:
    """Return what is left of the stream's displacements, m of the reference."""
    off = np.linalg.norm(steps.stream / scale - steps.reference @ matrix.T, axis=1)
    return trimmed_rms(off, 0.97)


def _other(
    steps: _Steps, frame: Frame, seen: _Directions, scale: float, *, yaw_known: bool
) -> tuple[str, Floats, str, str]:
    """Return kind, matrix, words and name of the axes that fit where those of the label do not."""
    family = permutations.PERMUTATIONS
    if frame.free_heading:
        family = np.array([c @ yaw_matrix(_yaw(steps, c, scale)) for c in permutations.CLASSES])
    fitting = np.array([matrix for matrix in family if seen.off(matrix) < FITS])
    if len(fitting) and not frame.free_heading:
        return _permuted(steps, frame, fitting, scale)
    if len(fitting):
        best = fitting[int(np.argmin([_left(steps, matrix, scale) for matrix in fitting]))]
        label = frame.axes @ yaw_matrix(_yaw(steps, frame.axes, scale))
        if _left(steps, best, scale) > CLEARLY * _left(steps, label, scale):
            return "undecided", best, "", ""
        return _freely(frame, best)
    turned = [c @ yaw_matrix(_yaw(steps, c, scale)) for c in permutations.CLASSES]
    best = turned[int(np.argmin([_left(steps, matrix, scale) for matrix in turned]))]
    if seen.off(best) > FITS or not yaw_known:
        return "undecided", best, "", ""
    if np.allclose(np.abs(best[2]), [0, 0, 1]) and np.allclose(best[2], frame.axes[2]):
        if np.linalg.det(best) * np.linalg.det(frame.axes) > 0:
            return "turned", best, "", ""
    return _freely(frame, best)


def _permuted(
    steps: _Steps, frame: Frame, fitting: Floats, scale: float
) -> tuple[str, Floats, str, str]:
    """Return the same for what fits without a turn; several may, where the vehicle moved little."""
    matrix = fitting[_likeliest(fitting, frame.axes)]
    if _left(steps, matrix, scale) > CLEARLY * _left(steps, frame.axes, scale):
        return "undecided", matrix, "", ""
    relative = frame.axes.T @ matrix
    says = permutations.shared_words(fitting)
    name = permutations.words(matrix).name if len(fitting) == 1 else ""
    if np.array_equal(relative, np.diag([1.0, 1, -1])):
        return "vertical", matrix, says, name
    about_z = relative[2, 2] == 1 and np.linalg.det(relative) > 0
    return "quarter" if about_z else "permuted", matrix, says, name


def _likeliest(fitting: Floats, axes: Floats) -> int:
    """Return the one nearest to the label; a turn before a mirror image."""
    score = np.einsum("kij,ij->k", fitting, axes) + 0.5 * (
        np.linalg.det(fitting) * np.linalg.det(axes) > 0
    )
    return int(np.argmax(score))


def _freely(frame: Frame, matrix: Floats) -> tuple[str, Floats, str, str]:
    """Return what axes are whose heading is free: words about z, and the mirror."""
    z = matrix[2, 2] * frame.axes[2, 2]
    mirrored = np.linalg.det(matrix) * np.linalg.det(frame.axes) < 0
    if abs(z) < 0.5:
        held = permutations.held_by(permutations.nearest(matrix)[2])
        return "permuted", matrix, f"z holds {held}", ""
    down = matrix[2, 2] > 0
    says = f"z is {'down' if down else 'up'}"
    if z < 0 and mirrored:
        return "vertical", matrix, says, ""
    hand = "to the left of x" if (np.linalg.det(matrix) > 0) != down else "to the right of x"
    return "permuted", matrix, f"y points {hand}, {says}", ""
