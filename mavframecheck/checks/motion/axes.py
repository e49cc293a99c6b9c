"""Which way the axes of a stream point: its displacements beside those of a reference."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion.series import Series, displacement, thinned
from mavframecheck.geo import permutations
from mavframecheck.geo.alignment import (
    Linear,
    linear_between,
    rotation_between,
    trimmed_rms,
    yaw_between,
    yaw_matrix,
)

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

SPANS_S = (1.0, 4.0)
"""Displacements are taken over the first of these, s, over which the vehicle moved enough and noise does not hide it."""
GRID_S = 0.1
"""Times at which they are compared lie at least this far apart, s."""
MAX_TIMES = 1500
"""At most so many times are compared, spread over all that is kept."""
SAMPLE_S = 0.05
"""Samples of a track are no nearer to each other, s."""
DELAY_STEP_S = 0.05
DELAYS_S: Floats = np.arange(-0.5, 2.01, DELAY_STEP_S)
"""Delays that are tried, s: every `_COARSE`-th, then all around the best one."""
_COARSE = 4
_SHARP = 6
"""A delay is known where no more than so many explain the motion about as well."""
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
    """``agrees``, ``vertical`` (z alone is reversed), ``permuted``, ``quarter``, ``turned``, ``tilted``."""
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
    grid_s: float
    span_s: float
    delay_s: float
    explained: float
    """Share of the stream's motion that follows the reference with this delay."""
    delay_known: bool = False

    @property
    def independent(self) -> float:
        """How many displacements do not overlap."""
        return max(1.0, len(self.at) * min(self.grid_s / self.span_s, 1.0))


def compare(stream: Series, reference: Series, frame: Frame) -> Fit | Undecided:
    """Say how the displacements of `stream` lie against those of `reference`, which are NED."""
    why = "the vehicle hardly moves"
    if not _moves(reference):
        return Undecided(why)
    for span_s in SPANS_S:
        steps = _steps(stream, reference, span_s)
        if isinstance(steps, Undecided):
            why = steps.why
            continue
        found = _judge(steps, frame)
        if isinstance(found, Fit):
            return found
        why = found.why
    return Undecided(why)


def compare_steps(
    stream: Floats, reference: Floats, at: Floats, frame: Frame = NED
) -> Fit | Undecided:
    """Say the same of displacements, or velocities, (n, 3), that belong together and do not overlap."""
    share = _explained(stream, reference)
    return _judge(_Steps(stream, reference, at, 1.0, 1.0, 0.0, share), frame)


def _moves(reference: Series) -> bool:
    """Return whether the vehicle moves at all: most recordings of a bench end here."""
    at, grid_s = grid(reference.t)
    went = np.nan_to_num(reference.steps(at, SPANS_S[-1]))
    there = np.linalg.norm(went, axis=1) > MIN_STEP_M
    return bool(np.count_nonzero(there) * grid_s >= MIN_SECONDS / 2)


def _steps(stream: Series, reference: Series, span_s: float) -> _Steps | Undecided:
    at, grid_s = grid(stream.t)
    moved = stream.steps(at, span_s)
    heard = np.flatnonzero(np.isfinite(moved).all(axis=1))
    at, moved = at[heard], moved[heard]
    half = round(span_s / 2 / DELAY_STEP_S)
    tried: dict[int, _Steps] = {}

    @functools.cache
    def place(steps: int) -> Floats:
        """Return where the reference was by so many steps of a delay before."""
        return reference.places(at - steps * DELAY_STEP_S)

    def attempt(places: range) -> int | None:
        """Try delays by their place in `DELAYS_S`; return the one that explains most so far."""
        for k in places:
            if 0 <= k < len(DELAYS_S) and k not in tried:
                ago = round(float(DELAYS_S[k]) / DELAY_STEP_S)
                went = np.nan_to_num(displacement(place(ago + half), place(ago - half)))
                there = np.flatnonzero(np.linalg.norm(went, axis=1) > MIN_STEP_M)
                if len(there) * grid_s >= MIN_SECONDS:
                    rows = moved.take(there, axis=0), went.take(there, axis=0)
                    delay_s, share = float(DELAYS_S[k]), _explained(*rows)
                    tried[k] = _Steps(*rows, at[there], grid_s, span_s, delay_s, share)
        return max(tried, key=lambda k: tried[k].explained, default=None)

    near = attempt(range(0, len(DELAYS_S), _COARSE))
    if near is None:
        return Undecided("the vehicle hardly moves while both are heard")
    best = attempt(range(near - _COARSE, near + _COARSE + 1))
    while best is not None and best != near:
        near, best = best, attempt(range(best - 2, best + 3))
    found = tried[near]
    shares = np.array([each.explained for each in tried.values()])
    flat = np.count_nonzero(shares > found.explained - 0.3 * (1 - found.explained) - 0.002)
    return found._replace(delay_known=bool(flat <= _SHARP))


def grid(t: Floats) -> tuple[Floats, float]:
    """Return the times of samples, thinned evenly, and how far apart they are at the least, s."""
    grid_s = max(GRID_S, len(t) * SAMPLE_S / MAX_TIMES)
    return thinned(t, grid_s), grid_s


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
        steps.delay_known,
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
        return _tilted(steps, frame, seen, scale) or ("undecided", best, "", "")
    proper = np.linalg.det(best) * np.linalg.det(frame.axes) > 0
    if proper and np.allclose(best[2], frame.axes[2]):
        return "turned", best, "", ""
    return _freely(frame, best)


def _tilted(
    steps: _Steps, frame: Frame, seen: _Directions, scale: float
) -> tuple[str, Floats, str, str] | None:
    """Return the same for axes that lean: a rotation that is neither a permutation nor about the vertical."""
    matrix = rotation_between(steps.reference, steps.stream / scale)
    label = frame.axes @ yaw_matrix(_yaw(steps, frame.axes, scale))
    fits = seen.off(matrix) < FITS and len(seen.went) > 1
    if not fits or _left(steps, matrix, scale) > CLEARLY * _left(steps, label, scale):
        return None
    lean = float(np.degrees(np.arccos(np.clip(matrix[2] @ frame.axes[2], -1.0, 1.0))))
    return "tilted", matrix, f"its z leans by {lean:.0f} degrees", ""


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
