"""Checks of what clocks count: unit, epoch, whose they are, and how far a stream falls behind its own."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Observation
from mavframecheck.checks.clocks import ClockCheck, alike, at, ends, subject, words
from mavframecheck.model import Scalar
from mavframecheck.semantics.enums import Clock
from mavframecheck.vehicle.timing import Pool, Timing

Floats = npt.NDArray[np.float64]

_THIN_SHARE = 0.2
"""A stream that repeats more of its stamps than this does not stamp its messages but their origin."""

_NAMED = {1e-3: "us", 1.0: "ms", 1e3: "s", 1e-6: "ns"}
"""Length of a unit in milliseconds -> its name."""


class Unit(NamedTuple):
    """A stamp in another unit than its field has."""

    factor: float
    """How much too fast it runs: a power of 1000."""
    holds: str
    wanted: str


class StampUnits(ClockCheck):
    """Stamps that run a power of 1000 too fast or too slow."""

    timed = True
    undecided = "no stream of stamps is long enough to tell its rate"

    def judged(self) -> Sequence[Timing]:
        """Return the streams that are long enough."""
        return [
            timing
            for timing in self.clocks.timings
            if not _has_own_rule(timing)
            and timing.rate is not None
            and timing.span_s >= self.params["min_span_s"]
        ]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream in another unit."""
        for timing in self.judged():
            unit = self.unit(timing)
            if unit is not None and timing.rate is not None:
                values: dict[str, Scalar] = {
                    "factor": unit.factor,
                    "rate": timing.rate,
                    "holds": unit.holds,
                    "wanted": unit.wanted,
                    "role": self.clocks.role(timing.sender),
                    "span_s": timing.span_s,
                }
                yield Observation(subject(timing), *ends(timing), timing.stream.stamped, values)

    def unit(self, timing: Timing) -> Unit | None:
        """Return the unit that the stamps are in, None where it is the right one or unclear."""
        for rate, factor in self._references(timing):
            ratio = (timing.rate or 0.0) / rate
            for wrong in (1e-6, 1e-3, 1e3, 1e6):
                if wrong / factor <= ratio <= wrong * factor:
                    length_ms = timing.unit_s * 1e3
                    held = min(_NAMED, key=lambda each: abs(np.log(each * wrong / length_ms)))
                    close = abs(np.log(held * wrong / length_ms)) < 0.1
                    wanted = _NAMED[min(_NAMED, key=lambda each: abs(np.log(each / length_ms)))]
                    return Unit(wrong, _NAMED[held] if close else "another unit", wanted)
            if 1 / factor <= ratio <= factor:
                return None
        return None

    def _references(self, timing: Timing) -> Iterator[tuple[float, float]]:
        """Yield rates to compare with, and how far from them (a factor) counts as equal."""
        own = self.clocks.pool(timing.sender, timing)
        if own is not None and own.streams >= self.params["min_streams"]:
            yield own.rate, self.params["own_factor"]
            return
        vehicle = self.clocks.autopilot_of(timing)
        pool = self.clocks.pool(vehicle) if vehicle != timing.sender else None
        if pool is not None:
            yield pool.rate, self.params["own_factor"]
        yield 1.0, self.params["receive_factor"]


def _has_own_rule(timing: Timing) -> bool:
    """Return whether another rule looks at the unit."""
    message, clock = timing.stream.key.message, timing.stream.field.clock
    return message == "TIMESYNC" or (message == "SYSTEM_TIME" and clock == Clock.UNIX)


class WallClocks(ClockCheck):
    """Fields for the time since boot that hold the time of day."""

    timed = True

    def judged(self) -> Sequence[Timing]:
        """Return the streams whose field counts from a boot."""
        return [t for t in self.clocks.timings if t.stream.field.clock == Clock.BOOT]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that holds the time of day in enough rows."""
        for timing in self.judged():
            knots = timing.stream.knots
            hit = np.flatnonzero(self._hits(timing))
            rows = int(knots["rows"][hit].sum())
            if rows >= self.params["min_rows"] and np.ptp(knots["stamp"][hit]):
                first, last = knots[hit[0]], knots[hit[-1]]
                values: dict[str, Scalar] = {
                    "stamp": int(first["stamp"]),
                    "stamp_s": timing.seconds(int(first["stamp"])),
                    "cut": " is that, cut to 32 bits" if timing.stream.field.bits == 32 else "",
                    "rows": rows,
                    "of": timing.stream.stamped,
                }
                yield Observation(subject(timing), at(first), at(last), rows, values)

    def _hits(self, timing: Timing) -> npt.NDArray[np.bool_]:
        """Return (k,) knots whose first and last stamp are the receive time, cut to the field's bits."""
        knots, unit_us = timing.stream.knots, timing.stream.field.unit_us
        apart_us = self.params["max_apart_s"] * 1e6
        hit = np.ones(len(knots), np.bool_)
        for t_us, stamp in (("t_us", "stamp"), ("last_t_us", "last_stamp")):
            apart = knots[t_us] - (knots[stamp] * unit_us).astype(np.int64)
            if timing.stream.field.bits == 32:
                wrap_us = int(2**32 * unit_us)
                apart = (apart + wrap_us // 2) % wrap_us - wrap_us // 2
            hit &= np.abs(apart) <= apart_us
        return hit


class Unsynchronised(ClockCheck):
    """Estimates for a PX4 stamped by a clock that it cannot know."""

    def judged(self) -> Sequence[Timing]:
        """Return the streams of estimates to a PX4."""
        listed = words(self.params["messages"])
        return [
            timing
            for timing in self.clocks.timings
            if timing.stream.key.message in listed
            and not self.autopilot(timing.sender)
            and timing.stream.moves
            and self._is_px4(timing)
        ]

    def _is_px4(self, timing: Timing) -> bool:
        pilot = self.clocks.autopilot_of(timing)
        return pilot is not None and self.context.last("vehicle.autopilot", pilot >> 8) == "px4"

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream by another clock whose sender answers no TIMESYNC."""
        for timing in self.judged():
            pilot = self.clocks.autopilot_of(timing)
            if pilot is None or self._answered():
                continue
            asked = self._asked(pilot, timing)
            clock = self._foreign(timing, pilot)
            if clock and asked >= self.params["min_requests"]:
                values: dict[str, Scalar] = {
                    "clock": clock,
                    "requests": asked,
                    "rows": timing.stream.stamped,
                }
                yield Observation(subject(timing), *ends(timing), timing.stream.stamped, values)

    def _answered(self) -> bool:
        """Return whether anybody but an autopilot answers TIMESYNC."""
        return any(
            timing.stream.key.message == "TIMESYNC"
            and timing.stream.field.name == "tc1"
            and not self.autopilot(timing.sender)
            for timing in self.clocks.timings
        )

    def _asked(self, pilot: int, timing: Timing) -> int:
        """Return how often the autopilot asked while the stream went on."""
        first, last = ends(timing)
        requests = [
            each.stream
            for each in self.clocks.of.get(pilot, ())
            if each.stream.key.message == "TIMESYNC" and each.stream.field.name == "ts1"
        ]
        return sum(
            each.stamped
            for each in requests
            if each.last is not None
            and each.first is not None
            and each.last.number > first.number
            and each.first.number < last.number
        )

    def _foreign(self, timing: Timing, pilot: int) -> str:
        """Return whose clock it is in words, empty where it is the vehicle's or cannot be told."""
        if timing.unix:
            return "the time of day (since 1970)"
        pool = self.clocks.pool(pilot)
        if pool is None or not timing.runs or not alike(timing, pool):
            return ""
        apart = timing.lag("low", pool.rate) - pool.at(timing.stream.knots["stretch"])
        far = np.nanmedian(np.abs(apart)) if np.isfinite(apart).any() else 0.0
        return "its own clock" if far > self.params["min_apart_s"] else ""


class GrowingLatency(ClockCheck):
    """Streams that fall behind the clock of their sender."""

    timed = True
    undecided = "no stream runs long enough beside other streams of one clock"

    def judged(self) -> Sequence[Timing]:
        """Return the streams that have a clock to be compared with."""
        return [timing for timing in self.clocks.timings if self._clock_of(timing) is not None]

    def _clock_of(self, timing: Timing) -> Pool | None:
        """Return the clock that other streams of the sender show, else the vehicle's if it is the same."""
        stream = timing.stream
        steady = timing.runs and not timing.steps and timing.span_s >= self.params["min_span_s"]
        if not steady or stream.repeated > _THIN_SHARE * stream.stamped:
            return None
        if any(restart.sender == timing.sender for restart in self.clocks.restarts):
            return None
        own = self.clocks.pool(timing.sender, timing)
        if own is not None or self.autopilot(timing.sender):
            return own if own is not None and alike(timing, own) else None
        vehicle = self.clocks.pool(self.clocks.autopilot_of(timing))
        return vehicle if vehicle is not None and alike(timing, vehicle) else None

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream whose latency grows."""
        for timing in self.judged():
            pool = self._clock_of(timing)
            if pool is None:
                continue
            growth = _growth(timing, pool, self.params["same_clock_s"])
            if (
                not self.autopilot(timing.sender)
                and self.clocks.pool(timing.sender, timing) is None
            ):
                growth = min(growth, _drift(timing))
            per_min_s = growth / timing.span_s * 60
            slow = per_min_s * 1e3 >= self.params["min_ms_per_min"]
            if slow and growth >= self.params["min_growth_s"]:
                values: dict[str, Scalar] = {
                    "growth_s": growth,
                    "ms_per_min": per_min_s * 1e3,
                    "span_s": timing.span_s,
                }
                yield Observation(subject(timing), *ends(timing), timing.stream.stamped, values)


def _growth(timing: Timing, pool: Pool, same_s: float) -> float:
    """Return how much later a stream comes at its end than at its start, s; 0 if it is not steadily so."""
    stretch = timing.stream.knots["stretch"]
    late = timing.lag("low", pool.rate) - pool.at(stretch)
    late = late[np.isfinite(late)]
    if len(late) < 16 or abs(float(np.median(late[:4]))) > same_s:
        return 0.0
    return _rise(late)


def _rise(late: Floats) -> float:
    """Return last quarter minus first quarter, 0 if the quarters between do not rise as well."""
    quarters = [float(np.median(part)) for part in np.array_split(late, 4)]
    rising = all(a < b for a, b in itertools.pairwise(quarters))
    return (quarters[-1] - quarters[0]) * 4 / 3 if rising else 0.0


def _drift(timing: Timing) -> float:
    """Return by how much a stream falls behind receive time, s."""
    late = timing.lag("low", 1.0)
    return _rise(late) if len(late) >= 16 else 0.0


class TimesyncMisuse(StampUnits):
    """TIMESYNC with another unit than nanoseconds."""

    undecided = ""

    def judged(self) -> Sequence[Timing]:
        """Return the exchanges that last long enough."""
        return [
            timing
            for timing in self.clocks.timings
            if timing.stream.key.message == "TIMESYNC"
            and timing.rate is not None
            and timing.span_s >= self.params["min_span_s"]
            and timing.stream.stamped >= self.params["min_rows"]
        ]

    def _references(self, timing: Timing) -> Iterator[tuple[float, float]]:
        """Compare with the sender's other stamps, the vehicle's, receive time."""
        yield from super()._references(timing)
        if self.clocks.pool(timing.sender, timing) is not None:
            yield 1.0, self.params["receive_factor"]


_GPS_EPOCH_S = 315_964_800

_WEEK_S = 604_800
_YEAR_2001_S = 978_307_200


class SystemTimes(ClockCheck):
    """SYSTEM_TIME that does not count from 1970 in UTC."""

    timed = True

    def judged(self) -> Sequence[Timing]:
        """Return the clocks of SYSTEM_TIME that can be compared."""
        return [
            timing
            for timing in self.clocks.timings
            if timing.stream.key.message == "SYSTEM_TIME"
            and timing.stream.field.clock == Clock.UNIX
            and timing.stream.stamped >= self.params["min_rows"]
            and len(timing.stream.knots)
        ]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per sender with another epoch, as it stands at the end."""
        for timing in self.judged():
            knots = timing.stream.knots[-self.params["min_rows"] :]
            stamp = knots["low_stamp"] * timing.unit_s
            receive = knots["low_t_us"] * 1e-6
            what = self._wrong(stamp, receive)
            if what:
                values: dict[str, Scalar] = {
                    "what": what,
                    "unix_s": float(stamp[-1]),
                    "receive_s": float(receive[-1]),
                    "ahead_s": float(stamp[-1] - receive[-1]),
                }
                times = int(knots["rows"].sum())
                yield Observation(subject(timing), at(knots[0]), ends(timing)[1], times, values)

    def _wrong(self, stamp: Floats, receive: Floats) -> str:
        """Return what stamps are instead of UTC since 1970, empty where they may be that."""
        near = self.params["max_apart_s"]

        def fits(candidate: Floats) -> bool:
            return bool(np.abs(candidate - receive).max() <= near)

        weeks = (receive - stamp) / _WEEK_S
        for said, candidate in (
            ("milliseconds since 1970", stamp * 1e3),
            ("seconds since 1970", stamp * 1e6),
            ("nanoseconds since 1970", stamp * 1e-3),
            ("GPS time, which counts from 1980", stamp + _GPS_EPOCH_S),
        ):
            if fits(candidate):
                return said
        if stamp.max() < _YEAR_2001_S:
            return "no time of day (before 2001)"
        whole = round(float(weeks.mean()))
        if abs(whole) in (1, 1024, 2048) and fits(stamp + whole * _WEEK_S):
            return f"{abs(whole)} GPS weeks {'behind' if whole > 0 else 'ahead'}"
        return ""
