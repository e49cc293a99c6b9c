"""Rules about what a vehicle was asked for and what it did: setpoints that are taken in other axes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.motion import attitude, response
from mavframecheck.checks.motion.checks import lie_values
from mavframecheck.checks.motion.holds import Holds
from mavframecheck.checks.motion.judge import Judge, Listener, rate_of
from mavframecheck.checks.motion.response import Answer, Motion, Sample
from mavframecheck.checks.motion.series import Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.model import Scalar
from mavframecheck.model import Subject as Whom
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.tracks import Track
from mavframecheck.wire import Batch, Dialect

CALM = np.radians(15.0)
CALM_S = 1.0
"""An attitude that is asked for counts where it has turned by less than `CALM`, rad, in `CALM_S`."""
ATTITUDE_DELAYS_S = np.arange(-1.2, 0.05, 0.1)
ATTITUDE_FITS = np.radians(12.0)
"""How late a vehicle takes an attitude, s (the setpoint comes before), and how far off, rad."""
NO_FRAMES = ("labelled", "order", "mount")
"""Readings that are no matter of frames: the order of elements has a rule of its own, trim is none."""
_YAW_RATE_IGNORED = 4
_FIELDS = {
    "position": "x",
    "velocity": "vx",
    "body velocity": "vx",
    "yaw": "yaw",
    "yaw rate": "yaw_rate",
}


class Response(Listener):
    """Setpoints of position, velocity, yaw and yaw rate, and the motion that followed."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._holds = Holds()
        self._told: list[tuple[list[Sample], str, Answer | str]] | None = None

    def update(self, batch: Batch, context: Context) -> None:
        """Take in setpoints, and let the judge hear what the vehicle does."""
        super().update(batch, context)
        if self._judge is not None and self._judge.t0_us is not None:
            self._holds.update(batch, context, self._judge.t0_us)

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every kind of setpoint that is taken otherwise."""
        for found, what, answer in self._answers():
            if isinstance(answer, Answer) and self._wrong(answer):
                first, last = found[0].hold, found[-1].hold
                field = _FIELDS[what]
                whom = Whom(first.sender >> 8, first.sender & 0xFF, first.message, field)
                values = {"message": first.message, **_values(what, answer)}
                yield Observation(whom, first.first, last.last, len(found), values)

    def _wrong(self, answer: Answer) -> bool:
        if answer.kind == "turned":
            turned = abs(np.degrees(answer.yaw)) >= self.params["min_yaw_deg"]
            return bool(turned and answer.left <= self.params["max_left"])
        if answer.kind == "axes":
            return bool(answer.left <= self.params["max_left"])
        return answer.kind in ("sign", "offset", "sign and offset")

    def verdict(self) -> Verdict:
        """Return the setpoints that could be compared, or what was missing."""
        if not any(self.concerns_sender(sender) for sender in self._holds.senders):
            return Verdict(0)
        answers = self._answers()
        told = [found for found, _, answer in answers if not _undecided(answer)]
        rows = sum(each.hold.rows for found in told for each in found)
        if rows:
            lost = [each for each in answers if isinstance(each[2], Answer)]
            return Verdict(rows, partly=_reasons(lost))
        return Verdict(0, _reasons(answers) or "no setpoint was held while the vehicle obeyed")

    def _answers(self) -> list[tuple[list[Sample], str, Answer | str]]:
        if self._told is None:
            self._told = list(self._compared())
        return self._told

    def _compared(self) -> Iterator[tuple[list[Sample], str, Answer | str]]:
        kinds: dict[tuple[int, int], dict[str, list[Sample]]] = {}
        mine = (each for each in self._holds.finish() if self.concerns_sender(each.sender))
        for hold in mine:
            motion = self._motion(hold.system)
            for sample in response.samples(hold, motion) if motion is not None else ():
                of = kinds.setdefault((hold.sender, hold.system), {})
                of.setdefault(sample.what, []).append(sample)
        for each in kinds.values():
            yield from _of_stream(each)

    def _motion(self, system: int) -> Motion | None:
        if self._judge is None:
            return None
        judge = self._judge
        place = judge.own(system, "GLOBAL_POSITION_INT") or judge.own(system, "LOCAL_POSITION_NED")
        lies = judge.own(system, "ATTITUDE") or judge.own(system, "ATTITUDE_QUATERNION")
        if place is None or len(judge.series(place).t) < 2:
            return None
        attitudes = None if lies is None else judge.series(lies)
        return Motion(
            judge.series(place), attitudes, 1.0 if attitudes is None else rate_of(attitudes)
        )


def _undecided(answer: Answer | str) -> str:
    """Return why an answer tells nothing; nothing where it does.

    A vehicle that does not follow at all may have its reasons: an option that gives the yaw to the way it flies or to a
    region of interest, a limit, an obstacle. That is no matter of frames.
    """
    if isinstance(answer, str):
        return answer
    if answer.kind != "undecided":
        return ""
    return "the vehicle does not follow it, neither turned nor reversed: something else may decide"


def _reasons(answers: list[tuple[list[Sample], str, Answer | str]]) -> str:
    """Return for each kind of setpoint that tells nothing why."""
    reasons = {f"{what}: {why}" for _, what, answer in answers if (why := _undecided(answer))}
    return "; ".join(sorted(reasons))


def _of_stream(kinds: dict[str, list[Sample]]) -> Iterator[tuple[list[Sample], str, Answer | str]]:
    """Yield what each kind of setpoint shows; positions and velocities that are too few, together."""
    readers = {"yaw": response.of_yaw, "yaw rate": response.of_yaw_rate}
    few: list[Sample] = []
    for what, found in kinds.items():
        answer = readers.get(what, response.along_axes)(found)
        if isinstance(answer, str) and what in ("position", "velocity"):
            few += found
        yield found, what, answer
    if len({each.what for each in few}) > 1:
        yield few, few[0].what, response.along_axes(few)


def _values(what: str, answer: Answer) -> dict[str, Scalar]:
    angle = what == "yaw"
    scale = 180 / np.pi if angle else 100.0
    return {
        "what": what,
        "kind": answer.kind,
        "says": answer.says,
        "left": answer.left * scale,
        "labelled": answer.labelled * scale,
        "measured_in": "degrees" if angle else "%",
        "yaw_deg": float(np.degrees(answer.yaw)),
        "count": answer.setpoints,
    }


class AttitudeFrame(Listener):
    """Attitudes that were asked for, and those that the vehicle took."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._told: list[tuple[Track, attitude.Lie | str]] | None = None

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every stream that is taken in other axes."""
        for track, lie in self._lies():
            if isinstance(lie, attitude.Lie) and lie.kind not in NO_FRAMES:
                key = track.key
                whom = Whom(key.sender >> 8, key.sender & 0xFF, key.message, "q")
                first, last = track.first, track.last
                yield Observation(whom, first, last, track.rows, lie_values(lie))

    def verdict(self) -> Verdict:
        """Return the setpoints that could be compared, or what was missing."""
        told = [track for track, lie in self._lies() if isinstance(lie, attitude.Lie)]
        reasons = {lie for _, lie in self._lies() if isinstance(lie, str)}
        if told or not reasons:
            return Verdict(sum(track.rows for track in told))
        return Verdict(0, "; ".join(sorted(reasons)))

    def _lies(self) -> list[tuple[Track, attitude.Lie | str]]:
        if self._told is None and self._judge is not None:
            tracks = self._judge.tracks_of("SET_ATTITUDE_TARGET")
            mine = [track for track in tracks if self.concerns_sender(track.key.sender)]
            self._told = [(track, _lie(track, self._judge)) for track in mine]
        return self._told or []


def _lie(track: Track, judge: Judge) -> attitude.Lie | str:
    target, mask = track.key.variant
    lies = judge.own(target or track.key.sender >> 8, "ATTITUDE")
    if lies is None:
        return "no ATTITUDE of the vehicle"
    asked = _calm(judge.series(track))
    if len(asked.t) < 2 * attitude.MIN_TELLING:
        return "no attitude was held"
    return attitude.compare(
        asked,
        judge.series(lies),
        free_heading=not mask & _YAW_RATE_IGNORED,
        since_s=0.0,
        delays=ATTITUDE_DELAYS_S,
        fits=ATTITUDE_FITS,
    )


def _calm(asked: Series) -> Series:
    """Return the setpoints that have hardly changed for a while."""
    before = asked.attitudes(asked.t - CALM_S)
    calm = np.nan_to_num(q4.angle_between(before, asked.attitude), nan=np.pi) < CALM
    return asked.where(calm)
