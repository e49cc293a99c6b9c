"""Hits to findings: what belongs together, what lasts, what is worst, and how many there may be."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.engine.compiled import CompiledRule
from mavframecheck.engine.episodes import (
    GAP_US,
    MAX_EPISODES,
    MAX_STREAMS,
    Episodes,
    Judged,
    Words,
    fingerprint,
)
from mavframecheck.model import Finding, Severity, Subject
from mavframecheck.wire import Frames
from tests.engine.judged import compiled
from tests.strategies import START_US, attitude, cut, read, record

SECOND = 1_000_000


def frames(t_us: list[int]) -> Frames:
    """Return frames received at these times."""
    records = (t.to_bytes(8, "big") + attitude(k) for k, t in enumerate(t_us))
    found = read([b"".join(records)], stamped=True).frames
    found.t_valid[:] = True
    return found


def judged(
    part: Frames,
    hit: list[bool],
    stream: list[int] | None = None,
    badness: list[float] | None = None,
) -> Judged:
    """Return rows as the runner hands them over; the words name the frame."""
    streams = np.array(stream or [1] * len(hit), np.int64)
    return Judged(
        streams,
        part,
        np.array(hit, np.bool_),
        np.array(badness or [0.0] * len(hit)),
        lambda place: Subject(int(streams[place]), 1, "ATTITUDE"),
        lambda place: Words(Severity.ERROR, f"frame {part.number[place]}", "", {}),
    )


def findings(
    hit: list[bool],
    t_us: list[int] | None = None,
    *,
    cuts: list[int] | None = None,
    stream: list[int] | None = None,
    badness: list[float] | None = None,
    persist: dict[str, float] | None = None,
) -> list[Finding]:
    """Collect hits, in one batch or cut, and return the findings."""
    times = t_us or [START_US + k * SECOND // 10 for k in range(len(hit))]
    rule: CompiledRule = compiled(detect={"persist": persist}) if persist else compiled()
    episodes, all_frames = Episodes("a.tlog"), frames(times)
    edges = sorted({0, len(hit), *(c % (len(hit) + 1) for c in cuts or [])})
    for a, b in itertools.pairwise(edges):
        rows = np.arange(a, b)
        part = judged(
            all_frames.take(rows),
            hit[a:b],
            stream[a:b] if stream else None,
            badness[a:b] if badness else None,
        )
        episodes.collect(rule, "ATTITUDE", None, part)
    return episodes.findings()


def counts(found: list[Finding]) -> list[int]:
    """Return the hits of each finding."""
    return [each.count for each in found]


def test_no_hit_no_finding() -> None:
    assert findings([False] * 10) == []


def test_consecutive_hits_are_one_finding() -> None:
    (found,) = findings([False, True, True, True, False])
    assert (found.count, found.severity, found.subject) == (3, Severity.ERROR, "1/1 ATTITUDE")
    assert found.time_first == pytest.approx(START_US * 1e-6 + 0.1)
    assert found.time_last == pytest.approx(START_US * 1e-6 + 0.3)
    assert found.utc_first == "2026-03-02T10:00:00.100Z"
    assert found.location is not None
    size = len(record(attitude(0)))
    assert (found.location.offset, found.location.length) == (  # type: ignore[union-attr]
        len(attitude(0)) + 8 + 8,
        len(attitude(1)),
    )
    assert size == len(attitude(0)) + 8


def test_right_rows_in_between_for_a_short_time_do_not_part() -> None:
    """A fault that flickers is one fault."""
    assert counts(findings([True, False, True, False, True])) == [3]


def test_right_rows_for_a_long_time_part() -> None:
    times = [START_US, START_US + SECOND, START_US + SECOND + GAP_US + 1]
    assert counts(findings([True, False, True], times)) == [1, 1]
    assert counts(findings([True, False, True], [*times[:2], times[0] + GAP_US])) == [2]


def test_silence_for_a_long_time_does_not_part() -> None:
    """No row in between says that it was right."""
    assert counts(findings([True, True], [START_US, START_US + 100 * GAP_US])) == [2]


def test_streams_are_kept_apart() -> None:
    found = findings([True] * 6, stream=[1, 2, 1, 2, 1, 3])
    assert sorted((f.sysid, f.count) for f in found) == [(1, 3), (2, 2), (3, 1)]


def test_the_worst_hit_gives_the_words() -> None:
    (found,) = findings([True] * 4, badness=[1.0, 3.0, 9.0, 9.0])
    assert found.text == "frame 2"


@pytest.mark.parametrize(
    ("persist", "hit", "expected"),
    [
        ({"count": 3}, [True, True], []),
        ({"count": 3}, [True, True, True], [3]),
        ({"seconds": 0.3}, [True, True, True], []),
        ({"seconds": 0.2}, [True, True, True], [3]),
        ({"share": 0.6}, [True, False, True, False, True], [3]),
        ({"share": 0.7}, [True, False, True, False, True], []),
        ({"count": 2, "share": 0.5}, [True, False, False, False, True], []),
    ],
)
def test_how_much_makes_a_finding(
    persist: dict[str, float], hit: list[bool], expected: list[int]
) -> None:
    """Hits, receive time between the first and the last, hits per judged row between them: all given hold."""
    assert counts(findings(hit, persist=persist)) == expected


def test_no_more_than_fifty_episodes() -> None:
    """What comes after counts into the last one: nothing is lost from the count."""
    pairs = 3 * MAX_EPISODES
    times = [START_US + k * 2 * GAP_US for k in range(2 * pairs)]
    found = findings([True, False] * pairs, times)
    assert len(found) == MAX_EPISODES
    assert counts(found) == [1] * (MAX_EPISODES - 1) + [pairs - MAX_EPISODES + 1]


def test_a_mask_that_flickers_on_every_message() -> None:
    """Hits and right rows alternate within seconds: one finding."""
    assert counts(findings([True, False] * 5000)) == [5000]


def test_no_more_streams_than_the_bound() -> None:
    found = findings([True] * (MAX_STREAMS + 50), stream=list(range(MAX_STREAMS + 50)))
    assert len(found) == MAX_STREAMS


def naive(
    hit: list[bool], t_us: list[int], persist: dict[str, float]
) -> list[tuple[int, int, int]]:
    """Return first row, last row and count of each episode, by one plain loop."""
    open_: list[int] = []
    done: list[list[int]] = []
    for row, is_hit in enumerate(hit):
        if not is_hit:
            continue
        apart = open_ and row - open_[-1] > 1 and abs(t_us[row] - t_us[open_[-1]]) > GAP_US
        if apart:
            done.append(open_)
            open_ = []
        open_.append(row)
    if open_:
        done.append(open_)
    kept = []
    for rows in done:
        seconds = (t_us[rows[-1]] - t_us[rows[0]]) / 1e6
        judged_rows = rows[-1] - rows[0] + 1
        if (
            len(rows) >= persist.get("count", 1)
            and seconds >= persist.get("seconds", 0)
            and len(rows) >= persist.get("share", 0) * judged_rows
        ):
            kept.append((rows[0], rows[-1], len(rows)))
    return kept


@settings(max_examples=150)
@given(
    rows=st.lists(
        st.tuples(st.booleans(), st.sampled_from([0, 1, SECOND, 6 * SECOND, 11 * SECOND])),
        max_size=40,
    ),
    cuts=st.lists(st.integers(0, 40), max_size=5),
    persist=st.sampled_from([{}, {"count": 2}, {"seconds": 5.0}, {"share": 0.5}]),
)
def test_against_a_plain_loop(
    rows: list[tuple[bool, int]], cuts: list[int], persist: dict[str, float]
) -> None:
    """The same episodes for any hits, any times and any cut into batches."""
    hit = [is_hit for is_hit, _ in rows]
    t_us = list(itertools.accumulate((step for _, step in rows), initial=START_US))[1:]
    found = findings(hit, t_us, cuts=cuts, persist=persist) if hit else []
    expected = naive(hit, t_us, persist)
    marks = [(t_us[first] * 1e-6, t_us[last] * 1e-6, count) for first, last, count in expected]
    assert [(f.time_first, f.time_last, f.count) for f in found] == marks


@given(
    badness=st.lists(st.floats(0, 10), min_size=1, max_size=20),
    cuts=st.lists(st.integers(0, 20), max_size=4),
)
def test_the_first_of_the_worst_for_any_cut(badness: list[float], cuts: list[int]) -> None:
    (found,) = findings([True] * len(badness), badness=badness, cuts=cuts)
    assert found.text == f"frame {badness.index(max(badness))}"


def test_fingerprints() -> None:
    """The same mistake of the same stream has the same one in any recording; another has not."""
    one = Subject(1, 191, "ODOMETRY", "q")
    assert fingerprint("MFC408", one) == fingerprint("MFC408", Subject(1, 191, "ODOMETRY", "q"))
    others: list[Any] = [Subject(2, 191, "ODOMETRY", "q"), Subject(1, 191, "ODOMETRY")]
    assert len({fingerprint("MFC408", s) for s in (one, *others)}) == 3
    assert fingerprint("MFC501", one) != fingerprint("MFC408", one)


def test_made_up_frames_are_cut_like_files() -> None:
    """The helper above rests on frames that keep their running number."""
    assert frames([START_US, START_US + 1]).number.tolist() == [0, 1]
    assert b"".join(cut(b"abc", [1])) == b"abc"
