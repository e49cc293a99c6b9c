"""Which receive stamps are believed: recordings carry some that are 10^13 s off."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mavframecheck.wire.stamps import LATEST_US, TEAR_US, Stamps
from tests.strategies import START_US, attitude, cut, read, record

SECOND = 1_000_000
YEAR = 365 * 86_400 * SECOND


def believed(t_us: list[int], has_stamp: list[bool] | None = None) -> list[bool]:
    """Judge stamps all at once."""
    has = np.ones(len(t_us), np.bool_) if has_stamp is None else np.array(has_stamp)
    result: list[bool] = Stamps().valid(np.array(t_us, np.int64), has).tolist()
    return result


def steady(count: int, start: int = START_US) -> list[int]:
    """Return stamps 0.1 s apart."""
    return [start + k * SECOND // 10 for k in range(count)]


def test_a_steady_recording_is_believed() -> None:
    assert all(believed(steady(100)))


def test_nothing_before_1970_or_after_2100() -> None:
    stamps = [*steady(3), 0, -5, LATEST_US, 2**63 - 1, *steady(3, START_US + SECOND)]
    assert believed(stamps) == [True] * 3 + [False] * 4 + [True] * 3


def test_a_stamp_ten_trillion_seconds_off() -> None:
    """As a recording from the field has it: only that stamp is lost."""
    stamps = steady(10)
    stamps[4] += 10**13 * SECOND % 2**62
    assert believed(stamps) == [True] * 4 + [False] + [True] * 5


def test_a_plausible_stamp_torn_from_its_neighbours() -> None:
    for off in (-2 * YEAR, 2 * YEAR, -TEAR_US - SECOND, TEAR_US + 10 * SECOND):
        stamps = steady(10)
        stamps[4] += off
        assert believed(stamps) == [True] * 4 + [False] + [True] * 5


def test_small_steps_backwards_are_believed() -> None:
    """Two links merged by receive time are out of order by milliseconds, a clock set right by seconds."""
    stamps = steady(50)
    for k in range(0, 48, 5):
        stamps[k], stamps[k + 1] = stamps[k + 1], stamps[k]
    stamps[30:] = [t - 20 * SECOND for t in stamps[30:]]
    assert all(believed(stamps))


def test_a_run_that_moves_by_years() -> None:
    """Two recordings joined: the second is believed from its third stamp on."""
    stamps = steady(10) + steady(10, START_US + 3 * YEAR)
    assert believed(stamps) == [True] * 10 + [False] * 2 + [True] * 8


def test_back_to_the_believed_run_at_once() -> None:
    """Two stamps elsewhere are no run of their own; the old one goes on without delay."""
    away = steady(2, START_US - YEAR)
    stamps = steady(5) + away + steady(5, START_US + SECOND)
    assert believed(stamps) == [True] * 5 + [False] * 2 + [True] * 5


def test_frames_without_a_stamp() -> None:
    assert believed(steady(4), [True, False, True, False]) == [True, False, True, False]


STEPS = st.sampled_from(
    [0, 1, 100_000, -50_000, TEAR_US, TEAR_US + 1, -TEAR_US - 1, YEAR, -YEAR, 10**18, -(10**18)]
)


@settings(max_examples=300)
@example([(0, True), (TEAR_US + 1, True), (-50_000, True), (1, True)], [2])
@given(
    steps=st.lists(st.tuples(STEPS, st.booleans()), max_size=30),
    cuts=st.lists(st.integers(0, 30), max_size=6),
)
def test_cuts_change_nothing(steps: list[tuple[int, bool]], cuts: list[int]) -> None:
    """What is believed does not depend on where the recording is cut into batches."""
    walk = itertools.accumulate((step for step, _ in steps), initial=START_US)
    t_us = np.clip(np.array(list(walk)[1:], np.float64), 0, 2**62).astype(np.int64)
    has = np.array([has for _, has in steps], np.bool_)
    judge = Stamps()
    edges = sorted({0, len(t_us), *(c % (len(t_us) + 1) for c in cuts)})
    in_pieces = [judge.valid(t_us[a:b], has[a:b]).tolist() for a, b in itertools.pairwise(edges)]
    assert list(itertools.chain(*in_pieces)) == Stamps().valid(t_us, has).tolist()


def test_stamps_stay_as_they_were_recorded() -> None:
    """Not believed is not altered: a report can still show what the file says."""
    wrong = START_US - YEAR
    stream = b"".join(
        (record(attitude(0)), wrong.to_bytes(8, "big") + attitude(1), record(attitude(2), 2))
    )
    frames = read(cut(stream, [40]), stamped=True).frames
    assert frames.t_us.tolist() == [START_US, wrong, START_US + 200_000]
    assert frames.t_valid.tolist() == [True, False, True]
