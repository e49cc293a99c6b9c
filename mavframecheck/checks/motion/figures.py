"""What proves a conclusion about motion: the stream beside the reference, as labelled and as it fits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion import attitude, axes, lever, twist
from mavframecheck.checks.motion.series import APART_M, Series, thinned
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.rotations import wrapped_deg
from mavframecheck.model.trace import Figure, Trace
from mavframecheck.vehicle.flight import line

Floats = npt.NDArray[np.float64]

MOST = 400
"""Stretches of time of which extremes are drawn: figures are small."""
ANGLES = ("roll", "pitch", "yaw")


def of_axes(
    fit: axes.Fit, frame: axes.Frame, stream: Series, truth: Series, t0_s: float
) -> Iterator[Figure]:
    """Yield the path and the height of a stream beside the vehicle's, as labelled and with the axes that fit."""
    t = stream.t
    went = _together(stream.places(t))
    was = _together(truth.places(t - fit.delay_s))
    both = np.isfinite(went).all(axis=1) & np.isfinite(was[:, :2]).all(axis=1)
    t, went, was = t[both] + t0_s, went[both], was[both]
    if not len(t):
        return
    went, was = went - went[0], was - was[0]
    labelled, corrected = went @ frame.axes, went @ fit.matrix / (fit.scale or 1.0)
    lines = (
        ("as labelled", "claimed", labelled, "As labelled"),
        ("with the axes that fit", "corrected", corrected, "With the axes that fit"),
    )
    for label, role, path, title in lines:
        traces = (_path(truth.message, "reference", t, was), _path(label, role, t, path))
        yield Figure(title=title, kind="plan", unit="m", traces=traces)
    if np.isfinite(was[:, 2]).any():
        heights = ((truth.message, "reference", was), *((a, b, path) for a, b, path, _ in lines))
        lines_up = tuple(_line(label, role, t, -path[:, 2]) for label, role, path in heights)
        yield Figure(title="Height from where both begin", kind="time", unit="m", traces=lines_up)


def of_attitude(lie: attitude.Lie, stream: Series, truth: Series, t0_s: float) -> Iterator[Figure]:
    """Yield how far the attitude is off, as labelled and as it is to be read, and the angle that is off most."""
    t = thinned(stream.t, attitude.GRID_S)
    mine, theirs = stream.attitudes(t), truth.attitudes(t - lie.delay_s)
    both = np.isfinite(mine).all(axis=1) & np.isfinite(theirs).all(axis=1)
    t, mine, theirs = t[both] + t0_s, mine[both], theirs[both]
    reading = next(
        (each for each in attitude.READINGS if (each.kind, each.says) == (lie.kind, lie.says)), None
    )
    if reading is None or not len(t):
        return
    predicted = q4.product(q4.about_z(lie.yaw), reading.of(theirs))
    off = (
        _line("as labelled", "claimed", t, np.degrees(q4.angle_between(mine, theirs))),
        _line(f"if {lie.says}", "corrected", t, np.degrees(q4.angle_between(mine, predicted))),
    )
    yield Figure(title=f"Difference from {truth.message}", kind="time", unit="deg", traces=off)
    said, true, read = (np.degrees(q4.euler_from_quaternion(q)) for q in (mine, theirs, predicted))
    most = int(np.argmax(np.median(np.abs(wrapped_deg(said - true)), axis=0)))
    angles = (
        _line(truth.message, "reference", t, true[:, most]),
        _line(stream.message, "claimed", t, said[:, most]),
        _line(f"{truth.message} read so that {lie.says}", "corrected", t, read[:, most]),
    )
    yield Figure(title=ANGLES[most].capitalize(), kind="time", unit="deg", traces=angles)


def of_twist(
    turn: twist.Twist, stream: Series, place: Series, lies: Series, t0_s: float
) -> Iterator[Figure]:
    """Yield the velocity north and east, as labelled and as it is to be read, beside that of the track."""
    read = twist.readings(stream, place, lies, yaw=turn.yaw, delay_s=turn.delay_s, rate=turn.rate)
    t = read.at + t0_s
    for column, name in enumerate(("north", "east")):
        traces = (
            _line(place.message, "reference", t, read.true[:, column]),
            _line("as labelled", "claimed", t, read.by_name[turn.label][:, column]),
            _line(f"if {turn.says}", "corrected", t, read.by_name[turn.reading][:, column]),
        )
        yield Figure(title=f"Velocity {name}", kind="time", unit="m/s", traces=traces)


def of_lever(steps: lever.Steps, reference: str, t0_s: float) -> Iterator[Figure]:
    """Yield how much further than the vehicle a stream goes, and what of it an arm explains."""
    t, said = steps.at + t0_s, steps.columns @ steps.solved().values
    for column, name in enumerate(("north", "east")):
        traces = (
            _line(f"further than {reference}", "claimed", t, steps.further[:, column]),
            _line("what the arm makes of it", "corrected", t, said[:, column]),
        )
        title = f"Way over {lever.SPAN_S:.0f} s, {name}"
        yield Figure(title=title, kind="time", unit="m", traces=traces)


def _together(place: Floats) -> Floats:
    """Return positions with what `Series` put far away behind each reset back in its place."""
    whole: Floats = np.nan_to_num(place / APART_M).round() * APART_M
    return place - whole


def _line(label: str, role: str, t: Floats, y: Floats) -> Trace:
    return line(label, t, y, role, most=MOST)


def _path(label: str, role: str, t: Floats, ned: Floats) -> Trace:
    return line(label, t, ned[:, 0], role, ned[:, 1], most=MOST)
