"""In which axes a velocity is given: turned into the world as labelled, and as it might be meant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion.series import Series, thinned
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.alignment import trimmed_rms, yaw_matrix

Floats = npt.NDArray[np.float64]

GRID_S = 0.1
SPAN_S = 1.0
MIN_MPS = 0.5
"""Slower than this, m/s, a velocity says little."""
MIN_TELLING = 30
"""Moments, a tenth of a second apart, at which the two readings differ by that much."""
CLEARLY = 0.35
ALIKE = 0.15
"""Readings of which neither leaves more than this share of the speed, or twice what the other does, are not told apart."""
FITS = 0.35
"""Share of the speed that the right reading may leave."""

_FLU: Floats = np.diag([1.0, -1, -1])
_ENU: Floats = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])


class Twist(NamedTuple):
    """How a velocity is to be read."""

    reading: str
    """``labelled``, or one of `Readings`."""
    says: str
    left_mps: float
    labelled_mps: float
    seconds: float
    times: tuple[float, float]
    told: frozenset[str] = frozenset()
    """Readings that would have shown: they differ from the label for long enough."""
    label: str = ""
    """``body`` or ``world``."""
    yaw: float = 0.0
    delay_s: float = 0.0
    rate: float = 1.0
    """What it was compared with: see `compare`."""

    @property
    def kind(self) -> str:
        """Return ``labelled``, ``world``, ``body``, ``level``, ``inverse``, ``flu``, ``enu`` or ``nwu``."""
        return "flu" if self.reading == "level flu" else self.reading


class Readings(NamedTuple):
    """The velocity in world axes by each reading, and the true one; (n, 3) m/s, NED."""

    at: Floats
    by_name: dict[str, Floats]
    true: Floats
    times: tuple[float, float]
    """First and last time at which there was a sample."""


_SAYS = {
    "world": "the velocity is in the axes of the world",
    "body": "the velocity is in the axes of the body",
    "level": "the velocity is in the axes of the body",
    "inverse": "the velocity was turned the wrong way (from the body to the world twice over)",
    "flu": "the velocity is in front-left-up axes",
    "level flu": "the velocity is in front-left-up axes",
    "enu": "the velocity is in east-north-up axes",
    "nwu": "the velocity is in north-west-up axes",
}
_OF_BODY = ("body", "level", "flu", "level flu")
"""Readings that turn with the vehicle; the others belong to the world, and to other rules."""


def compare(
    stream: Series,
    place: Series,
    attitude: Series,
    *,
    body: bool,
    yaw: float,
    delay_s: float,
    rate: float,
) -> Twist | str:
    """Say in which axes the velocity of `stream` is; it is labelled `body` or world.

    `place` and `attitude` are the references, `yaw` the heading of the stream's frame, `rate` seconds of
    the vehicle per second of receive time.
    """
    label = "body" if body else "world"
    read = readings(stream, place, attitude, yaw=yaw, delay_s=delay_s, rate=rate)
    if len(read.at) < MIN_TELLING:
        return "the vehicle hardly moves"
    turn = _choose(read.by_name, read.true, label, read.times)
    if isinstance(turn, str):
        return turn
    return turn._replace(label=label, yaw=yaw, delay_s=delay_s, rate=rate)


def readings(
    stream: Series, place: Series, attitude: Series, *, yaw: float, delay_s: float, rate: float
) -> Readings:
    """Return the velocity of `stream` as it may be meant, at moments at which the vehicle moves."""
    at = thinned(stream.t, GRID_S)
    true = place.steps(at - delay_s, SPAN_S) / (SPAN_S * rate)
    given = _smoothed(stream, at)
    lies = attitude.attitudes(at - delay_s)
    fine = np.isfinite(true).all(axis=1) & np.isfinite(given).all(axis=1)
    fine &= np.isfinite(lies).all(axis=1)
    fine &= np.linalg.norm(np.nan_to_num(true), axis=1) > MIN_MPS
    v, r, t = given[fine], lies[fine], true[fine]
    scale = float(np.linalg.norm(v) / np.linalg.norm(t)) if len(t) else 0.0
    v = v / scale if scale > 0 else v
    world = v @ yaw_matrix(-yaw).T
    heading = q4.about_z(q4.euler_from_quaternion(r)[:, 2])
    by_name = {
        "body": q4.turn_by(r, v),
        "world": world,
        "level": q4.turn_by(heading, v),
        "inverse": q4.turn_by(q4.inverse(r), world) @ yaw_matrix(-yaw).T,
        "flu": q4.turn_by(r, v @ _FLU),
        "level flu": q4.turn_by(heading, v @ _FLU),
        "enu": v @ _ENU.T,
        "nwu": v @ _FLU,
    }
    times = (float(at[0]), float(at[-1])) if len(at) else (0.0, 0.0)
    return Readings(at[fine], by_name, t, times)


def _smoothed(stream: Series, at: Floats) -> Floats:
    """Return the mean velocity over the span around each time."""
    shifts = np.linspace(-SPAN_S / 2, SPAN_S / 2, 9)
    total: Floats = np.mean([stream.velocities(at + shift) for shift in shifts], axis=0)
    return total


def _choose(
    readings: dict[str, Floats], true: Floats, label: str, times: tuple[float, float]
) -> Twist | str:
    speed = float(np.sqrt(np.mean(np.square(true).sum(axis=1))))
    off = {name: np.linalg.norm(v - true, axis=1) for name, v in readings.items()}
    left = {name: trimmed_rms(each, 0.95) for name, each in off.items()}
    meant = [name for name in left if label == "world" or name != "nwu"]
    best = min(meant, key=lambda name: left[name])
    same = (label, "level") if label == "body" else (label,)  # axes of the heading are of the body
    fine = any(left[name] < max(FITS * speed, 1.2 * left[best]) for name in same[1:])
    told = frozenset(
        name for name in readings if _differ(readings[name], readings[label], FITS * speed)
    )
    if left[best] > FITS * speed:
        return "the velocity follows the vehicle in no axes"
    if best in same or left[label] < FITS * speed or fine:
        return Twist("labelled", "", left[label], left[label], len(true) * GRID_S, times, told)
    differ = np.linalg.norm(readings[best] - readings[label], axis=1) > MIN_MPS
    if np.count_nonzero(differ) < MIN_TELLING:
        return "the vehicle points along the axes of the world"
    if left[best] > CLEARLY * left[label]:
        return "the velocity follows the vehicle in no axes"
    alike = [name for name in left if left[name] <= max(2 * left[best], ALIKE * speed)]
    words = list(dict.fromkeys(_SAYS[name] for name in sorted(alike, key=lambda n: left[n])))
    says = ", or ".join((words[0], *(each.removeprefix("the velocity is ") for each in words[1:])))
    # A label of the body is wrong by any of them; one of the world by another rule for each.
    if label == "world" and len({name in _OF_BODY for name in alike}) > 1:
        return f"on the way that was flown two readings are one: {says}"
    return Twist(best, says, left[best], left[label], len(true) * GRID_S, times, told)


def _differ(reading: Floats, label: Floats, least: float) -> bool:
    apart = np.linalg.norm(reading - label, axis=1)
    return bool(
        np.count_nonzero(apart > MIN_MPS) >= MIN_TELLING and trimmed_rms(apart, 0.95) > least
    )
