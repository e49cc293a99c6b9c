"""Turning rates in another unit: their size beside that of the rates in ATTITUDE, and of these beside its angles.

Sizes do not depend on how a sensor is mounted, or in which axes it speaks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.motion.judge import Judge, Listener
from mavframecheck.checks.motion.series import Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle.tracks import ATTITUDE, PLACE, RATES, STAMP, TIME, Track
from mavframecheck.wire import Dialect

Floats = npt.NDArray[np.float64]

UNITS = {
    "rad/s": 1.0,
    "thousandths of rad/s": 1e-3,
    "deg/s": np.pi / 180,
    "hundredths of deg/s": np.pi / 18_000,
    "thousandths of deg/s": np.pi / 180_000,
    "rad/s, turned from degrees once too often": 180 / np.pi,
}
"""What the numbers may be, and how much one of them is, rad/s."""
SPAN_S = 0.3
"""The angles of ATTITUDE are compared over this time by its stamps, s: they are when it was sent, not measured."""
LONGEST_S = 0.6
"""Angles of ATTITUDE further apart by its stamps, s, say nothing of rates: a vehicle turns to and fro."""
DELAYS_S: Floats = np.arange(-0.3, 0.31, 0.1)
"""How late rates may come beside the attitude, s."""
TURNS = 0.25
"""The vehicle turns from this rate on, rad/s."""
ROUGHLY, APART = 0.5, 2.4
"""The rates in ATTITUDE are believed where they follow its angles with this correlation, and are off by less than
half the way to the next unit: it often comes too rarely for more."""
SAME = 1.4
"""A unit fits where rates are off by less than this factor; units lie further apart."""


class _Turning(NamedTuple):
    """Rates beside the turns of the vehicle, by their size."""

    ratio: float
    """Rate as labelled per turn of the vehicle, while it turns."""
    follows: float
    """Correlation of the two."""
    moments: int
    """How often the vehicle turned."""
    turn: float
    """How fast then, rad/s."""

    def unit(self, scale: float) -> str:
        """Return the unit that fits numbers of which one is said to be `scale` rad/s; empty where none does."""
        off = {name: abs(np.log(self.ratio * one / scale)) for name, one in UNITS.items()}
        best = min(off, key=lambda name: off[name])
        return best if off[best] < np.log(SAME) else ""


class Units(Listener):
    """Rates of gyroscopes and estimators that fit the turns of the vehicle in another unit only."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._found: list[tuple[Track, _Turning | str]] | None = None

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every stream in another unit."""
        for track, found in self._turnings():
            tag = _tag(track)
            unit = "" if isinstance(found, str) else found.unit(tag.scale)
            if isinstance(found, str) or UNITS.get(unit, tag.scale) == tag.scale:
                continue
            key = track.key
            whom = Subject(key.sender >> 8, key.sender & 0xFF, key.message, tag.field)
            values: dict[str, Scalar] = {
                "message": key.message,
                "holds": unit,
                "wanted": tag.unit,
                "ratio": found.ratio,
                "said_degps": float(np.degrees(found.turn * found.ratio)),
                "turn_degps": float(np.degrees(found.turn)),
                "moments": found.moments,
            }
            yield Observation(whom, track.first, track.last, track.rows, values)

    def verdict(self) -> Verdict:
        """Return the rows of streams whose unit shows, or what was missing."""
        rows, reasons = 0, set()
        for track, found in self._turnings():
            if isinstance(found, str):
                reasons.add(f"{track.key.message}: {found}")
            elif found.unit(_tag(track).scale):
                rows += track.rows
            else:
                reasons.add(f"{track.key.message}: its rates fit the vehicle's turns in no unit")
        missing = "; ".join(sorted(reasons))
        return Verdict(rows, partly=missing) if rows else Verdict(0, missing)

    def _turnings(self) -> list[tuple[Track, _Turning | str]]:
        """Return the rates in each stream beside the turns of its vehicle, or why they do not show."""
        if self._found is None and self._judge is not None:
            tracks = [track for track in self._judge.tracks if track.source.rates is not None]
            mine = [track for track in tracks if self.concerns_sender(track.key.sender)]
            self._found = [
                (track, each) for track in mine for each in self._told(self._judge, track)
            ]
        return self._found or []

    def _told(self, judge: Judge, track: Track) -> Iterator[_Turning | str]:
        """Yield what a stream shows; nothing where it holds no rates, or rates that MFC308 is about."""
        rows = track.samples()
        rows = rows[np.isfinite(rows[:, RATES]).all(axis=1)]
        size = np.linalg.norm(rows[:, RATES], axis=1)
        if not size.any() or np.abs(rows[:, RATES]).max() > self.params["gyro_rate_radps"]:
            return
        lies = judge.own(judge.about(track.key.sender), "ATTITUDE")
        if lies is None:
            yield "no ATTITUDE of the vehicle"
        elif lies is track:
            yield self._compared([_by_angles(track)], self.params["min_correlation"])
        else:
            first = self._compared([_by_angles(lies)], ROUGHLY)
            sure = isinstance(first, _Turning) and 1 / APART < first.ratio < APART
            times, true = rows[:, TIME], _rates_of(lies)
            pairs = [(size, _size(true.velocities(times - delay))) for delay in DELAYS_S.tolist()]
            told = self._compared(pairs, self.params["min_correlation"])
            yield told if sure else f"ATTITUDE: {_why(first)}"

    def _compared(self, pairs: list[tuple[Floats, Floats]], least: float) -> _Turning | str:
        """Compare rates as labelled with the true ones, by their size, (n,); of several the pair that fits best."""
        told = [(a[known], b[known]) for a, b in pairs if (known := np.isfinite(a + b)).any()]
        if not told:
            return "hardly said at the same time as ATTITUDE"
        said, turn = max(told, key=lambda pair: _correlation(*pair))
        turning = turn > TURNS
        moments = int(np.count_nonzero(turning))
        if moments < self.params["min_moments"]:
            return "the vehicle hardly turns"
        follows = _correlation(said, turn)
        if follows < least:
            return "its rates follow the vehicle's turns too roughly"
        ratio = float(said[turning] @ turn[turning] / (turn[turning] @ turn[turning]))
        return _Turning(ratio, follows, moments, float(np.median(turn[turning])))


def _why(found: _Turning | str) -> str:
    return found if isinstance(found, str) else "its rates are not those of its angles"


def _rates_of(track: Track) -> Series:
    """Return the rates in a track, in place of a velocity."""
    rows = track.samples()
    rows = rows[np.argsort(rows[:, TIME], kind="stable")]
    return Series(
        track.key.message,
        rows[:, TIME],
        rows[:, PLACE],
        rows[:, ATTITUDE],
        rows[:, RATES],
        rows[:, STAMP],
    )


def _by_angles(track: Track) -> tuple[Floats, Floats]:
    """Return (n,) the size of the rates in ATTITUDE over a while, and how fast its angles turn meanwhile, rad/s."""
    rates = _rates_of(track)
    lies = q4.quaternion_from_euler(*rates.attitude[:, :3].T)
    apart = np.diff(rates.stamp)
    apart = apart[(apart > 0) & (apart < LONGEST_S)]
    k = max(1, round(SPAN_S / float(np.median(apart)))) if len(apart) else 1
    if len(lies) <= k:
        return np.zeros(0), np.zeros(0)
    went = rates.stamp[k:] - rates.stamp[:-k]
    near = (went > SPAN_S / 2) & (went < LONGEST_S)
    turn = q4.angle_between(lies[:-k], lies[k:]) / np.where(near, went, np.nan)
    whole = np.cumsum((rates.velocity[1:] + rates.velocity[:-1]) / 2, axis=0)
    mean = (whole[k - 1 :] - np.concatenate((np.zeros((1, 3)), whole))[: len(whole) - k + 1]) / k
    return _size(mean), turn


def _size(rates: Floats) -> Floats:
    size: Floats = np.linalg.norm(rates, axis=1)
    return size


def _correlation(a: Floats, b: Floats) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0 else 0.0


def _tag(track: Track) -> FieldTag:
    """Return the meaning of the first rate in a stream."""
    rates = catalogue.find(message=track.key.message, quantity="angular_rate")
    return next(tag for tag in rates if catalogue.alias(tag) == "rollspeed")
