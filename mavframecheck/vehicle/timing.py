"""What clocks do, drawn from the records of `clocks`: rate, offset, latency, steps, restarts, domain.

Times are seconds; receive times since 1970, stamps since whatever they count from. The *lag* of a row is
its receive time minus its stamp (the stamp brought to receive time by the rate of its clock): its least
value is the offset of the clock, what is above it is latency.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics.enums import Clock
from mavframecheck.vehicle.clocks import (
    MAX_KNOTS,
    ClockBook,
    StampStream,
    StepBack,
)
from mavframecheck.wire import Place

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

STEP_S = 1.0
"""A clock that moved this much more or less than another one (s) may have been set."""
_STEP_SHARE = 0.75
"""... if that is most of the way either of them went: simulations run fast and slow by turns."""
SLACK_S = 5.0
"""A component that restarted between two rows cannot have been up for longer than the time between them,
give or take this (s), which frames may wait on their way."""
_YOUNG_S = 120.0
"""Without receive times: up for no longer than this (s) after a restart."""
SAME_CLOCK_S = 1.0
"""Clocks whose offsets differ by less (s) count as one."""
_ALIKE = 2.0
"""Streams of one clock have rates within this factor; another unit is 1000 times off."""
_COPIED_SHARE = 0.1
"""Of the rows of a stream with copies, so many have an earlier stamp than the one before."""
_AROUND, _AROUND_FRAMES = 4, 100
"""The offset of a clock is the least lag within so many stretches, and frames, on either side."""
_ROUND = 16
"""Rates are medians over this part of the recording: a few steps do not matter."""


class Step(NamedTuple):
    """A stretch over which receive time and stamp went different ways."""

    before: int
    """Number of the last frame before it."""
    seen: Place
    """The first frame after it."""
    receive_s: float
    """How far receive time went, s."""
    stamp_s: float
    """How far the stamp went, s."""

    @property
    def offset_s(self) -> float:
        """Return by how much receive time went further."""
        return self.receive_s - self.stamp_s


class Restart(NamedTuple):
    """The clock of a component begins again."""

    sender: int
    seen: Place
    uptime_s: float
    """Stamp before, s."""
    since_s: float
    """Stamp after, s."""
    streams: int
    """Streams that agree."""


class Timing:
    """What the stamps of one stream show."""

    def __init__(self, stream: StampStream) -> None:
        """Draw conclusions from `stream`, divided as the whole recording is."""
        self.stream = stream
        self.unit_s = stream.field.unit_us * 1e-6
        self.sender = stream.key.sender

    @functools.cached_property
    def rate(self) -> float | None:
        """Seconds of the stamp in a second of receive time; None if it is too short, or stands still."""
        knots = self.stream.knots
        t, stamp = _seconds(knots["low_t_us"], 1e-6), _seconds(knots["low_stamp"], self.unit_s)
        apart = max(1, len(t) // _ROUND)
        moved = t[apart:] - t[:-apart]
        forward = moved > 0
        if np.count_nonzero(forward) < 3 or self.stream.moves < 3:
            return None
        rates = (stamp[apart:] - stamp[:-apart])[forward] / moved[forward]
        rate = float(np.median(rates))
        return rate if rate > 0 else None

    @functools.cached_property
    def copied(self) -> bool:
        """Return whether a slow second link brings messages again, some seconds later.

        Its copies begin with stamps that were there before, and take turns with the others.
        """
        stream = self.stream
        if stream.back < _COPIED_SHARE * stream.stamped or not stream.backs or stream.first is None:
            return False
        step = stream.backs[0]
        if step.stamp_after < stream.first_stamp:
            return False
        if stream.first.t_us is None or step.before.t_us is None:
            return True
        elapsed_s = (step.before.t_us - stream.first.t_us) * 1e-6 * (self.rate or 1.0)
        return self.seconds(step.stamp_before - stream.first_stamp) < 2 * elapsed_s + STEP_S

    @functools.cached_property
    def span_s(self) -> float:
        """Receive time between the earliest and the latest knot, s."""
        t = self.stream.knots["low_t_us"]
        return float(np.ptp(t)) * 1e-6 if len(t) else 0.0

    @property
    def boot(self) -> bool:
        """Return whether its stamps move, and count from a boot."""
        boot = self.stream.field.clock in (Clock.BOOT, Clock.AMBIGUOUS)
        return boot and self.stream.moves > 0 and not self.stream.since_unix

    @property
    def runs(self) -> bool:
        """Return whether it shows a running clock that counts from a boot."""
        return self.boot and self.rate is not None

    @property
    def unix(self) -> bool:
        """Return whether its stamps count from 1970."""
        return self.stream.since_unix * 2 > self.stream.stamped > 0

    @functools.cached_property
    def steps(self) -> list[Step]:
        """Places where receive time or stamp went on while the other hardly did."""
        if self.rate is None:
            return []
        knots = self.stream.knots
        number = _woven(knots["number"], knots["last_number"])
        t = _seconds(_woven(knots["t_us"], knots["last_t_us"]), 1e-6)
        stamp = _seconds(_woven(knots["stamp"], knots["last_stamp"]), self.unit_s)
        went, stamped = np.diff(t), np.diff(stamp) / self.rate
        far = np.maximum(np.abs(went), np.abs(stamped))
        parted = np.abs(went - stamped) > np.maximum(STEP_S, _STEP_SHARE * far)
        return [
            Step(int(number[k]), self._seen_at(k + 1), float(went[k]), float(stamped[k]))
            for k in np.flatnonzero(parted).tolist()
        ]

    def _seen_at(self, place: int) -> Place:
        """Return the first frame of the stretch that the `place`-th point lies in."""
        knot = self.stream.knots[place // 2]
        return Place(*(int(knot[name]) for name in ("number", "t_us", "offset", "size")))

    def lag(self, which: str, rate: float) -> Floats:
        """Return (k,) receive time minus stamp of each knot's ``first``, ``last`` or ``low`` row, s."""
        prefix = "" if which == "first" else f"{which}_"
        knots = self.stream.knots
        t = knots[f"{prefix}t_us"] * 1e-6
        return np.asarray(t - knots[f"{prefix}stamp"] * (self.unit_s / rate))

    @property
    def offset_s(self) -> float:
        """Receive time minus stamp at the start, the least of the first knots, s."""
        knots = self.stream.knots[:_ROUND]
        return float(np.min(knots["low_t_us"] * 1e-6 - knots["low_stamp"] * self.unit_s))

    def latency(self, pool: Pool | None) -> tuple[float, float] | None:
        """Return median and 99th percentile of latency, s: beside `pool`, else its own least lag.

        Rows are the first of each knot, so that every part of the recording counts alike.
        """
        if self.rate is None:
            return None
        clock = _pool([self]) if pool is None else pool
        if clock is None:
            return None
        quiet = ~np.isin(self.stream.knots["stretch"], self._unsteady())
        late = self.lag("first", clock.rate) - clock.least()[self.stream.knots["stretch"]]
        late = late[quiet & np.isfinite(late)]
        if not len(late):
            return None
        return float(np.median(late)), float(np.quantile(late, 0.99))

    def _unsteady(self) -> Ints:
        """Return stretches in which the clock steps, and those around them."""
        steps = np.array([step.seen.number >> self.stream.level for step in self.steps], np.int64)
        return (steps[:, None] + np.arange(-_AROUND, _AROUND + 1)).reshape(-1)

    def seconds(self, stamp: int) -> float:
        """Return a stamp in seconds."""
        return stamp * self.unit_s


@dataclass(slots=True)
class Pool:
    """The clock that several streams share."""

    rate: float
    low: Floats
    """(MAX_KNOTS,) least lag in each stretch, s; inf where nothing was heard."""
    streams: int
    around: int
    """Stretches on either side that are looked at for the least lag."""

    def at(self, stretch: Ints) -> Floats:
        """Return the lag of the clock in some stretches, NaN far from where it was heard."""
        heard = np.flatnonzero(np.isfinite(self.low))
        if not len(heard):
            return np.full(len(stretch), np.nan)
        return np.interp(stretch, heard, self.low[heard], np.nan, np.nan)

    def least(self) -> Floats:
        """Return (MAX_KNOTS,) the least lag around each stretch, s: the offset of the clock there."""
        far = np.full(self.around, np.inf)
        padded = np.concatenate((far, self.low, far))
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * self.around + 1)
        return np.asarray(windows.min(axis=1))

    @property
    def offset_s(self) -> float:
        """Receive time minus stamp where the clock was first heard, s."""
        return float(self.low[np.isfinite(self.low)][0])


Groups: TypeAlias = list[tuple[list[tuple[Timing, StepBack]], bool]]


class Clocks:
    """The clocks of a recording."""

    def __init__(self, book: ClockBook, role: Callable[[int], str]) -> None:
        """Judge what `book` holds; `role` tells who a sender is."""
        self.timings = [Timing(stream) for stream in book.settled() if stream.stamped]
        self.unset = [stream for stream in book.settled() if not stream.stamped]
        self.role = role
        self.of: dict[int, list[Timing]] = {}
        for timing in self.timings:
            self.of.setdefault(timing.sender, []).append(timing)
        self._pools: dict[tuple[int, int | None], Pool | None] = {}
        self._grouped: dict[int, Groups] = {}

    @property
    def received(self) -> bool:
        """Return whether the recording has receive times that can be believed."""
        return any(len(timing.stream.knots) for timing in self.timings)

    def autopilot_of(self, timing: Timing) -> int | None:
        """Return the autopilot that a stream is addressed to, or shares its system with, or the only one."""
        pilots = [sender for sender in self.of if self.role(sender) == "autopilot"]
        system = timing.stream.key.target or timing.sender >> 8
        own = [sender for sender in pilots if sender >> 8 == system]
        return own[0] if own else pilots[0] if len(pilots) == 1 else None

    def pool(self, sender: int | None, without: Timing | None = None) -> Pool | None:
        """Return the boot clock of a sender from all its streams, or all but one."""
        if sender is None:
            return None
        if len(self.of.get(sender, ())) > _MANY:
            without = None
        key = (sender, None if without is None else id(without))
        if key not in self._pools:
            self._pools[key] = _pool(self._running(sender, without))
        return self._pools[key]

    def shared(self, timing: Timing) -> Pool | None:
        """Return the clock of the sender if the stream goes by it."""
        if timing not in self._running(timing.sender, None):
            return None
        return self.pool(timing.sender)

    def _running(self, sender: int, without: Timing | None) -> list[Timing]:
        """Return the streams of a sender that show one running boot clock."""
        running = [each for each in self.of.get(sender, ()) if each.runs]
        if not running:
            return []
        usual = float(np.median([each.rate for each in running if each.rate is not None]))
        return [
            each
            for each in running
            if each is not without
            and each.rate is not None
            and usual / _ALIKE < each.rate < usual * _ALIKE
        ]

    def domain(self, timing: Timing) -> str:
        """Return what the stamps of a stream count: ``boot``, ``unix``, ``vehicle``, ``sender``...

        ``vehicle`` is the boot clock of the autopilot it is addressed to or sits beside; ``constant`` is
        no clock; ``mixed`` counts from both a boot and 1970.
        """
        stream = timing.stream
        if not stream.moves:
            return "constant"
        if 0 < stream.since_unix < stream.stamped:
            return "mixed"
        if stream.since_unix:
            return "unix"
        if self.role(timing.sender) == "autopilot" or timing.rate is None:
            return "boot"
        pool = self.pool(self.autopilot_of(timing))
        if pool is None:
            return "sender"
        apart = timing.lag("low", pool.rate) - pool.at(stream.knots["stretch"])
        known = np.abs(apart[np.isfinite(apart)])
        return "vehicle" if len(known) and np.median(known) <= SAME_CLOCK_S else "sender"

    def boot_utc(self, sender: int) -> float | None:
        """Return when a sender was started, s since 1970, by its last SYSTEM_TIME; None without one."""
        said = {
            each.stream.field.name: each
            for each in self.of.get(sender, ())
            if each.stream.key.message == "SYSTEM_TIME"
        }
        if set(said) < {"time_boot_ms", "time_unix_usec"}:
            return None
        boot, unix = said["time_boot_ms"], said["time_unix_usec"]
        _, at_boot, at_unix = np.intersect1d(
            boot.stream.knots["last_number"], unix.stream.knots["last_number"], return_indices=True
        )
        if not len(at_boot) or not unix.unix:
            return None
        since = boot.stream.knots["last_stamp"][at_boot[-1]] * boot.unit_s
        return float(unix.stream.knots["last_stamp"][at_unix[-1]] * unix.unit_s - since)

    @functools.cached_property
    def restarts(self) -> list[Restart]:
        """Return the components that begin again, in the order of the frames."""
        found = [restart for sender in self.of for restart, _ in self._restarts_of(sender)]
        return sorted(found, key=lambda restart: restart.seen.number)

    @functools.cached_property
    def excused(self) -> set[int]:
        """Return the backward steps (by `id`) that come with a restart, a wrap, or the whole component."""
        excused = {
            id(each)
            for timing in self.timings
            for each in timing.stream.backs
            if wraps(timing, each)
        }
        for sender in self.of:
            excused |= {id(each) for _, group in self._restarts_of(sender) for each in group}
            excused |= {id(each) for group in self._common(sender) for each in group}
        return excused

    @functools.cached_property
    def disordered(self) -> set[int]:
        """Return the senders of which most streams step back without a restart: frames lost their order."""
        found = set()
        for sender, timings in self.of.items():
            running = [t for t in timings if t.boot and t.stream.stamped >= _FEW_FRAMES]
            back = [t for t in running if any(id(b) not in self.excused for b in t.stream.backs)]
            if len(back) > _ALONE and len(back) * 2 > len(running):
                found.add(sender)
        return found

    def _restarts_of(self, sender: int) -> list[tuple[Restart, list[StepBack]]]:
        found = []
        for group, alone in self._groups(sender):
            if alone or not _lawful(group, self._rate_of(sender)):
                continue
            timing, first = min(group, key=lambda each: each[1].after.number)
            restart = Restart(
                sender,
                first.after,
                timing.seconds(first.stamp_before),
                timing.seconds(first.stamp_after),
                len({id(timing) for timing, _ in group}),
            )
            found.append((restart, [each for _, each in group]))
        return found

    def _common(self, sender: int) -> Iterable[list[StepBack]]:
        """Yield backward steps of a whole component that are no restart.

        An autopilot's frames were spliced or overtook each other on the way; another sender's clock was
        set back unless frames are missing there.
        """
        for group, alone in self._groups(sender):
            gaps = [each.sent_between for _, each in group]
            torn = self.role(sender) == "autopilot" or np.median(gaps) > _FEW_FRAMES
            if not alone and torn and len(group) > 1:
                yield [each for _, each in group]

    def _rate_of(self, sender: int) -> float:
        pool = self.pool(sender)
        return 1.0 if pool is None else pool.rate

    def _groups(self, sender: int) -> Groups:
        """Return backward steps of a component that may be one, and whether other streams deny it."""
        if sender not in self._grouped:
            self._grouped[sender] = self._group(sender)
        return self._grouped[sender]

    def _group(self, sender: int) -> Groups:
        backs = [
            (timing, each)
            for timing in self.of[sender]
            if not timing.stream.since_unix
            for each in timing.stream.backs
            if timing.seconds(each.stamp_before - each.stamp_after) >= STEP_S
        ]
        groups: list[list[tuple[Timing, StepBack]]] = []
        low = high = -1
        for timing, each in sorted(backs, key=lambda pair: pair[1].before.number):
            if groups and each.before.number < high and each.after.number > low:
                groups[-1].append((timing, each))
                low, high = max(low, each.before.number), min(high, each.after.number)
            else:
                groups.append([(timing, each)])
                low, high = each.before.number, each.after.number
        return [(group, self._denied(sender, group)) for group in groups]

    def _denied(self, sender: int, group: list[tuple[Timing, StepBack]]) -> bool:
        """Return whether most streams of a component go on where some step back."""
        low = max(each.before.number for _, each in group)
        high = min(each.after.number for _, each in group)
        stepped = {id(timing) for timing, _ in group}
        going_on = [
            timing
            for timing in self.of[sender]
            if timing.boot
            and id(timing) not in stepped
            and timing.stream.first is not None
            and timing.stream.last is not None
            and timing.stream.first.number <= low
            and timing.stream.last.number >= high
        ]
        return len(going_on) > len(stepped)


_NEAR_WRAP = 0.02
"""Within this share of its range from the end, then from the start, a counter may have started over."""
_MANY = 64
"""Among so many streams one more or less does not change their clock."""
_ALONE = 2
"""So many streams of a sender may step back by a mistake of their own."""
_FEW_FRAMES = 20
"""Frames of a sender that may be missing between two rows of which none was lost."""


def wraps(timing: Timing, each: StepBack) -> bool:
    """Return whether a backward step is a counter of 32 bits that starts over."""
    if each.stamp_before < (1 - _NEAR_WRAP) * 2**32 or each.stamp_before >= 2**32:
        return False
    if each.stamp_after > _NEAR_WRAP * 2**32:
        return False
    before, after = each.before.t_us, each.after.t_us
    if before is None or after is None:
        return True
    went = (each.stamp_after + 2**32 - each.stamp_before) * timing.unit_s
    expected = max(after - before, 0) * 1e-6 * (timing.rate or 1.0)
    return expected / 2 - STEP_S <= went <= 2 * expected + STEP_S


def _lawful(group: list[tuple[Timing, StepBack]], rate: float) -> bool:
    """Return whether most of the streams can have restarted: nobody is up for longer than ago that was."""
    agree = [
        timing.seconds(each.stamp_after) <= _longest_s(each) * max(rate, 1.0)
        for timing, each in group
    ]
    return sum(agree) * 2 > len(agree)


def _longest_s(each: StepBack) -> float:
    if each.before.t_us is None or each.after.t_us is None:
        return _YOUNG_S
    return max(each.after.t_us - each.before.t_us, 0) * 1e-6 + SLACK_S


def _pool(timings: list[Timing]) -> Pool | None:
    """Return what several streams of one clock have in common."""
    if not timings:
        return None
    rate = float(np.median([each.rate for each in timings if each.rate is not None]))
    low = np.full(MAX_KNOTS, np.inf)
    for each in timings:
        np.minimum.at(low, each.stream.knots["stretch"], each.lag("low", rate))
    around = max(_AROUND, _AROUND_FRAMES >> timings[0].stream.level)
    return Pool(rate, low, len(timings), around)


def _seconds(values: Ints, unit_s: float) -> Floats:
    """Return values in seconds since the first one, exact however large they are."""
    return np.asarray((values - values[:1]) * unit_s)


def _woven(first: Ints, second: Ints) -> Ints:
    """Return the elements of two columns by turns."""
    return np.stack((first, second), axis=1).reshape(-1)
