"""Values over time: what was known when a row was sent, or soon after, however the stream is cut."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.vehicle.history import LATE_FRAMES, LATE_US, Asked, History
from mavframecheck.wire import Frames
from tests.strategies import START_US, attitude, read, record

SECOND = 1_000_000
TEMPLATE = read([record(attitude(0))], stamped=True).frames


class Row(NamedTuple):
    """A row that says a value, or asks for one."""

    number: int
    key: int
    t_us: int = START_US
    value: float = math.nan
    valid: bool = True


def frames(rows: list[Row]) -> Frames:
    """Return frames with these numbers and times."""
    made = TEMPLATE.take(np.zeros(len(rows), np.int64))
    made.number = np.array([r.number for r in rows], np.int64)
    made.t_us = np.array([r.t_us for r in rows], np.int64)
    made.t_valid = np.array([r.valid for r in rows], np.bool_)
    made.clock_us = np.maximum.accumulate(np.where(made.t_valid, made.t_us, 0))
    return made


def say(history: History, rows: list[Row]) -> None:
    """Add rows to a history."""
    keys = np.array([r.key for r in rows], np.int64)
    history.extend(keys, frames(rows), {"x": np.array([r.value for r in rows], np.float64)})


def asked(rows: list[Row]) -> Asked:
    """Return rows that ask."""
    by = frames(rows)
    keys = np.array([r.key for r in rows], np.int64)
    return Asked(keys, by.number, by.number, by.t_us, by.t_valid, by.clock_us)


def before(history: History, row: Row, max_age_us: int | None = None) -> float:
    """Return the value before one row, NaN for none."""
    return float(history.values("x", history.before(asked([row]), max_age_us))[0])


def after(history: History, row: Row, max_delay_us: int = LATE_US) -> float:
    """Return the value after one row, NaN for none."""
    return float(history.values("x", history.after(asked([row]), max_delay_us))[0])


def told(*rows: Row) -> History:
    """Return a history of some rows."""
    history = History(("x",))
    say(history, list(rows))
    return history


def test_nothing_said() -> None:
    empty = History(("x",))
    assert math.isnan(before(empty, Row(5, 1)))
    assert math.isnan(after(empty, Row(5, 1)))
    assert empty.last("x", 1) is None


def test_the_last_value_before_a_row() -> None:
    """In frame order; a value said by the row itself is not before it."""
    history = told(Row(2, 1, value=20), Row(5, 1, value=50), Row(9, 1, value=90))
    assert [before(history, Row(n, 1)) for n in (3, 5, 6, 100)] == [20, 20, 50, 90]
    assert math.isnan(before(history, Row(2, 1)))


def test_frame_order_not_receive_time() -> None:
    """A clock that goes back does not reorder what was said (DESIGN law 2)."""
    history = told(Row(1, 1, START_US + 50 * SECOND, 10), Row(2, 1, START_US, 20))
    assert before(history, Row(3, 1, START_US + 60 * SECOND)) == 20


def test_keys_never_mix() -> None:
    history = told(Row(1, 1, value=10), Row(2, 2, value=20))
    assert before(history, Row(9, 1)) == 10
    assert before(history, Row(9, 2)) == 20
    assert math.isnan(before(history, Row(9, 3)))
    assert math.isnan(before(history, Row(9, -1)))
    assert math.isnan(after(history, Row(0, -1)))


def test_a_value_that_is_too_old() -> None:
    history = told(Row(1, 1, START_US, 10))
    row = Row(2, 1, START_US + 30 * SECOND)
    assert before(history, row, 30 * SECOND) == 10
    assert math.isnan(before(history, row, 30 * SECOND - 1))
    assert before(history, row._replace(valid=False), 1) == 10


def test_the_first_value_soon_after_a_row() -> None:
    history = told(Row(5, 1, value=50), Row(9, 1, value=90))
    assert after(history, Row(2, 1)) == 50
    assert after(history, Row(6, 1)) == 90
    assert math.isnan(after(history, Row(10, 1)))


@pytest.mark.parametrize(
    ("frames_later", "us_later", "found"),
    [
        (LATE_FRAMES, LATE_US, True),
        (LATE_FRAMES + 1, 0, False),
        (1, LATE_US + 1, False),
    ],
)
def test_bounds_of_lateness(frames_later: int, us_later: int, found: bool) -> None:
    history = told(Row(10 + frames_later, 1, START_US + us_later, 7))
    assert math.isnan(after(history, Row(10, 1))) != found


def test_settling_keeps_the_last_of_each_key() -> None:
    history = told(*(Row(n, n % 3, value=n) for n in range(1, 30)))
    history.settle()
    assert [history.last("x", key) for key in range(4)] == [27, 28, 29, None]
    assert len(history._order) == 3
    history.settle()
    assert before(history, Row(99, 1)) == 28


def test_memory_is_that_of_the_keys() -> None:
    """However long the recording is."""
    history = History(("x",))
    for batch in range(50):
        say(history, [Row(batch * 100 + n, n % 5, value=n) for n in range(100)])
        history.settle()
    assert len(history._order) == 5


def test_quantities_that_a_message_does_not_give() -> None:
    history = History(("x", "y"))
    say(history, [Row(1, 1, value=5)])
    answer = history.before(asked([Row(2, 1)]))
    assert math.isnan(float(history.values("y", answer)[0]))


@settings(max_examples=150)
@given(
    rows=st.lists(st.tuples(st.integers(0, 2), st.booleans()), min_size=1, max_size=30),
    cuts=st.lists(st.integers(0, 30), max_size=5),
)
def test_the_value_before_against_a_plain_loop(
    rows: list[tuple[int, bool]], cuts: list[int]
) -> None:
    """Rows say and ask in any order, in batches of any size."""
    latest: dict[int, float] = {}
    expected = []
    for number, (key, says) in enumerate(rows):
        expected.append(latest.get(key, math.nan))
        if says:
            latest[key] = float(number)
    history, found = History(("x",)), []
    edges = sorted({0, len(rows), *(c % (len(rows) + 1) for c in cuts)})
    for a, b in itertools.pairwise(edges):
        part = list(enumerate(rows))[a:b]
        saying = [Row(n, key, value=n) for n, (key, says) in part if says]
        if saying:
            say(history, saying)
        answer = history.before(asked([Row(n, key) for n, (key, _) in part]))
        found += history.values("x", answer).tolist()
        history.settle()
    assert np.array_equal(found, expected, equal_nan=True)
