"""The clock model against clocks that were made up, so that the truth is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.vehicle.clocks import MAX_KNOTS, ClockBook
from mavframecheck.vehicle.roles import role_from_ids
from mavframecheck.vehicle.timing import Clocks, Timing
from mavframecheck.wire import read_batches
from tests.strategies import DIALECT, chunks, cut
from tests.vehicle.clock_bench import (
    COMPANION,
    START_US,
    boot,
    heartbeats,
    recording,
    restarting,
    stream,
    unix,
    vehicle,
    vision,
)


def book_of(data: bytes, cuts: list[int] | None = None) -> ClockBook:
    book = ClockBook()
    for batch in read_batches(chunks(cut(data, cuts or [])), DIALECT, stamped=True):
        book.update(batch)
    return book


def clocks_of(data: bytes) -> Clocks:
    return Clocks(book_of(data), lambda sender: role_from_ids(sender >> 8, sender & 0xFF))


def one(clocks: Clocks, message: str) -> Timing:
    return next(t for t in clocks.timings if t.stream.key.message == message)


@pytest.mark.parametrize("rate", [0.5, 0.985, 1.0, 1.00005, 5.0, 10.0])
def test_rate_is_that_of_the_clock(rate: float) -> None:
    clocks = clocks_of(recording(vehicle(lambda t: 45 + rate * t, until=120)))
    for timing in clocks.timings:
        assert timing.rate == pytest.approx(rate, rel=2e-4)


def test_offset_is_when_the_vehicle_was_started() -> None:
    clocks = clocks_of(recording(vehicle(boot)))
    for timing in clocks.timings:
        assert timing.offset_s == pytest.approx(START_US * 1e-6 - 45.0 + 0.01, abs=0.01)


def test_latency_is_what_was_added_on_the_way() -> None:
    waits = np.random.default_rng(5).choice([0.0, 0.0, 0.0, 0.2], 100_000)
    late = stream(
        (1, 1),
        "GPS_RAW_INT",
        "time_usec",
        boot,
        late=lambda t: 0.1 + float(waits[round(t)]),
        hz=1.0,
        jitter=0.0,
    )
    ahead = stream((1, 1), "ATTITUDE", "time_boot_ms", boot, hz=20.0, jitter=0.0)
    clocks = clocks_of(recording(late, ahead))
    timing = one(clocks, "GPS_RAW_INT")
    latency = timing.latency(clocks.shared(timing))
    assert latency is not None
    assert latency[0] == pytest.approx(0.1 - 0.01, abs=0.02)
    assert latency[1] == pytest.approx(0.3 - 0.01, abs=0.02)


def test_whose_clock_it_is() -> None:
    story = (
        vision(boot),
        stream(COMPANION, "ODOMETRY", "time_usec", unix),
        stream(COMPANION, "ATT_POS_MOCAP", "time_usec", lambda t: 5739 + t),
        stream(COMPANION, "VISION_SPEED_ESTIMATE", "usec", lambda _: 1e-5),
    )
    clocks = clocks_of(recording(heartbeats(), vehicle(boot), *story))
    assert clocks.domain(one(clocks, "ATTITUDE")) == "boot"
    assert clocks.domain(one(clocks, "VISION_POSITION_ESTIMATE")) == "vehicle"
    assert clocks.domain(one(clocks, "ODOMETRY")) == "unix"
    assert clocks.domain(one(clocks, "ATT_POS_MOCAP")) == "sender"
    assert clocks.domain(one(clocks, "VISION_SPEED_ESTIMATE")) == "constant"


def test_a_step_is_as_large_as_it_was() -> None:
    clocks = clocks_of(
        recording(heartbeats(), vehicle(boot), vision(lambda t: boot(t) + 7 * (t > 30)))
    )
    (step,) = one(clocks, "VISION_POSITION_ESTIMATE").steps
    assert step.offset_s == pytest.approx(-7, abs=0.1)
    assert step.seen.t_us is not None
    assert step.seen.t_us * 1e-6 == pytest.approx(START_US * 1e-6 + 30, abs=0.3)


def test_restart() -> None:
    (restart,) = clocks_of(recording(restarting(20.0, 8.0))).restarts
    assert restart.uptime_s == pytest.approx(65, abs=0.2)
    assert restart.since_s == pytest.approx(0.2, abs=0.2)
    assert restart.streams == 4


def test_system_time_tells_when_the_vehicle_was_started() -> None:
    both = [
        m.__class__(m.sent, m.t, m.sender, m.name, {**m.fields, "time_boot_ms": 1e3 * boot(m.sent)})
        for m in stream((1, 1), "SYSTEM_TIME", "time_unix_usec", unix, hz=1.0)
    ]
    whole = [
        m.__class__(m.sent, m.t, m.sender, m.name, {k: int(v) for k, v in m.fields.items()})
        for m in both
    ]
    started = clocks_of(recording(whole)).boot_utc(257)
    assert started == pytest.approx(START_US * 1e-6 - 45.0, abs=0.01)


def test_memory_does_not_grow() -> None:
    data = recording(vehicle(boot, until=600))
    book = book_of(data)
    assert book.level > 0
    assert all(len(each.knots) <= MAX_KNOTS for each in book.streams.values())
    assert all(each.knots["rows"].sum() == each.rows for each in book.streams.values())


CUT_UP = recording(
    heartbeats(), restarting(20.0, 8.0), vision(lambda t: boot(t) - 20 * (t > 30)), vision(unix)
)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, len(CUT_UP)), min_size=1, max_size=20))
def test_knots_do_not_depend_on_batches(cuts: list[int]) -> None:
    whole, pieces = book_of(CUT_UP).settled(), book_of(CUT_UP, cuts).settled()
    for a, b in zip(whole, pieces, strict=True):
        assert a.key == b.key
        assert (a.knots == b.knots).all()
        assert (a.rows, a.unset, a.repeated, a.back, a.late) == (
            *(b.rows, b.unset, b.repeated, b.back, b.late),
        )
        assert (a.backs, a.epochs, a.stills, a.standing()) == (
            *(b.backs, b.epochs, b.stills, b.standing()),
        )


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(1, 5), min_size=2, max_size=60))
def test_counts_are_those_of_a_loop(stamps: list[int]) -> None:
    story = [
        type(m)(m.sent, m.t, m.sender, m.name, {**m.fields, "usec": stamp})
        for m, stamp in zip(vision(boot, until=len(stamps) / 20 + 1), stamps)
    ]
    (only,) = book_of(recording(story)).settled()
    assert only.repeated == sum(a == b for a, b in pairwise(stamps))
    assert only.back == sum(b < a for a, b in pairwise(stamps))
