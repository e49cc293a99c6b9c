"""The rules of the kinematic judge: each says one kind of conclusion."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.motion import attitude, axes, lever, twist
from mavframecheck.checks.motion import judge as judging
from mavframecheck.checks.motion.setpoints import OrderOfSetpoints
from mavframecheck.model import Scalar
from mavframecheck.model import Subject as Whom
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.tracks import Source
from mavframecheck.wire import Batch, Dialect

if TYPE_CHECKING:
    from mavframecheck.model.trace import Figure

Values = dict[str, Scalar]


class MotionCheck(judging.Listener):
    """Asks the judge of the recording about every stream."""

    rotation = False
    """Whether a finding is about the attitude alone."""

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every stream in which the mistake is."""
        for subject in self._subjects():
            told = self.told(subject)
            if told:
                yield self._observation(subject, told)

    def _subjects(self) -> Iterable[judging.Subject]:
        if self._judge is not None:
            yield from (each for each in self._judge.subjects if self.concerns(each))

    def _observation(self, subject: judging.Subject, told: Values) -> Observation:
        track = subject.track
        values = {
            "message": track.key.message,
            "reference": subject.reference,
            "frame": subject.frame.name,
            "by_autopilot": subject.by_autopilot,
            **told,
        }
        whom = self._whom(subject, told)
        return Observation(whom, track.first, track.last, track.rows, values)

    def _whom(self, subject: judging.Subject, told: Mapping[str, Scalar]) -> Whom:
        track = subject.track
        name = _rotation_field(track.source) if self.rotation or told.get("what") == "yaw" else None
        return Whom(track.key.sender >> 8, track.key.sender & 0xFF, track.key.message, name)

    def figures(self, observation: Observation) -> tuple[Figure, ...]:
        """Return the stream beside the reference, as labelled and corrected."""
        for subject in self._subjects():
            if self._judge and self._whom(subject, observation.values) == observation.subject:
                return self._judge.figures(subject, _about(observation.values))
        return ()

    def verdict(self) -> Verdict:
        """Return the rows of streams that could be told, else what was missing."""
        concerned = [(each, self.why_not(each)) for each in self._subjects()]
        reasons = {f"{each.track.key.message}: {why}" for each, why in concerned if why}
        rows = sum(each.track.rows for each, why in concerned if not why)
        missing = "; ".join(sorted(reasons))
        return Verdict(rows, partly=missing) if rows else Verdict(0, missing)

    @abstractmethod
    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether the rule is about a stream."""

    @abstractmethod
    def why_not(self, subject: judging.Subject) -> str:
        """Return why it cannot be told; nothing where it can."""

    @abstractmethod
    def told(self, subject: judging.Subject) -> Values | None:
        """Return the values for the rule's texts where the mistake is made."""


def _about(told: Mapping[str, Scalar]) -> str:
    """Return which conclusion about a stream the values of a finding are from."""
    if told.get("what") == "lever arm":
        return "lever"
    if told.get("measured_in") == "m":
        return "speed" if told.get("what") == "velocity" else "place"
    return "lie" if told.get("measured_in") == "degrees" else "twist"


def _rotation_field(source: Source) -> str:
    return "yaw" if source.euler else "q"


class _Axes(MotionCheck):
    """A rule about where axes point, by position or by a velocity of the world."""

    kinds: tuple[str, ...] = ()

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether a stream has a position, or a velocity of the world."""
        return subject.place != judging.NOTHING or subject.speed != judging.NOTHING

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        reasons = [each for each in (subject.place, subject.speed) if isinstance(each, str)]
        fits = [each for each in (subject.place, subject.speed) if isinstance(each, axes.Fit)]
        if not fits:
            return next((each for each in reasons if each != judging.NOTHING), "")
        if all(fit.kind == "undecided" for fit in fits):
            return "its motion is along none of the vehicle's axes"
        return "" if any(self.known(fit) for fit in fits) else self.missing

    missing = "it does not move both north-south and east-west"

    def known(self, fit: axes.Fit) -> bool:
        """Return whether there was enough motion for this rule."""
        return fit.yaw_known

    def told(self, subject: judging.Subject) -> Values | None:
        """Return what the axes hold."""
        for fit, what, fields in (
            (subject.place, "position", ("x", "y", "z")),
            (subject.speed, "velocity", _velocity_fields(subject)),
        ):
            if isinstance(fit, axes.Fit) and fit.kind in self.kinds and self.counts(subject, fit):
                return {**fit_values(fit), "what": what, **_named(fit, fields)}
        return None

    def counts(self, _subject: judging.Subject, _fit: axes.Fit) -> bool:
        """Return whether a conclusion is of the kind that the rule is about."""
        return True


def _velocity_fields(subject: judging.Subject) -> tuple[str, str, str]:
    message = subject.track.key.message
    if message == "VISION_SPEED_ESTIMATE":
        return ("x", "y", "z")
    return ("vn", "ve", "vd") if message in ("GPS_INPUT", "HIL_GPS") else ("vx", "vy", "vz")


def _named(fit: axes.Fit, fields: tuple[str, str, str]) -> Values:
    """Return what the axes hold, by the names of the fields."""
    says = fit.says
    for axis, name in zip("xyz", fields, strict=True):
        says = says.replace(f"{axis} holds", f"{name} holds").replace(f"{axis} is ", f"{name} is ")
        says = says.replace(f"{axis} points", f"{name} points").replace(
            f"of {axis},", f"of {name},"
        )
    return {"says": says, "down_field": fields[2]}


def fit_values(fit: axes.Fit) -> Values:
    """Return a fit as values for texts."""
    return {
        "is_called": fit.name,
        "left": fit.residual_m,
        "labelled": fit.labelled_m,
        "measured_in": "m",
        "track_m": fit.track_m,
        "span_s": fit.span_s,
        "yaw_deg": float(np.degrees(fit.yaw)),
        "scale": fit.scale,
        "delay_s": fit.delay_s,
    }


class LocalAxes(_Axes):
    """Axes that hold something else than the label says."""

    kinds = ("permuted",)


class Vertical(_Axes):
    """Axes of which only the vertical one is reversed."""

    kinds = ("vertical",)
    missing = "it hardly climbs or sinks"

    def known(self, fit: axes.Fit) -> bool:
        """Return whether it climbed enough."""
        return fit.heights_known


class _Concluding(MotionCheck):
    """A rule about some conclusions of the judge: any one of them suffices."""

    aspects: tuple[str, ...] = ("lie",)
    """Which ones: fields of `judge.Subject`."""

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether there is something to conclude from."""
        return any(each != judging.NOTHING for each in self._found(subject))

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        found = [each for each in self._found(subject) if each != judging.NOTHING]
        reasons = [each for each in found if isinstance(each, str)]
        return reasons[0] if reasons and len(reasons) == len(found) else ""

    def _found(self, subject: judging.Subject) -> list[object]:
        return [getattr(subject, aspect) for aspect in self.aspects]


class _Poses(_Concluding):
    """A rule about the attitude in a pose."""

    lies: tuple[str, ...] = ()
    missing = "the vehicle hardly turns"

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        if isinstance(subject.lie, str):
            return subject.lie
        return "" if set(self.lies) <= subject.lie.told else self.missing

    def told(self, subject: judging.Subject) -> Values | None:
        """Return how the attitude is to be read; nothing where the whole pose is in other axes."""
        lie = subject.lie
        if isinstance(lie, str) or lie.kind not in self.lies or in_other_axes(subject):
            return None
        if not self.counts(subject, lie):
            return None
        return lie_values(lie)

    def counts(self, _subject: judging.Subject, _lie: attitude.Lie) -> bool:
        """Return whether a conclusion is of the kind that the rule is about."""
        return True


def in_other_axes(subject: judging.Subject) -> bool:
    """Return whether the position of a stream is in other axes than labelled: its attitude then is too."""
    return isinstance(subject.place, axes.Fit) and subject.place.kind not in ("agrees", "undecided")


def lie_values(lie: attitude.Lie) -> Values:
    """Return a conclusion about an attitude as values for texts."""
    return {
        "says": lie.says,
        "left": float(np.degrees(lie.left)),
        "labelled": float(np.degrees(lie.labelled)),
        "measured_in": "degrees",
        "yaw_deg": float(np.degrees(lie.yaw)),
        "seconds": lie.seconds,
        "delay_s": lie.delay_s,
    }


def quarter(yaw_deg: float, tolerance_deg: float) -> bool:
    """Return whether a turn is one by 90 or 180 degrees."""
    return min(abs(abs(yaw_deg) - each) for each in (90.0, 180.0)) <= tolerance_deg


class QuarterTurn(MotionCheck):
    """Frames, or headings, that are off by 90 or 180 degrees."""

    quarters = True

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether a stream has a heading that must be from north."""
        told = any(each != judging.NOTHING for each in self._said(subject))
        return told and not subject.frame.free_heading

    def _said(self, subject: judging.Subject) -> tuple[axes.Fit | attitude.Lie | str, ...]:
        """Return what has a heading; that of a velocity alone is told by quarter turns only."""
        speed = (subject.speed,) if self.quarters else ()
        return (subject.place, *speed, subject.lie)

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        said = self._said(subject)
        if any(isinstance(each, axes.Fit) and not each.yaw_known for each in said):
            return "it does not move both north-south and east-west"
        if isinstance(subject.lie, attitude.Lie) and "yaw_offset" not in subject.lie.told:
            return "the vehicle hardly turns"
        reasons = (each for each in said if isinstance(each, str) and each != judging.NOTHING)
        return next(reasons, "")

    def told(self, subject: judging.Subject) -> Values | None:
        """Return by how much the heading is off."""
        place, lie = subject.place, subject.lie
        if isinstance(place, axes.Fit) and place.kind in ("turned", "quarter"):
            points = float(np.degrees(-place.yaw))  # where x points, seen from north
            values = {**fit_values(place), "what": "frame", "yaw_deg": points}
        elif isinstance(subject.speed, axes.Fit) and subject.speed.kind == "quarter":
            points = float(np.degrees(-subject.speed.yaw))
            values = {**fit_values(subject.speed), "what": "velocity", "yaw_deg": points}
        elif (
            isinstance(lie, attitude.Lie)
            and lie.kind == "yaw_offset"
            and not in_other_axes(subject)
        ):
            values = {**lie_values(lie), "what": "yaw"}
        else:
            return None
        off = abs(float(values["yaw_deg"] or 0.0))
        is_quarter = quarter(off, self.params["quarter_tolerance_deg"])
        enough = off >= self.params["min_yaw_deg"]
        if not enough or is_quarter != self.quarters or self._judge is None:
            return None
        return {**values, "may_be_aligned": self._judge.may_align(subject)}


class Unaligned(QuarterTurn):
    """Frames, or headings, that are off by any other constant angle."""

    quarters = False


class YawSign(_Poses):
    """Yaw that counts the wrong way."""

    lies = ("yaw_sign",)
    rotation = True


class EulerSwapped(_Poses):
    """Roll and pitch that have changed places."""

    lies = ("swapped",)
    missing = "the vehicle hardly tilts"


class QuaternionOrder(_Poses):
    """Quaternions in another order of elements: in poses, and in attitude setpoints."""

    lies = ("order",)
    rotation = True

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._setpoints = OrderOfSetpoints()

    def update(self, batch: Batch, context: Context) -> None:
        """Take in poses and setpoints."""
        super().update(batch, context)
        self._setpoints.update(batch, context)

    def finish(self) -> Iterable[Observation]:
        """Return what was found in either."""
        yield from super().finish()
        yield from self._setpoints.found()

    def verdict(self) -> Verdict:
        """Return the rows that could be told."""
        poses, rows = super().verdict(), self._setpoints.rows(self.only)
        return Verdict(poses.checked + rows, partly=poses.partly) if rows else poses


class BodyAxes(_Concluding):
    """Attitudes, or velocities, of front-left-up axes."""

    aspects = ("lie", "twist")

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether a stream says something of the body, and is no velocity alone."""
        return super().concerns(subject) and not _speed_alone(subject)

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        lie, turn = subject.lie, subject.twist
        if isinstance(turn, twist.Twist):
            return "" if "flu" in turn.told else "the vehicle moves along its nose alone"
        if turn != judging.NOTHING:
            return turn
        if isinstance(lie, str):
            return lie
        return "" if "body" in lie.told else "the vehicle hardly tilts"

    def told(self, subject: judging.Subject) -> Values | None:
        """Return which reading fits."""
        lie, turn = subject.lie, subject.twist
        angles = _euler(subject) and not in_other_axes(subject)
        if angles and isinstance(lie, attitude.Lie) and lie.kind == "body":
            return {**lie_values(lie), "what": "attitude"}
        if isinstance(turn, twist.Twist) and turn.kind == "flu":
            return {**twist_values(turn), "what": "velocity"}
        return None


def _speed_alone(subject: judging.Subject) -> bool:
    return subject.track.key.message == SpeedFrame.message


def _euler(subject: judging.Subject) -> bool:
    return subject.track.source.euler


def twist_values(turn: twist.Twist) -> Values:
    """Return a conclusion about a velocity as values for texts."""
    return {
        "says": turn.says,
        "left": turn.left_mps,
        "labelled": turn.labelled_mps,
        "measured_in": "m/s",
        "seconds": turn.seconds,
    }


class PoseRotation(_Poses):
    """Quaternions that do not belong to their position: the inverse, or of other axes."""

    lies = ("inverse", "frames", "body")
    missing = "the vehicle hardly turns and tilts"
    rotation = True

    def counts(self, subject: judging.Subject, _lie: attitude.Lie) -> bool:
        """Return whether it is a quaternion: angles have rules of their own."""
        return not _euler(subject)


class SensorMount(_Concluding):
    """Poses of a sensor that sits turned in the vehicle, as if they were the vehicle's."""

    aspects = ("place", "lie")

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether a stream from outside has a position or an attitude."""
        return super().concerns(subject) and not subject.by_autopilot

    def told(self, subject: judging.Subject) -> Values | None:
        """Return how the sensor lies."""
        place, lie = subject.place, subject.lie
        if isinstance(place, axes.Fit) and place.kind == "tilted":
            return {**fit_values(place), "what": "position", "says": place.says}
        if isinstance(lie, attitude.Lie) and lie.kind == "mount" and not in_other_axes(subject):
            return {**lie_values(lie), "what": "attitude"}
        return None


class VectorFrame(_Concluding):
    """Velocities that are in the axes of the world where the label says the body, and the reverse."""

    aspects = ("twist",)
    message = "ODOMETRY"
    right: tuple[str, ...] = ("labelled", "flu")

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether a stream has a velocity of the kind that the rule is about."""
        return super().concerns(subject) and subject.track.key.message == self.message

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        turn = subject.twist
        if isinstance(turn, str):
            return turn
        other = turn.told & {"world", "body"}
        return "" if other else "the vehicle points along the axes of the world"

    def told(self, subject: judging.Subject) -> Values | None:
        """Return which axes fit; nothing where the whole pose is in other axes."""
        turn = subject.twist
        if isinstance(turn, str) or turn.kind in self.right or in_other_axes(subject):
            return None
        return twist_values(turn)


class SpeedFrame(VectorFrame):
    """Velocities from vision that are in the axes of the body."""

    message = "VISION_SPEED_ESTIMATE"
    right = ("labelled", "inverse", "enu", "nwu")


class EstimateScale(MotionCheck):
    """Positions whose metres are longer or shorter than the vehicle's."""

    def concerns(self, subject: judging.Subject) -> bool:
        """Return whether a stream is an estimate from outside."""
        return subject.place != judging.NOTHING and not subject.by_autopilot

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell."""
        fit = subject.place
        if isinstance(fit, str):
            return fit
        if fit.track_m < self.params["min_track_m"]:
            return f"less than {self.params['min_track_m']:.0f} m of track"
        sure = self._sure(fit) and fit.kind != "undecided"
        return "" if sure else "its motion does not follow the vehicle's closely"

    def _sure(self, fit: axes.Fit) -> bool:
        per_step = fit.track_m and fit.residual_m <= self.params["max_residual_share"] * _step_m(
            fit
        )
        return fit.track_m >= self.params["min_track_m"] and bool(per_step)

    def told(self, subject: judging.Subject) -> Values | None:
        """Return the scale."""
        fit = subject.place
        if isinstance(fit, str) or not self._sure(fit) or fit.kind == "undecided":
            return None
        limit = 1 + self.params["tolerance"]
        wrong = fit.scale > limit or fit.scale < 1 / limit
        return fit_values(fit) if wrong else None


class LeverArm(_Concluding):
    """Positions of a sensor beside the vehicle's point of reference, as if they were that point's."""

    aspects = ("lever",)

    def why_not(self, subject: judging.Subject) -> str:
        """Return what was missing to tell: silence counts where a short arm would have shown."""
        arm = subject.lever
        if isinstance(arm, str):
            return arm
        if self._long(arm):
            return ""
        if arm.shows_m > self.params["shows_m"]:
            return f"only an arm longer than {arm.shows_m:.2f} m would show"
        fed = self._judge is not None and self._judge.may_feed(subject)
        return "the vehicle's own position may be made from it" if fed else ""

    def _long(self, arm: lever.Lever) -> bool:
        return arm.there and arm.length_m >= self.params["min_arm_m"]

    def told(self, subject: judging.Subject) -> Values | None:
        """Return the arm."""
        arm = subject.lever
        if isinstance(arm, str) or not self._long(arm):
            return None
        return {
            "what": "lever arm",
            "says": arm.says,
            "arm_m": arm.length_m,
            "error_m": arm.error_m,
            "left": arm.left_m,
            "labelled": arm.labelled_m,
            "measured_in": "m",
            "span_s": lever.SPAN_S,
            "seconds": arm.seconds,
        }


def _step_m(fit: axes.Fit) -> float:
    """Return the usual displacement, m."""
    return fit.step_m
