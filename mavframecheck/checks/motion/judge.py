"""The kinematic judge: every stream of poses and velocities beside what the vehicle itself really did.

It listens once for all rules of a recording, and draws its conclusions once, at the end. An estimate is
never judged by itself: where the vehicle's own position may be made from the stream under test, GNSS or the
truth of a simulator has to confirm it.
"""

from __future__ import annotations

import functools
import weakref
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check
from mavframecheck.checks.motion import attitude as attitudes
from mavframecheck.checks.motion import axes, lever, twist
from mavframecheck.checks.motion.series import Series, series_of
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.tracks import Track, Tracks
from mavframecheck.wire import Batch, Dialect, Table

if TYPE_CHECKING:
    from mavframecheck.model.trace import Figure

Floats = npt.NDArray[np.float64]

POSES = (
    "VISION_POSITION_ESTIMATE",
    "GLOBAL_VISION_POSITION_ESTIMATE",
    "VICON_POSITION_ESTIMATE",
    "ATT_POS_MOCAP",
    "ODOMETRY",
    "LOCAL_POSITION_NED",
)
VELOCITIES = (
    "VISION_SPEED_ESTIMATE",
    "GPS_INPUT",
    "HIL_GPS",
    "GLOBAL_POSITION_INT",
    "LOCAL_POSITION_NED",
)
_OFFSETS = (b"VISO_POS_X", b"VISO_POS_Y", b"EKF2_EV_POS_X", b"EKF2_EV_POS_Y")
"""Where autopilots are told that the sensor sits, m: they take it into account."""
_PARAMETERS = (
    *(b"EK3_SRC1_POSXY", b"EK3_SRC1_POSZ", b"EK3_SRC1_YAW", b"EKF2_EV_CTRL", b"VISO_TYPE"),
    *_OFFSETS,
)
_ALIGNING = (2, 3)
"""VISO_TYPE of cameras whose heading ArduPilot aligns itself."""
_EXTERNAL = 6


def _frame(name: str) -> int:
    return constant(f"MAV_FRAME.{name}")


@functools.cache
def frames() -> dict[int, axes.Frame]:
    """Return what the axes of a stream are, by MAV_FRAME."""
    flu = np.diag([1.0, -1, -1])
    enu = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    return {
        _frame("LOCAL_NED"): axes.NED,
        _frame("LOCAL_ENU"): axes.Frame(enu, free_heading=False, name="east, north, up"),
        _frame("LOCAL_FRD"): axes.Frame(np.eye(3), free_heading=True, name="forward, right, down"),
        _frame("LOCAL_FLU"): axes.Frame(flu, free_heading=True, name="forward, left, up"),
    }


NOTHING = "it holds none"
"""In place of a conclusion: the stream has no such quantity."""


class Subject(NamedTuple):
    """A stream, and what was concluded about it."""

    track: Track
    system: int
    """The vehicle that it is about."""
    by_autopilot: bool
    frame: axes.Frame
    reference: str
    """Message that it was compared with."""
    place: axes.Fit | str
    lie: attitudes.Lie | str
    twist: twist.Twist | str
    speed: axes.Fit | str
    """Its velocity, added up, where that is labelled as of the world."""
    lever: lever.Lever | str
    """How far beside the vehicle's point of reference it measures."""


class _Truth(NamedTuple):
    """What a vehicle really did."""

    place: Series | None
    why: str
    """Why there is none."""
    attitude: Series | None
    rate: float
    """Seconds of the vehicle's clock per second of receive time."""


_JUDGES: weakref.WeakKeyDictionary[Context, Judge] = weakref.WeakKeyDictionary()


class Judge:
    """The streams of one recording."""

    def __init__(self) -> None:
        """Listen with nothing heard so far."""
        self.only: int | None = None
        """The sender whose streams are judged; None: everybody's."""
        self._tracks = Tracks()
        self._batch: weakref.ref[Batch] | None = None
        self.parameters: dict[tuple[int, bytes], float] = {}
        self._roles: dict[int, str] = {}

    @staticmethod
    def of(context: Context) -> Judge:
        """Return the judge that all rules of a recording share."""
        return _JUDGES.setdefault(context, Judge())

    def update(self, batch: Batch, context: Context) -> None:
        """Take in a batch, once."""
        if self._batch is not None and self._batch() is batch:
            return
        self._batch = weakref.ref(batch)
        self._tracks.update(batch)
        table = batch.tables.get("PARAM_VALUE")
        if table is not None:
            self._learn(table)
        self._roles = {key.sender: context.role(key.sender) for key in self._tracks.tracks}

    def _learn(self, table: Table) -> None:
        named = np.flatnonzero(np.isin(table["param_id"], _PARAMETERS))
        for row in named.tolist():
            key = int(table.frames.sysid[row]), bytes(table["param_id"][row])
            value = table["param_value"][row : row + 1]
            real = not int(table["param_type"][row]) <= 8 or float(value[0]).is_integer()
            self.parameters[key] = float(value[0] if real else value.view(np.int32)[0])

    def tracks_of(self, message: str) -> list[Track]:
        """Return the tracks of a message, of all senders."""
        return [track for track in self.tracks if track.key.message == message]

    @property
    def tracks(self) -> list[Track]:
        """All tracks, in the order in which they are first heard."""
        return list(self._tracks.tracks.values())

    def role(self, sender: int) -> str:
        """Return what a sender is: ``autopilot``..."""
        return self._roles[sender]

    @property
    def t0_us(self) -> int | None:
        """The receive time that those of tracks count from, us; None as long as there is none."""
        return self._tracks.t0_us

    @property
    def timed(self) -> bool:
        """Whether there are receive times."""
        return self._tracks.timed

    def figures(self, subject: Subject, about: str) -> tuple[Figure, ...]:
        """Return what proves a conclusion about a stream: ``place``, ``speed``, ``lie``, ``twist``, ``lever``."""
        from mavframecheck.checks.motion import figures

        stream, truth = self.series(subject.track), self._truth(subject.system, subject.track)
        told, t0_s = getattr(subject, about), (self._tracks.t0_us or 0) * 1e-6
        place, lies = truth.place, truth.attitude
        if isinstance(told, axes.Fit) and place is not None:
            moved = stream.integrated(truth.rate) if about == "speed" else stream
            return tuple(figures.of_axes(told, subject.frame, moved, place, t0_s))
        if isinstance(told, attitudes.Lie) and lies is not None:
            return tuple(figures.of_attitude(told, stream, lies, t0_s))
        if place is None or lies is None:
            return ()
        if isinstance(told, twist.Twist):
            return tuple(figures.of_twist(told, stream, place, lies, t0_s))
        if isinstance(told, lever.Lever) and isinstance(subject.place, axes.Fit):
            steps = lever.steps_of(stream, place, lies, subject.place)
            return tuple(figures.of_lever(steps, place.message, t0_s))
        return ()

    @functools.cached_property
    def subjects(self) -> list[Subject]:
        """Return every stream of poses or velocities, judged."""
        return list(self._judged())

    def _judged(self) -> Iterator[Subject]:
        for track in list(self._tracks.tracks.values()):
            asked = self.only in (None, track.key.sender)
            if asked and track.key.message in (*POSES, *VELOCITIES):
                system = self.about(track.key.sender)
                own = self._roles[track.key.sender] == "autopilot"
                if not (own and track.key.message == "ODOMETRY"):
                    yield self._subject(track, system, own=own)

    def about(self, sender: int) -> int:
        """Return the system a sender speaks of: its own, else the only one with an autopilot."""
        systems = {each >> 8 for each, role in self._roles.items() if role == "autopilot"}
        if sender >> 8 in systems:
            return sender >> 8
        return systems.pop() if len(systems) == 1 else -1

    def _subject(self, track: Track, system: int, *, own: bool) -> Subject:
        nothing = NOTHING
        frame = self._frame_of(track, system)
        if frame is None:
            why = "its frame has no axes that could be compared"
            return Subject(track, system, own, axes.NED, "", why, why, why, why, why)
        truth = self._truth(system, track)
        stream = self.series(track)
        reference = truth.place.message if truth.place is not None else ""
        judged = Subject(
            track, system, own, frame, reference, nothing, nothing, nothing, nothing, nothing
        )
        if track.key.message in POSES:
            judged = judged._replace(place=self._place(stream, truth, frame))
            if not own:
                judged = judged._replace(lever=self._lever(stream, truth, judged))
        if track.source.attitude is not None and not own:
            judged = judged._replace(lie=self._lie(stream, truth, judged))
        if track.source.velocity is not None and track.key.message != "ODOMETRY":
            judged = judged._replace(speed=self._speed(stream, truth, frame))
        if track.key.message in ("ODOMETRY", "VISION_SPEED_ESTIMATE"):
            judged = judged._replace(twist=self._twist(stream, truth, judged))
        return judged

    def _frame_of(self, track: Track, system: int) -> axes.Frame | None:
        if track.key.message == "ODOMETRY":
            return frames().get(track.key.variant[0])
        if (
            self.parameters.get((system, b"VISO_TYPE")) in _ALIGNING
            and track.key.message == POSES[0]
        ):
            return frames()[_frame("LOCAL_FRD")]
        return axes.NED

    def may_align(self, subject: Subject) -> bool:
        """Return whether the autopilot may turn the heading of a stream itself: no parameter tells."""
        told = {name for system, name in self.parameters if system == subject.system}
        told &= {b"VISO_TYPE", b"EKF2_EV_CTRL"}
        return subject.track.key.message == POSES[0] and not told

    def series(self, track: Track) -> Series:
        """Return the samples of a track, made once."""
        if track.key not in self._cache:
            self._cache[track.key] = series_of(track)
        return self._cache[track.key]

    @functools.cached_property
    def _cache(self) -> dict[object, Series]:
        return {}

    def own(self, system: int, message: str) -> Track | None:
        """Return the track of a message of a system's autopilot; the longest of several."""
        found = [
            track
            for key, track in self._tracks.tracks.items()
            if key.message == message
            and key.sender >> 8 == system
            and self._roles[key.sender] == "autopilot"
        ]
        return max(found, key=lambda track: track.rows) if found else None

    def _truth(self, system: int, subject: Track) -> _Truth:
        """Return what is independent of a stream."""
        attitude = self.own(system, "ATTITUDE") or self.own(system, "ATTITUDE_QUATERNION")
        place, why = self._place_of(system)
        if subject.key.message == "GLOBAL_POSITION_INT" and place is None:
            place = self.series(subject)
        lies = None if attitude is None else self.series(attitude)
        return _Truth(place, why, lies, 1.0 if lies is None else rate_of(lies))

    def _place_of(self, system: int) -> tuple[Series | None, str]:
        """Return the position to compare with; or why there is none."""
        if not self.timed:
            return None, "the recording has no receive times"
        if system not in self._places:
            self._places[system] = self._find_place(system)
        return self._places[system]

    @functools.cached_property
    def _places(self) -> dict[int, tuple[Series | None, str]]:
        return {}

    def _find_place(self, system: int) -> tuple[Series | None, str]:
        whole = self.own(system, "GLOBAL_POSITION_INT")
        gnss = self.own(system, "GPS_RAW_INT")
        truth = self.own(system, "SIMSTATE")
        own = None if whole is None else self.series(whole)
        for witness in (gnss, truth):
            if witness is None:
                continue
            seen = self.series(witness)
            if own is not None and _confirms(seen, own):
                return own, ""
            if witness is gnss and len(seen.t) > 20:
                return seen, ""
            if witness is truth:
                return seen, ""
        if own is not None and not self._fed(system):
            return own, ""
        if own is None:
            return None, "no GLOBAL_POSITION_INT and no GNSS position of the vehicle"
        return None, (
            "the vehicle's own position may be made from it, and neither a GNSS fix nor the truth of a "
            "simulator tells where it was"
        )

    def may_feed(self, subject: Subject) -> bool:
        """Return whether what a stream was compared with may be made from it, and shows only a part of what it shows."""
        return subject.reference == "GLOBAL_POSITION_INT" and self._fed(subject.system)

    def _fed(self, system: int) -> bool:
        """Return whether the estimator of a vehicle may be fed by external poses; yes where unknown."""
        sources = [self.parameters.get((system, n)) for n in (b"EK3_SRC1_POSXY", b"EK3_SRC1_POSZ")]
        control = self.parameters.get((system, b"EKF2_EV_CTRL"))
        if control is not None:
            return control != 0
        return None in sources or _EXTERNAL in sources

    def _place(self, stream: Series, truth: _Truth, frame: axes.Frame) -> axes.Fit | str:
        if truth.place is None:
            return truth.why
        fit = axes.compare(stream, truth.place, frame)
        return fit.why if isinstance(fit, axes.Undecided) else fit

    def _lever(self, stream: Series, truth: _Truth, judged: Subject) -> lever.Lever | str:
        fit = judged.place
        if isinstance(fit, str):
            return fit
        if truth.place is None or truth.attitude is None:
            return "no ATTITUDE of the vehicle"
        if fit.kind != "agrees":
            return "its axes are not those that it names"
        if any(self.parameters.get((judged.system, name)) for name in _OFFSETS):
            return "the autopilot is told where the sensor sits"
        return lever.compare(stream, truth.place, truth.attitude, fit)

    def _speed(self, stream: Series, truth: _Truth, frame: axes.Frame) -> axes.Fit | str:
        if truth.place is None:
            return truth.why
        fit = axes.compare(stream.integrated(truth.rate), truth.place, frame)
        return fit.why if isinstance(fit, axes.Undecided) else fit

    def _lie(self, stream: Series, truth: _Truth, judged: Subject) -> attitudes.Lie | str:
        if truth.attitude is None:
            return "no ATTITUDE of the vehicle"
        since = 0.0 if truth.place is None else _first_move(truth.place)
        fit = judged.place
        known = isinstance(fit, axes.Fit) and fit.delay_known
        delays = (
            np.array([fit.delay_s]) if isinstance(fit, axes.Fit) and known else attitudes.DELAYS_S
        )
        return attitudes.compare(
            stream,
            truth.attitude,
            free_heading=judged.frame.free_heading,
            since_s=since,
            delays=delays,
        )

    def _twist(self, stream: Series, truth: _Truth, judged: Subject) -> twist.Twist | str:
        world, child = judged.track.key.variant or (_frame("LOCAL_NED"),) * 2
        body = child in (_frame("BODY_FRD"), _frame("BODY_NED"))
        if truth.place is None or truth.attitude is None:
            return truth.why or "no ATTITUDE of the vehicle"
        if not body and child != world:
            return "its child frame has no axes that could be compared"
        fit = judged.place
        known = isinstance(fit, axes.Fit) and fit.yaw_known
        yaw = fit.yaw if known and isinstance(fit, axes.Fit) else 0.0
        if judged.frame.free_heading and not known:
            return "the heading of its frame is not known"
        delay = fit.delay_s if isinstance(fit, axes.Fit) and fit.delay_known else 0.05
        return twist.compare(
            stream,
            truth.place,
            truth.attitude,
            body=body,
            yaw=yaw,
            delay_s=delay,
            rate=truth.rate,
        )


def rate_of(series: Series) -> float:
    """Return seconds of the stamps per second of receive time."""
    good = np.isfinite(series.stamp)
    t, stamp = series.t[good], series.stamp[good]
    if len(t) < 20:
        return 1.0
    half = len(t) // 2
    rates = (stamp[half:] - stamp[: len(t) - half]) / (t[half:] - t[: len(t) - half])
    rate = float(np.median(rates))
    return rate if 0.05 < rate < 100 else 1.0


def _confirms(witness: Series, own: Series) -> bool:
    """Return whether a vehicle's own position goes where the witness goes."""
    fit = axes.compare(own, witness, axes.NED)
    if isinstance(fit, axes.Undecided):
        return False
    return fit.kind == "agrees" and fit.yaw_known


def _first_move(place: Series) -> float:
    """Return when the vehicle left the place where it was first heard, s; forever where it did not."""
    given = np.isfinite(place.place[:, :2]).all(axis=1)
    where, t = np.nan_to_num(place.place[given]), place.t[given]
    if not len(t):
        return np.inf
    away = np.linalg.norm(where - where[0], axis=1) > 1.0
    return float(t[np.argmax(away)]) if away.any() else np.inf


class Listener(Check):
    """A check that asks the judge of the recording, which it lets hear every batch."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._judge: Judge | None = None

    def update(self, batch: Batch, context: Context) -> None:
        """Let the judge that all these rules share hear a batch."""
        self._judge = Judge.of(context)
        self._judge.only = self.only
        self._judge.update(batch, context)
