"""Tracks as series on one time line, and what they say between their samples."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.geo import quaternions
from mavframecheck.vehicle.pairs import metres
from mavframecheck.vehicle.tracks import (
    ATTITUDE,
    PLACE,
    STAMP,
    TIME,
    VELOCITY,
    Track,
)

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

GAP_S = 1.6
"""Nothing is read between samples further apart than this, s: positions come once a second at the least."""
APART_M = 1e7
"""What lies behind a reset is put this far away, m, so that no step leads across it: see `Series.steps`."""
RESET_M = 0.5
"""What moved further than this, m, ..."""
RESET_TIMES = 8.0
"""... and so many times further than from sample to sample elsewhere, jumped."""


@dataclass
class Series:
    """Samples of one stream; positions NED (or what the stream takes for it), attitudes `ned_from_frd`."""

    message: str
    t: Floats
    """(n,) receive time, s, ascending."""
    place: Floats
    """(n, 3) m."""
    attitude: Floats
    """(n, 4)."""
    velocity: Floats
    """(n, 3) m/s."""
    stamp: Floats
    """(n,) s."""

    def places(self, at: Floats) -> Floats:
        """Return (k, 3) positions at times `at`, NaN across gaps and resets."""
        return self._path.at(at)

    @functools.cached_property
    def _path(self) -> _Lines:
        """Positions that are known, those behind each reset far away."""
        given = np.isfinite(self.place[:, :2]).all(axis=1)
        place = self.place[given]
        torn = _resets(place)
        behind = np.concatenate(([0.0], np.cumsum(torn)))[: len(place)] * APART_M
        return _Lines.through(self.t[given], place + behind[:, np.newaxis], torn)

    def velocities(self, at: Floats) -> Floats:
        """Return (k, 3) velocities at times `at`, NaN across gaps."""
        given = np.isfinite(self.velocity).all(axis=1)
        return _Lines.through(self.t[given], self.velocity[given]).at(at)

    def attitudes(self, at: Floats) -> Floats:
        """Return (k, 4) attitudes at times `at`, NaN across gaps."""
        given = np.isfinite(self.attitude).all(axis=1)
        t, q = self.t[given], self.attitude[given]
        if len(t) < 2:
            return np.full((len(at), 4), np.nan)
        k, share, near = _places_in(t, at)
        turned = quaternions.between(share, q[k], q[k + 1])
        return np.where(near[:, np.newaxis], turned, np.nan)

    def where(self, rows: Bools) -> Series:
        """Return some of the samples."""
        columns = (self.t, self.place, self.attitude, self.velocity, self.stamp)
        return Series(self.message, *(each[rows] for each in columns))

    def steps(self, at: Floats, span_s: float) -> Floats:
        """Return (k, 3) how far it went in the `span_s` around times `at`, m, NaN across gaps."""
        return displacement(self.places(at - span_s / 2), self.places(at + span_s / 2))

    def integrated(self, rate: float) -> Series:
        """Return the same with a position that its velocity adds up to; `rate` is vehicle per receive time."""
        given = np.isfinite(self.velocity).all(axis=1)
        t, v = self.t[given], self.velocity[given]
        went = np.zeros_like(v)
        if len(t) > 1:
            dt = np.minimum(np.diff(t), GAP_S)[:, np.newaxis] * rate
            went[1:] = np.cumsum((v[1:] + v[:-1]) / 2 * dt, axis=0)
        return Series(self.message, t, went, self.attitude[given], v, self.stamp[given])


def displacement(before: Floats, after: Floats) -> Floats:
    """Return (n, 3) how far it is from one position to the other, m, NaN across resets."""
    went = after - before
    north, east = np.abs(went[:, 0]), np.abs(went[:, 1])  # heights may be unknown
    went[~(np.maximum(north, east) < APART_M / 2)] = np.nan
    return went


def thinned(t: Floats, grid_s: float) -> Floats:
    """Return of ascending times (n,) s the first in each stretch of `grid_s`."""
    first: Floats = t[np.diff(np.floor(t / grid_s), prepend=-np.inf) > 0]
    return first


def _places_in(t: Floats, at: Floats) -> tuple[npt.NDArray[np.int64], Floats, Bools]:
    """Return (k,) the sample before each time, the share of the way to the next, and whether that is near."""
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    apart = np.maximum(t[k + 1] - t[k], 1e-9)
    share = (at - t[k]) / apart
    near = (share >= 0) & (share <= 1) & (apart <= GAP_S)
    return k, np.clip(share, 0, 1), np.asarray(near)


class _Lines(NamedTuple):
    """Straight lines from each of n samples to the next one."""

    t: Floats
    """(n,) s, ascending."""
    values: Floats
    """(n, k)."""
    rates: Floats
    """(n - 1, k) change per second."""
    near: Bools
    """(n - 1,) whether anything is read between the two samples."""

    @classmethod
    def through(cls, t: Floats, values: Floats, torn: Bools | None = None) -> _Lines:
        """Join samples that are near each other and not `torn` apart, (n - 1,)."""
        apart = np.diff(t)
        near = apart <= GAP_S
        if torn is not None:
            near &= ~torn
        return cls(
            t, values, np.diff(values, axis=0) / np.maximum(apart, 1e-9)[:, np.newaxis], near
        )

    def at(self, times: Floats) -> Floats:
        """Return (m, k) values at times (m,), NaN where nothing is read."""
        if len(self.t) < 2:
            return np.full((len(times), self.values.shape[1]), np.nan)
        before = np.searchsorted(self.t, times, side="right") - 1
        before = np.clip(before, 0, len(self.t) - 2)
        inside = (times >= self.t[0]) & (times <= self.t[-1]) & self.near.take(before)
        since = (times - self.t.take(before))[:, np.newaxis]
        found = self.values.take(before, axis=0) + since * self.rates.take(before, axis=0)
        return np.where(inside[:, np.newaxis], found, np.nan)


def _resets(place: Floats) -> Bools:
    """Return (n - 1,) steps between neighbours that are no motion."""
    went = np.linalg.norm(np.nan_to_num(np.diff(place, axis=0)), axis=1)
    if not len(went):
        return np.zeros(0, np.bool_)
    moving = went[went > 0]
    usual = float(np.percentile(moving, 95)) if len(moving) else 0.0
    return np.asarray(went > np.maximum(RESET_M, RESET_TIMES * usual))


def series_of(track: Track) -> Series:
    """Return the samples of a track; geodetic positions become metres from the middle one."""
    rows = track.samples()
    rows = rows[np.argsort(rows[:, TIME], kind="stable")]
    place = rows[:, PLACE]
    if track.source.geodetic and len(place):
        lat, lon, height = place[np.argsort(place[:, 0])[len(place) // 2]]
        north, east = metres(place[:, 0], place[:, 1], lat, lon)
        place = np.column_stack((north, east, height - place[:, 2]))
    attitude = rows[:, ATTITUDE]
    if track.source.euler:
        attitude = quaternions.quaternion_from_euler(*attitude[:, :3].T)
    else:
        attitude = quaternions.unit(attitude)
    return Series(
        track.key.message, rows[:, TIME], place, attitude, rows[:, VELOCITY], rows[:, STAMP]
    )
