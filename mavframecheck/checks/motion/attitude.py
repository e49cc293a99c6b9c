"""What is wrong with an attitude, by comparison with another one of the same vehicle."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion.series import Series, thinned
from mavframecheck.geo import quaternions as q4

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

GRID_S = 0.1
DELAYS_S: Floats = np.arange(-0.3, 0.81, 0.05)
"""Delays that are tried, s: every `_COARSE`-th, then all around the best one."""
_COARSE = 3
MOMENTS = 300
"""The delay is sought with about so many moments."""
TELLING = np.radians(5.0)
"""Moments at which two readings differ by less than this, rad, do not tell between them."""
MIN_TELLING = 20
FITS = np.radians(6.0)
"""A reading that leaves more than this, rad, is none."""
CLEARLY = 0.3
"""It must leave less than this share of what the label leaves."""
MOUNT_EXTRA = np.radians(1.0)
"""A turned sensor must explain more than any simpler reading by this, rad."""
MOUNT_ROUNDS = 8
"""Where the heading is free, too, both are found in turns."""
MIN_TURN = np.radians(30.0)
"""Yaw must change by so much, rad, before an offset is told from a sign."""


NEED_TURN = ("yaw_offset", "yaw_sign", "mount")
"""Kinds of readings that show only where the yaw changes."""


class Reading(NamedTuple):
    """How the attitude of a stream may be meant."""

    kind: str
    says: str
    of: Callable[[Floats], Floats]
    """From (n, 4) `ned_from_frd` to what the stream would hold."""
    free_yaw: bool = False
    free_mount: bool = False
    """Whether the sensor may be turned in the vehicle: this explains most, so that others come first."""
    back: Callable[[Floats], Floats] | None = None
    """What undoes `of`, where doing it again does not."""

    def undo(self, q: Floats) -> Floats:
        """Return (n, 4) `ned_from_frd` from what the stream holds."""
        return self.of(q) if self.back is None else self.back(q)


def _euler(
    change: Callable[[Floats, Floats, Floats], tuple[Floats, Floats, Floats]],
) -> Callable[[Floats], Floats]:
    def of(q: Floats) -> Floats:
        return q4.quaternion_from_euler(*change(*q4.euler_from_quaternion(q).T))

    return of


_FLU: Floats = np.array([0.0, 1, 0, 0])
"""Half a turn about x: front-left-up from front-right-down, and north-west-up from north-east-down."""
_ENU: Floats = np.array([0.0, 1, 1, 0]) / np.sqrt(2)


def _same(q: Floats) -> Floats:
    return q


READINGS = (
    Reading("labelled", "", _same),
    Reading("yaw_offset", "its yaw is off by a constant", _same, free_yaw=True),
    Reading("yaw_sign", "its yaw counts counter-clockwise", _euler(lambda r, p, y: (r, p, -y))),
    Reading(
        "yaw_sign",
        "its yaw counts counter-clockwise from another direction",
        _euler(lambda r, p, y: (r, p, -y)),
        free_yaw=True,
    ),
    Reading(
        "order",
        "its elements are x, y, z, w",
        lambda q: q[:, [1, 2, 3, 0]],
        back=lambda q: q[:, [3, 0, 1, 2]],
    ),
    Reading("inverse", "it is the inverse (from the world to the body)", q4.inverse),
    Reading("swapped", "roll and pitch have changed places", _euler(lambda r, p, y: (p, r, y))),
    Reading("body", "pitch has the wrong sign", _euler(lambda r, p, y: (r, -p, y))),
    Reading("body", "roll has the wrong sign", _euler(lambda r, p, y: (-r, p, y))),
    Reading(
        "body",
        "pitch and yaw have the wrong sign, as in north-west-up with front-left-up axes",
        lambda q: q4.product(_FLU, q4.product(q, _FLU)),
    ),
    Reading(
        "body",
        "it is of east-north-up with front-left-up axes",
        lambda q: q4.product(_ENU, q4.product(q, _FLU)),
    ),
    Reading("frames", "it is of front-left-up axes", lambda q: q4.product(q, _FLU)),
    Reading("frames", "it is in east-north-up", lambda q: q4.product(_ENU, q)),
    Reading("frames", "it is in north-west-up", lambda q: q4.product(_FLU, q)),
    Reading("mount", "", _same, free_mount=True),
)
"""In order of simplicity: of two that leave the same, the first one counts."""


class Lie(NamedTuple):
    """How an attitude lies against the reference."""

    kind: str
    """``labelled`` where nothing is wrong, else the kind of the reading."""
    says: str
    left: float
    """Median difference with that reading, rad, where it matters."""
    labelled: float
    """The same as labelled."""
    yaw: float
    """Constant turn about the vertical, rad."""
    seconds: float
    delay_s: float
    times: tuple[float, float]
    told: frozenset[str]
    """Kinds of readings that would have shown: the vehicle turned and tilted enough for them."""


def compare(
    stream: Series,
    reference: Series,
    *,
    free_heading: bool,
    since_s: float,
    delays: Floats = DELAYS_S,
    fits: float = FITS,
) -> Lie | str:
    """Say how the attitude of `stream` is to be read, or why that cannot be told.

    It may come so many seconds later than the reference as `delays` (k,) say, and may be off by `fits` rad.
    """
    at = thinned(stream.t[stream.t >= since_s], GRID_S)
    every = len(at) // MOMENTS or 1
    tried: dict[int, float] = {}

    def attempt(places: range) -> int:
        """Try delays by their place in `delays`; return the one that leaves least so far."""
        for k in places:
            if 0 <= k < len(delays) and k not in tried:
                reads = _reads(stream, reference, at, delays[k], free_heading, every)
                tried[k] = min((read.mean for read in reads), default=np.inf)
        return min(tried, key=lambda k: tried[k])

    near = attempt(range(0, len(delays), _COARSE))
    delay = float(delays[attempt(range(near - _COARSE + 1, near + _COARSE))])
    reads = _reads(stream, reference, at, delay, free_heading)
    if not reads:
        return "no attitude of the vehicle at the same time"
    return _choose(reads, delay, (float(at[0]), float(at[-1])), fits)


def _reads(
    stream: Series, reference: Series, at: Floats, delay: float, free_heading: bool, every: int = 1
) -> list[_Read]:
    """Return the stream under each reading at `every` so many of the times `at`; none where too few are known."""
    some = at[::every]
    mine, theirs = stream.attitudes(some), reference.attitudes(some - delay)
    both = np.isfinite(mine).all(axis=1) & np.isfinite(theirs).all(axis=1)
    if np.count_nonzero(both) * every < 2 * MIN_TELLING:
        return []
    mine, theirs = mine[both], theirs[both]
    turned = _turned(theirs)
    return [_read(each, mine, theirs, turned, free_heading) for each in READINGS]


def _turned(attitude: Floats) -> float:
    """Return how far the yaw of (n, 4) attitudes varies, rad."""
    heading = np.exp(1j * q4.euler_from_quaternion(attitude)[:, 2])
    spread = np.abs(np.angle(heading / (heading.mean() or 1.0)))
    return float(np.percentile(spread, 85)) * 2  # more than the mean leaves out


class _Read(NamedTuple):
    """A stream under one reading."""

    reading: Reading
    off: Floats
    """(n,) differences, rad."""
    predicted: Floats
    yaw: float
    turned: float
    """How far the yaw of the vehicle varies, rad."""
    mount: Floats
    """(4,) `frd_from_sensor`."""

    @property
    def says(self) -> str:
        """Return the reading in words."""
        if not self.reading.free_mount:
            return self.reading.says
        roll, pitch, yaw = (
            round(x) for x in np.degrees(q4.euler_from_quaternion(self.mount)).tolist()
        )
        return (
            "it is the attitude of a sensor that sits turned in the vehicle, "
            f"by roll {roll}, pitch {pitch}, yaw {yaw} degrees"
        )

    @property
    def rank(self) -> int:
        """Return a number by which readings are sorted: half degrees, so that the simpler one wins a draw."""
        extra = MOUNT_EXTRA if self.reading.free_mount else 0.0
        return round(float(np.degrees(self.mean + extra)) * 2)

    @property
    def mean(self) -> float:
        """Mean of the smallest nine tenths of the differences, rad."""
        return _usual(self.off)


def _usual(off: Floats) -> float:
    kept = np.sort(off)[: max(1, round(0.9 * len(off)))]
    return float(kept.mean())


def _read(
    reading: Reading, mine: Floats, theirs: Floats, turned: float, free_heading: bool
) -> _Read:
    yaw, mount = 0.0, np.array([1.0, 0, 0, 0])
    free = free_heading or reading.free_yaw
    for _ in range(MOUNT_ROUNDS if free and reading.free_mount else 1):
        if reading.free_mount:
            lies = q4.product(q4.about_z(yaw), theirs)
            mount = q4.mean(q4.product(q4.inverse(lies), mine))
        if free:
            bare = q4.product(mine, q4.inverse(mount))
            turns = q4.twist(q4.product(reading.undo(bare), q4.inverse(theirs)))
            yaw = float(np.angle(np.exp(1j * turns).sum()))
            yaw += float(np.median(np.angle(np.exp(1j * (turns - yaw)))))
    predicted = q4.product(reading.of(q4.product(q4.about_z(yaw), theirs)), mount)
    off = q4.angle_between(mine, predicted)
    return _Read(reading, off, predicted, float(np.angle(np.exp(1j * yaw))), turned, mount)


def _choose(
    reads: list[_Read], delay_s: float, times: tuple[float, float], fits: float
) -> Lie | str:
    labelled = reads[0]
    hidden = {read.reading.kind for read in reads[1:] if not _shows(read, labelled)}
    told = frozenset(read.reading.kind for read in reads[1:]) - hidden
    ranked = sorted(reads[1:], key=lambda read: read.rank)
    if labelled.mean <= ranked[0].mean * 1.05 + np.radians(0.3):
        return _lie(labelled, labelled, labelled.off >= 0, delay_s, times, told)
    for read in ranked[:1]:
        telling = q4.angle_between(read.predicted, labelled.predicted) > TELLING
        if np.count_nonzero(telling) < MIN_TELLING:
            break
        lie = _lie(read, labelled, telling, delay_s, times, told)
        if read.reading.kind in NEED_TURN and read.turned < MIN_TURN:
            return "the vehicle hardly turns"
        if lie.left < fits and lie.left < CLEARLY * lie.labelled:
            return lie
    undecided = told - {ranked[0].reading.kind}
    return _lie(labelled, labelled, labelled.off >= 0, delay_s, times, undecided)


def _shows(read: _Read, labelled: _Read) -> bool:
    """Return whether a reading, were it the right one, would differ from the label for long enough."""
    if read.reading.kind in NEED_TURN:
        return bool(read.turned >= MIN_TURN)
    apart = q4.angle_between(read.reading.of(labelled.predicted), labelled.predicted)
    enough = np.count_nonzero(apart > TELLING) >= MIN_TELLING
    return bool(enough and _usual(apart) > TELLING / 5)


def _lie(
    read: _Read,
    labelled: _Read,
    telling: Bools,
    delay_s: float,
    times: tuple[float, float],
    told: frozenset[str],
) -> Lie:
    return Lie(
        read.reading.kind,
        read.says,
        float(np.median(read.off[telling])),
        float(np.median(labelled.off[telling])),
        read.yaw,
        float(np.count_nonzero(telling) * GRID_S),
        delay_s,
        times,
        told,
    )
