"""How much a vehicle moves while a stream is heard: what the method is promised before it has to decide.

Worked out from the vehicle's telemetry alone, by other means than the judge's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from benchmarks.injection.log import Log
from benchmarks.injection.words import FACTS
from mavframecheck.wire import Table

Floats = npt.NDArray[np.float64]

GRID_S = 0.1
SPANS_S = (1.0, 4.0)
"""Displacements are taken over the first of these in which it moves long enough."""
STEP_M, LEAP_MPS = 0.3, 40.0
"""Less is standing, faster is an estimator that starts."""
MOVING_S = 10.0
ALONG_M = 0.3
"""Root mean square of the displacements along a direction that can be judged."""
TRACK_M = 25.0
LEAST_FIXES = 30
TURN = np.radians(40.0)
TILT = np.radians(4.0)
TILTED_S = 4.0
SWING, SWINGS_S = np.radians(30.0), 9.0
SLIDING, SLOW_MPS = 0.25, 0.6
SPREAD_MPS, ANOTHER = 0.6, 0.985
_METRES = 111_200.0
"""Of a degree of latitude."""


class Excitation(NamedTuple):
    """Which motions there are enough of."""

    across: bool
    """Along two level directions: 10 s of displacements of 0.3 m and more, 0.3 m along either, and more than
    what the GNSS fix adds to them."""
    climb: bool
    """The same along the vertical."""
    far: bool
    """25 m of track."""
    varies: float
    """From which time on the speed is another one, s: a correlation with itself below 0.985."""
    turn: bool
    """The heading varies by 40 degrees."""
    tilt: bool
    """4 s with roll, 4 s with pitch and 4 s with a difference between them of 4 degrees."""
    slides: bool
    """Its speed across the nose is a quarter of its speed."""
    swings: bool
    """The heading turns by 30 degrees in 2 s, and that for 9 s of them."""

    def has(self, needs: tuple[str, ...], delay_s: float) -> bool:
        """Return whether there is enough of everything in `needs`; `varies` for such a delay."""
        return all(
            delay_s >= self.varies if need == "varies" else getattr(self, need) for need in needs
        )


def excitation(log: Log, stream: Table) -> Excitation:
    """Return what the vehicle does while `stream` is heard."""
    heard = log.seconds[stream.frames.number[[0, -1]]]
    at = np.arange(heard[0] + 2, heard[1] - 2, GRID_S)
    place = _place(log, at) if len(at) >= 50 else None
    angles = _columns(log, ("roll", "pitch", "yaw"), at)
    if place is None or angles is None:
        return Excitation(*[False] * len(Excitation._fields))._replace(varies=np.inf)
    level, up, track = _displacements(place)
    witnessed, heights = _witness(log)
    level = level if level >= _noise(log, place, at) else 0.0
    speed = np.linalg.norm(place[10:] - place[:-10], axis=1)
    roll, pitch, yaw = angles.T
    spread = np.abs(np.angle(np.exp(1j * yaw) / np.exp(1j * yaw).mean()))
    tilted = min(_seconds(np.abs(each) > TILT) for each in (roll, pitch, roll - pitch))
    return Excitation(
        across=witnessed and level >= ALONG_M,
        climb=heights and up >= ALONG_M,
        far=witnessed and track >= TRACK_M,
        varies=_varies(speed),
        turn=bool(2 * np.percentile(spread, 95) >= TURN),
        tilt=tilted >= TILTED_S,
        slides=_slides(place, yaw),
        swings=_seconds(np.abs(np.angle(np.exp(1j * (yaw[20:] - yaw[:-20])))) > SWING) >= SWINGS_S,
    )


def _displacements(place: Floats) -> tuple[float, float, float]:
    """Return root mean squares along the weaker level direction and the vertical, and the track, m."""
    track = float(np.linalg.norm(place[10::10] - place[:-10:10], axis=1).sum())
    for span_s in SPANS_S:
        k = round(span_s / GRID_S)
        went = place[k:] - place[:-k]
        length = np.linalg.norm(went, axis=1)
        went = went[(length > STEP_M) & (length < LEAP_MPS * span_s)]
        if len(went) * GRID_S >= MOVING_S:
            moment = went[:, :2].T @ went[:, :2] / len(went)
            level = float(np.sqrt(max(np.linalg.eigvalsh(moment)[0], 0.0)))
            rises = np.sort(np.abs(went[:, 2]))[: round(0.95 * len(went))]
            return level, float(np.sqrt(np.mean(rises**2))), track
    return 0.0, 0.0, track


def _varies(speed: Floats) -> float:
    """Return the shortest time, s, after which a speed is another one."""
    if np.std(speed) >= SPREAD_MPS:
        for k in range(1, 20):
            if np.corrcoef(speed[k:], speed[:-k])[0, 1] < ANOTHER:
                return k * GRID_S
    return float("inf")


def _witness(log: Log) -> tuple[bool, bool]:
    """Return whether something independent tells where the vehicle is, and how high."""
    gnss, truth = log.own("GPS_RAW_INT"), log.own("SIMSTATE")
    fixed = gnss is not None and np.count_nonzero(gnss["fix_type"] >= 3) >= LEAST_FIXES
    return bool(fixed or (truth is not None and len(truth) >= LEAST_FIXES)), bool(fixed)


def _slides(place: Floats, yaw: Floats) -> bool:
    v = (place[10:] - place[:-10]) / (10 * GRID_S)
    v, yaw = v[(moves := np.linalg.norm(v, axis=1) > SLOW_MPS)], yaw[5:-5][moves]
    if len(v) * GRID_S < MOVING_S:
        return False
    to_the_right = v[:, 1] * np.cos(yaw) - v[:, 0] * np.sin(yaw)
    return bool(np.mean(to_the_right**2) >= SLIDING**2 * np.mean(np.square(v).sum(axis=1)))


def _noise(log: Log, place: Floats, at: Floats) -> float:
    """Return the root mean square by which the displacements of the GNSS fix are off, m in a second."""
    gnss = log.own("GPS_RAW_INT")
    if gnss is None or not np.count_nonzero(gnss["fix_type"] >= 3):
        return 0.0
    gnss = gnss.take(gnss["fix_type"] >= 3)
    level = metres(gnss["lat"] * 1e-7, gnss["lon"] * 1e-7)
    fix = np.column_stack((level, -gnss["alt"] * 1e-3))
    t = log.seconds[gnss.frames.number]
    went = [np.interp(at[10:], t, each) - np.interp(at[:-10], t, each) for each in fix.T]
    off = np.column_stack(went) - (place[10:] - place[:-10])
    return float(np.sqrt(np.mean(np.sort(np.square(off).sum(axis=1))[: round(0.95 * len(off))])))


def metres(lat: Floats, lon: Floats) -> Floats:
    """Return (n, 2) metres north and east of the first one."""
    east = ((lon - lon[0] + 180) % 360 - 180) * np.cos(np.radians(lat))
    return np.column_stack(((lat - lat[0]) * _METRES, east * _METRES))


def _place(log: Log, at: Floats) -> Floats | None:
    """Return (n, 3) metres north, east and down from somewhere."""
    place = _columns(log, ("lat", "lon", "alt"), at)
    if place is None:
        return None
    return np.column_stack((metres(place[:, 0], place[:, 1]), -place[:, 2]))


def _columns(log: Log, names: tuple[str, ...], at: Floats) -> Floats | None:
    """Return (n, k) what the autopilot says of its vehicle at the times `at`."""
    message = FACTS["vehicle"][names[0]][0]
    table = log.own(message)
    if table is None or len(table) < 2:
        return None
    place = table.take(table["lat"] != 0) if "lat" in names else table
    t = log.seconds[place.frames.number]
    near = np.clip(np.searchsorted(t, at), 0, len(t) - 1)
    return np.column_stack(
        [place[FACTS["vehicle"][n][1]][near] * FACTS["vehicle"][n][2] for n in names]
    )


def _seconds(holds: npt.NDArray[np.bool_]) -> float:
    return float(np.count_nonzero(holds)) * GRID_S
