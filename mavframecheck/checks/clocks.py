"""Checks of clocks: what stamps say of themselves, of each other and of the time they are received.

All share one model, `Context.clocks`; what it shows is drawn once, when the recording is read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.enums import Clock
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.clocks import MAX_EVENTS, StepBack, Still
from mavframecheck.vehicle.timing import STEP_S, Clocks, Pool, Step, Timing, wraps
from mavframecheck.wire import Batch, Dialect, Place

if TYPE_CHECKING:
    from mavframecheck.model.trace import Figure

Floats = npt.NDArray[np.float64]

_EXCHANGES = ("TIMESYNC", "PING")
_LATE = 128
"""From here on a sequence counter went back rather than forward."""


class ClockCheck(Check):
    """A check of the clocks of a recording."""

    timed = False
    """Whether nothing can be said without receive times."""
    undecided = ""
    """Why it cannot say anything where it has no stream to judge."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know nothing yet."""
        super().__init__(params, dialect)
        self._context: Context | None = None

    def update(self, _batch: Batch, context: Context) -> None:
        """Have the stamps of a batch taken in."""
        self._context = context
        _ = context.clocks

    @property
    def context(self) -> Context:
        """What the recording said of its vehicles."""
        return Context() if self._context is None else self._context

    @property
    def clocks(self) -> Clocks:
        """The clocks of the whole recording."""
        return self.context.timing

    def judged(self) -> Sequence[Timing]:
        """Return the streams that the check can say something about."""
        return self.clocks.timings

    def verdict(self) -> Verdict:
        """Return the stamped rows of the streams looked at."""
        judged = (each for each in self.judged() if self.concerns_sender(each.sender))
        rows = sum(timing.stream.stamped for timing in judged)
        heard = any(self.concerns_sender(each.sender) for each in self.clocks.timings)
        if self.timed and heard and not self.clocks.received:
            return Verdict(0, "the recording has no receive times that can be believed")
        return Verdict(rows, self.undecided if heard and not rows else "")

    def figures(self, observation: Observation) -> tuple[Figure, ...]:
        """Return how the clock of the stream, or else of its component, ran against receive time."""
        from mavframecheck.checks.clock_figures import offsets

        return tuple(offsets(self.clocks, observation.subject))

    def autopilot(self, sender: int) -> bool:
        """Return whether a sender is an autopilot."""
        return self.clocks.role(sender) == "autopilot"


def subject(timing: Timing) -> Subject:
    """Return the stream as the subject of a finding."""
    return Subject(*timing.stream.subject)


def ends(timing: Timing) -> tuple[Place, Place]:
    """Return the first and the last stamped frame of a stream."""
    first, last = timing.stream.first, timing.stream.last
    if first is None or last is None:
        raise ValueError("a stream without stamps has no timing")
    return first, last


def words(listed: object) -> list[str]:
    """Return the names in a parameter that lists some."""
    return str(listed).split()


class BackwardStamps(ClockCheck):
    """Stamps that are earlier than those before them, although nothing restarted."""

    def judged(self) -> Sequence[Timing]:
        """Return the streams of senders whose frames kept their order; exchanges have their own rule."""
        return [
            timing
            for timing in self.clocks.timings
            if timing.sender not in self.clocks.disordered
            and not timing.copied
            and timing.stream.key.message not in _EXCHANGES
        ]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that goes back, far or often."""
        for timing in self.judged():
            steps = [each for each in timing.stream.backs if self._unexcused(timing, each)]
            far = [each for each in steps if _back_s(timing, each) >= self.params["min_step_s"]]
            if far or self._often(timing, steps):
                worst = max(steps, key=lambda each: each.stamp_before - each.stamp_after)
                times = len(far) or timing.stream.back - timing.stream.late
                values: dict[str, Scalar] = {
                    "times": times,
                    "step_s": _back_s(timing, worst),
                    "before_s": timing.seconds(worst.stamp_before),
                    "after_s": timing.seconds(worst.stamp_after),
                    "rows": timing.stream.stamped,
                }
                found = far or steps
                first, last = found[0].after, found[-1].after
                yield Observation(subject(timing), first, last, times, values)

    def _unexcused(self, timing: Timing, each: StepBack) -> bool:
        if self.autopilot(timing.sender) and timing.stream.since_unix:
            return False
        return each.sent_between < _LATE and id(each) not in self.clocks.excused

    def _often(self, timing: Timing, steps: list[StepBack]) -> bool:
        """Return whether small steps are too many to be chance."""
        if self.autopilot(timing.sender) or not steps:
            return False
        times = timing.stream.back - timing.stream.late
        enough = times >= self.params["min_times"]
        return bool(enough and times >= self.params["min_share"] * timing.stream.stamped)


def _back_s(timing: Timing, each: StepBack) -> float:
    return timing.seconds(each.stamp_before - each.stamp_after)


def at(knot: np.void) -> Place:
    """Return the first frame of a knot."""
    return Place(*(int(knot[name]) for name in ("number", "t_us", "offset", "size")))


class ChangingClocks(ClockCheck):
    """Streams whose stamps count from a boot first and from 1970 then, or the reverse."""

    def judged(self) -> Sequence[Timing]:
        """Return the streams whose field may hold either."""
        either = (Clock.AMBIGUOUS, Clock.BOOT, Clock.SENDER)
        return [
            timing
            for timing in self.clocks.timings
            if timing.stream.field.clock in either and timing.stream.key.message != "TIMESYNC"
        ]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that has enough of both."""
        for timing in self.judged():
            stream, changes = timing.stream, timing.stream.epochs
            fewest = min(stream.since_unix, stream.stamped - stream.since_unix)
            if not changes or fewest < self.params["min_rows"]:
                continue
            first = changes[0]
            values: dict[str, Scalar] = {
                "before_s": timing.seconds(first.stamp_before),
                "after_s": timing.seconds(first.stamp_after),
                "changes": len(changes),
                "change": _CHANGES[first.stamp_after > first.stamp_before],
                "role": self.clocks.role(timing.sender),
            }
            last = changes[-1].after
            yield Observation(subject(timing), first.after, last, len(changes), values)


_CHANGES = {
    True: "time since boot to time since 1970",
    False: "time since 1970 to time since boot",
}


class FrozenStamps(ClockCheck):
    """Stamps that stand still while the values go on."""

    def judged(self) -> Sequence[Timing]:
        """Return the streams whose stamps move at all, receivers without a fix left out."""
        excepted = words(self.params["excepted"])
        return [
            timing
            for timing in self.clocks.timings
            if timing.stream.moves >= self.params["min_moves"]
            and timing.stream.key.message not in excepted
        ]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that stood still for long."""
        for timing in self.judged():
            long = [each for each in _stills(timing) if self._long(each)]
            if long:
                worst = max(long, key=lambda each: each.seconds)
                values: dict[str, Scalar] = {
                    "seconds": worst.seconds,
                    "stamp": worst.stamp,
                    "rows": worst.rows,
                    "others": f" (the longest of {len(long)} such stretches)"
                    if len(long) > 1
                    else "",
                }
                times = sum(each.rows for each in long)
                yield Observation(subject(timing), long[0].first, long[-1].last, times, values)

    def _long(self, each: Still) -> bool:
        changing = each.changed >= self.params["min_changed_share"] * each.rows
        return bool(changing and each.seconds >= self.params["min_seconds"])


def _stills(timing: Timing) -> list[Still]:
    """Return where the stamps of a stream stood still, the stretch at the end included."""
    standing = timing.stream.standing()
    return [*timing.stream.stills, *([] if standing is None else [standing])]


class Wraps(ClockCheck):
    """Counters of 32 bits that start over."""

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that starts over."""
        for timing in self.clocks.timings:
            over = [each for each in timing.stream.backs if wraps(timing, each)]
            if over:
                period_s = 2**32 * timing.unit_s
                values: dict[str, Scalar] = {
                    "times": len(over),
                    "bits": timing.stream.field.bits,
                    "period_s": period_s,
                    "period": f"{period_s / 60:.1f} min" if period_s < 1e5 else "49.7 days",
                    "before": over[0].stamp_before,
                    "after": over[0].stamp_after,
                }
                first, last = over[0].after, over[-1].after
                yield Observation(subject(timing), first, last, len(over), values)


class Restarts(ClockCheck):
    """Components that begin again."""

    def finish(self) -> Iterable[Observation]:
        """Return one observation per restart that several streams agree on."""
        for each in self.clocks.restarts:
            if each.streams >= self.params["min_streams"]:
                values: dict[str, Scalar] = {
                    "uptime_s": each.uptime_s,
                    "since_s": each.since_s,
                    "streams": each.streams,
                    "role": self.clocks.role(each.sender),
                }
                who = Subject(each.sender >> 8, each.sender & 0xFF)
                yield Observation(who, each.seen, each.seen, 1, values)


def alike(timing: Timing, pool: Pool) -> bool:
    """Return whether a stream runs at about the rate of a clock."""
    return timing.rate is not None and 0.5 < timing.rate / pool.rate < 2.0


class ReceiveClockSteps(ClockCheck):
    """The recorder's clock was set while recording: receive time steps, stamps do not."""

    timed = True

    def judged(self) -> Sequence[Timing]:
        """Return the streams that run against receive time."""
        return [t for t in self.clocks.timings if t.rate is not None]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per step that the running streams agree on."""
        clusters = _clusters(self._candidates())
        if len(clusters) > self.params["max_steps"]:
            return
        for cluster in clusters:
            agree = {id(timing) for timing, _ in cluster}
            low = max(step.before for _, step in cluster)
            high = min(step.seen.number for _, step in cluster)
            denied = [t for t in self.judged() if id(t) not in agree and _spans(t, low, high)]
            step = min((s for _, s in cluster), key=lambda s: s.seen.number - s.before)
            offset_s = float(np.median([s.offset_s for _, s in cluster]))
            if len(agree) <= len(denied) or not self._plain(step, agree):
                continue
            values: dict[str, Scalar] = {
                "step_s": offset_s,
                "size_s": abs(offset_s),
                "direction": "back" if offset_s < 0 else "forward",
                "streams": len(agree),
            }
            yield Observation(Subject(), step.seen, step.seen, 1, values)

    def _candidates(self) -> list[tuple[Timing, Step]]:
        """Return the steps in which a stamp went on, and receive time went back or leapt."""
        back, leap = self.params["min_back_s"], self.params["min_forward_s"]
        return [
            (timing, step)
            for timing in self.judged()
            for step in timing.steps
            if step.stamp_s >= 0 and (step.offset_s <= -back or step.offset_s >= leap)
            if step.receive_s < 0 or step.stamp_s < 0.25 * step.receive_s
        ]

    def _plain(self, step: Step, agree: set[int]) -> bool:
        """Return whether nothing else explains it: a pause of the vehicle has frames of others in it."""
        if len(agree) < self.params["min_streams"]:
            return False
        return step.receive_s < 0 or step.seen.number - step.before <= 2


def _spans(timing: Timing, low: int, high: int) -> bool:
    """Return whether a stream has rows before and after a place."""
    first, last = timing.stream.first, timing.stream.last
    return first is not None and last is not None and first.number <= low and last.number >= high


def _clusters(steps: list[tuple[Timing, Step]]) -> list[list[tuple[Timing, Step]]]:
    """Put steps together that may be one: by place and size."""
    clusters: list[list[tuple[Timing, Step]]] = []
    for timing, step in sorted(steps, key=lambda pair: pair[1].before):
        for cluster in clusters[-4:]:
            other = cluster[0][1]
            same = abs(step.offset_s - other.offset_s) <= STEP_S + 0.1 * abs(other.offset_s)
            if same and step.before <= other.seen.number and other.before <= step.seen.number:
                cluster.append((timing, step))
                break
        else:
            clusters.append([(timing, step)])
    return clusters


class SharedSystemId(ClockCheck):
    """Two components that speak under one id: their clocks take turns."""

    def finish(self) -> Iterable[Observation]:
        """Return one observation per sender of which most streams jump between two clocks."""
        for sender, timings in self.clocks.of.items():
            streams = [t for t in timings if t.stream.stamped >= self.params["min_rows"]]
            apart = [self._apart_s(timing) for timing in streams]
            two = [timing for timing, each in zip(streams, apart) if each]
            if len(two) < self.params["min_streams"] or len(two) * 2 < len(streams):
                continue
            first = min(two, key=lambda timing: timing.stream.backs[0].after.number)
            last = max(ends(timing)[1] for timing in two)
            switches = sum(timing.stream.back for timing in two)
            values: dict[str, Scalar] = {
                "apart_s": float(np.median([each for each in apart if each])),
                "switches": switches,
                "streams": len(two),
            }
            who = Subject(sender >> 8, sender & 0xFF)
            yield Observation(who, first.stream.backs[0].after, last, switches, values)

    def _apart_s(self, timing: Timing) -> float:
        """Return how far apart the two clocks of a stream are, 0 where there is one."""
        if timing.stream.back < self.params["min_switches"] or timing.stream.since_unix:
            return 0.0
        steps = np.array([_back_s(timing, each) for each in timing.stream.backs[:MAX_EVENTS]])
        usual = float(np.median(steps))
        same = np.mean(np.abs(steps - usual) <= 0.1 * usual) >= self.params["min_share"]
        far = usual >= self.params["min_apart_s"]
        return usual if far and same and not timing.copied else 0.0
