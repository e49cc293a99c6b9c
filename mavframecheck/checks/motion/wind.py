"""The wind that an autopilot reports, beside the one that shows in its speed over ground on different headings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.motion.judge import Judge, Listener
from mavframecheck.checks.motion.series import Floats, Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.model import Scalar, Subject
from mavframecheck.vehicle.tracks import Track
from mavframecheck.wire import Dialect

MESSAGES = ("WIND", "WIND_COV")
WINDOW_S = 60.0
STEP_S = 0.5
MEMORY_S = 2.0
"""Speeds nearer to each other, s, are not independent."""
MIN_SHARE = 0.4
"""So much of a window must be flown fast enough."""
FLIES_MPS = 3.0
MIN_AIRSPEED_MPS = 6.0
ONE_WAY = 0.7
"""Length of the mean of the headings: above this they do not spread enough."""
LEAVES = 0.25
"""Share of the airspeed that the wind triangle may leave: what does not fly where it points leaves more."""
SURE = 4.0
"""The wind must be so many times its standard error."""
OPPOSITE, ALIKE = np.radians(135.0), np.radians(90.0)


class Window(NamedTuple):
    """The wind of one minute."""

    true: Floats
    """(2,) m/s north, east: where it blows to."""
    said: Floats
    airspeed: float

    @property
    def apart(self) -> float:
        """The angle between the two, rad."""
        cross = self.true[0] * self.said[1] - self.true[1] * self.said[0]
        return float(abs(np.arctan2(cross, self.true @ self.said)))


class WindDirection(Listener):
    """Winds that blow against the one that there is."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._told: list[tuple[Track, list[Window]]] | None = None

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every sender whose wind is reversed."""
        for track, windows in self._windows():
            apart = np.array([each.apart for each in windows])
            against = np.count_nonzero(apart > OPPOSITE)
            if against < self.params["min_windows"] or np.any(apart < ALIKE):
                continue
            key = track.key
            whom = Subject(key.sender >> 8, key.sender & 0xFF, key.message)
            first, last = track.first, track.last
            yield Observation(whom, first, last, track.rows, _values(key.message, windows))

    def verdict(self) -> Verdict:
        """Return the reports in windows that tell, or what was missing."""
        found = self._windows()
        told = sum(track.rows for track, windows in found if windows)
        if found and not told:
            return Verdict(
                0, "no minute in which a wind shows in the speed over ground on different headings"
            )
        return Verdict(told)

    def _windows(self) -> list[tuple[Track, list[Window]]]:
        if self._told is None and self._judge is not None:
            judge = self._judge
            tracks = [track for message in MESSAGES for track in judge.tracks_of(message)]
            mine = [track for track in tracks if self.concerns_sender(track.key.sender)]
            self._told = [(track, list(_told(judge, track, self.params))) for track in mine]
        return self._told or []


def _told(judge: Judge, track: Track, params: Mapping[str, Any]) -> Iterator[Window]:
    system = track.key.sender >> 8
    place, lies = judge.own(system, "GLOBAL_POSITION_INT"), judge.own(system, "ATTITUDE")
    said = judge.series(track)
    if place is None or lies is None or not len(said.t):
        return
    strength = np.hypot(said.velocity[:, 0], said.velocity[:, 1])
    if not np.any(strength >= params["min_wind_mps"]):
        return
    for start in np.arange(0.0, said.t[-1], WINDOW_S).tolist():
        window = _window(said, judge.series(place), judge.series(lies), start)
        if window is not None and min(map(np.linalg.norm, window[:2])) >= params["min_wind_mps"]:
            yield window


def _window(said: Series, place: Series, lies: Series, start: float) -> Window | None:
    """Return the wind of the minute from `start`; None where it does not show.

    Speed over ground is airspeed along the nose plus wind: three unknowns, by least squares.
    """
    at = np.arange(start, start + WINDOW_S, STEP_S)
    v, q = place.velocities(at)[:, :2], lies.attitudes(at)
    flies = np.isfinite(v).all(axis=1) & np.isfinite(q).all(axis=1)
    flies &= np.hypot(*np.nan_to_num(v).T) > FLIES_MPS
    if np.count_nonzero(flies) < MIN_SHARE * len(at):
        return None
    v, yaw = v[flies], q4.euler_from_quaternion(q[flies])[:, 2]
    if abs(np.exp(1j * yaw).mean()) > ONE_WAY:
        return None
    one, none = np.ones(len(v)), np.zeros(len(v))
    columns = np.concatenate(
        (np.column_stack((np.cos(yaw), one, none)), np.column_stack((np.sin(yaw), none, one)))
    )
    (airspeed, *wind), *_ = np.linalg.lstsq(columns, v.T.ravel(), rcond=None)
    left = float(np.sqrt(2 * np.mean(np.square(v.T.ravel() - columns @ [airspeed, *wind]))))
    error = left / np.sqrt(len(v) * STEP_S / MEMORY_S)
    if airspeed < MIN_AIRSPEED_MPS or left > LEAVES * airspeed or np.hypot(*wind) < SURE * error:
        return None
    reported = said.velocity[(said.t >= start) & (said.t < start + WINDOW_S), :2]
    reported = reported[np.isfinite(reported).all(axis=1)]
    return Window(np.array(wind), reported.mean(axis=0), float(airspeed)) if len(reported) else None


def _values(message: str, windows: list[Window]) -> dict[str, Scalar]:
    true = np.mean([each.true for each in windows], axis=0)
    said = np.mean([each.said for each in windows], axis=0)
    return {
        "message": message,
        "said_from_deg": _from_deg(said),
        "said_mps": float(np.hypot(*said)),
        "from_deg": _from_deg(true),
        "mps": float(np.hypot(*true)),
        "minutes": len(windows),
    }


def _from_deg(towards: Floats) -> float:
    return float(np.degrees(np.arctan2(-towards[1], -towards[0])) % 360)
