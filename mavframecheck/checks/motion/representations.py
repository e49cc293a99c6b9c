"""One attitude said in several ways by one autopilot: they must be the same."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.motion import attitude, axes
from mavframecheck.checks.motion.judge import Judge, Listener, frames
from mavframecheck.checks.motion.series import Floats
from mavframecheck.geo import quaternions as q4
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.tracks import Track
from mavframecheck.wire import Batch, Dialect

MESSAGES = ("ATTITUDE_QUATERNION", "ODOMETRY")
DELAYS_S = np.arange(-0.3, 0.35, 0.1)
MIN_ROWS = 20
MIN_TURNED = np.radians(15.0)
"""A vehicle that is level and points north says the same in every way."""
PITCHED: tuple[str, ...] = (
    "FIXED_WING",
    "VTOL_DUOROTOR",
    "VTOL_QUADROTOR",
    "VTOL_TILTROTOR",
    "VTOL_FIXEDROTOR",
    "VTOL_TAILSITTER",
    "VTOL_TILTWING",
    "VTOL_RESERVED5",
)
"""Types that report a pitch with a constant taken off: trim, or the view in hover."""


class _Compared(NamedTuple):
    """An attitude beside ATTITUDE."""

    off: float
    """Median difference, rad."""
    says: str
    """How it would fit."""
    left: float
    """Median difference then, rad."""
    rows: int


class Representations(Listener):
    """ATTITUDE_QUATERNION and ODOMETRY of an autopilot, beside its ATTITUDE."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._context: Context | None = None
        self._told: list[tuple[Track, _Compared | str]] | None = None

    def update(self, batch: Batch, context: Context) -> None:
        """Let the judge hear a batch."""
        super().update(batch, context)
        self._context = context

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every message that says another attitude."""
        for track, found in self._compared():
            if isinstance(found, _Compared) and np.degrees(found.off) >= self.params["min_off_deg"]:
                key = track.key
                whom = Subject(key.sender >> 8, key.sender & 0xFF, key.message, _field(key.message))
                values: dict[str, Scalar] = {
                    "message": key.message,
                    "off_deg": float(np.degrees(found.off)),
                    "left_deg": float(np.degrees(found.left)),
                    "says": found.says,
                }
                first, last = track.first, track.last
                yield Observation(whom, first, last, track.rows, values)

    def verdict(self) -> Verdict:
        """Return the rows compared, or what was missing."""
        told = [each.rows for _, each in self._compared() if isinstance(each, _Compared)]
        reasons = {each for _, each in self._compared() if isinstance(each, str)}
        return Verdict(sum(told), "" if told else "; ".join(sorted(reasons)))

    def _compared(self) -> list[tuple[Track, _Compared | str]]:
        if self._told is None and self._judge is not None:
            judge = self._judge
            tracks = [track for message in MESSAGES for track in judge.tracks_of(message)]
            mine = [track for track in tracks if self.concerns_sender(track.key.sender)]
            own = [track for track in mine if judge.role(track.key.sender) == "autopilot"]
            self._told = [(track, self._compare(judge, track)) for track in own]
        return self._told or []

    def _compare(self, judge: Judge, track: Track) -> _Compared | str:
        system = track.key.sender >> 8
        said = judge.own(system, "ATTITUDE")
        frame = frames().get(track.key.variant[0]) if track.key.variant else axes.NED
        if said is None or frame is None or not np.array_equal(frame.axes, np.eye(3)):
            return (
                "no ATTITUDE to compare with"
                if said is None
                else "its frame is not north-east-down"
            )
        stream, reference = judge.series(track), judge.series(said)
        theirs = reference.attitudes(stream.t)
        both = np.isfinite(stream.attitude).all(axis=1) & np.isfinite(theirs).all(axis=1)
        mine, theirs = stream.attitude[both], theirs[both]
        if len(mine) < MIN_ROWS:
            return "hardly said at the same time as ATTITUDE"
        level = np.array([1.0, 0, 0, 0])
        if np.percentile(q4.angle_between(theirs, level), 95) < MIN_TURNED:
            return "the vehicle stays level and points north"
        off = self._off(mine, theirs, system, free=frame.free_heading)
        if np.degrees(off) < self.params["min_off_deg"]:
            return _Compared(off, "", off, track.rows)
        free = frame.free_heading
        lie = attitude.compare(stream, reference, free_heading=free, since_s=0.0, delays=DELAYS_S)
        fits = isinstance(lie, attitude.Lie) and lie.kind != "labelled"
        if isinstance(lie, attitude.Lie) and fits:
            return _Compared(off, lie.says, lie.left, track.rows)
        return _Compared(off, "", off, track.rows)

    def _off(self, mine: Floats, theirs: Floats, system: int, *, free: bool) -> float:
        """Return the median difference, rad, without what may lawfully differ."""
        if free:
            turn = q4.twist(q4.product(mine, q4.inverse(theirs)))
            theirs = q4.product(q4.about_z(float(np.angle(np.exp(1j * turn).mean()))), theirs)
        between = q4.product(q4.inverse(theirs), mine)
        if self._pitched(system):
            pitch = 2 * np.arctan2(between[:, 2], between[:, 0])
            usual = float(np.angle(np.exp(1j * pitch).mean()))
            between = q4.product(between, q4.quaternion_from_euler(0.0, -usual, 0.0))
        return float(np.median(q4.angle_between(between, np.array([1.0, 0, 0, 0]))))

    def _pitched(self, system: int) -> bool:
        kind = None if self._context is None else self._context.last("vehicle.type", system)
        return kind in [constant(f"MAV_TYPE.{name}") for name in PITCHED]


def _field(message: str) -> str:
    return "q" if message == "ODOMETRY" else "q1"
