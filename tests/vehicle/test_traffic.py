"""Who sends what, and the bound on how many are judged (DESIGN law 2)."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.vehicle.traffic import MAX_SENDERS, MAX_STREAMS, Traffic
from mavframecheck.wire import Frames
from tests.strategies import DIALECT, START_US, attitude, broken, read, record

TEMPLATE = read([record(attitude(0))], stamped=True).frames
IDS = sorted(DIALECT.layouts)


def frames(senders: list[int], ids: list[int]) -> Frames:
    """Return good frames of senders (sysid * 256 + compid) and message ids."""
    made = TEMPLATE.take(np.zeros(len(senders), np.int64)).own()
    made.sysid = np.array([sender >> 8 for sender in senders], np.uint8)
    made.compid = np.array([sender & 0xFF for sender in senders], np.uint8)
    made.msgid = np.array(ids, np.int32)
    return made


def test_counts() -> None:
    traffic = Traffic(DIALECT)
    admitted = traffic.admit(frames([257, 257, 513, 257], [30, 30, 30, 0]))
    assert admitted.all()
    streams = [(s.sysid, s.compid, s.message, s.frames) for s in traffic.streams()]
    assert streams == [(1, 1, "ATTITUDE", 2), (1, 1, "HEARTBEAT", 1), (2, 1, "ATTITUDE", 1)]


def test_bad_frames_are_nobodys() -> None:
    found = read(
        [record(attitude(0)) + record(broken(attitude(1))) + record(attitude(2))], stamped=True
    )
    traffic = Traffic(DIALECT)
    assert traffic.admit(found.batches[0].frames).tolist() == [True, False, True]
    assert traffic.refused == 0


def test_times_come_from_stamps_that_can_be_believed() -> None:
    traffic = Traffic(DIALECT)
    made = frames([257] * 4, [0] * 4)
    made.t_us = np.array([5, START_US, START_US - 10, 2**62])
    made.t_valid = np.array([False, True, True, False])
    traffic.admit(made)
    assert traffic.t_first == pytest.approx((START_US - 10) * 1e-6)
    assert traffic.t_last == pytest.approx(START_US * 1e-6)


def test_65_000_senders() -> None:
    """The first 256 are judged; of the others it is said how many frames they sent."""
    traffic = Traffic(DIALECT)
    senders = list(range(65_536))
    admitted = np.concatenate(
        [
            traffic.admit(frames(senders[a : a + 5000], [0] * len(senders[a : a + 5000])))
            for a in range(0, 65_536, 5000)
        ]
    )
    assert np.flatnonzero(admitted).tolist() == senders[:MAX_SENDERS]
    assert traffic.refused == 65_536 - MAX_SENDERS
    assert len(traffic.streams()) == MAX_SENDERS
    assert traffic.admit(frames([3, 60_000], [0, 0])).tolist() == [True, False]


def test_every_message_of_many_senders() -> None:
    traffic = Traffic(DIALECT)
    senders, ids = zip(*itertools.product(range(40), IDS))
    admitted = traffic.admit(frames(list(senders), list(ids)))
    assert np.count_nonzero(admitted) == MAX_STREAMS
    assert admitted[:MAX_STREAMS].all()
    assert len(traffic.streams()) == MAX_STREAMS


@settings(max_examples=50)
@given(
    senders=st.lists(st.integers(0, 700), min_size=1, max_size=800),
    cuts=st.lists(st.integers(0, 800), max_size=5),
)
def test_who_is_admitted_does_not_depend_on_cuts(senders: list[int], cuts: list[int]) -> None:
    at_once = Traffic(DIALECT).admit(frames(senders, [0] * len(senders)))
    traffic, edges = Traffic(DIALECT), sorted({0, len(senders), *(c % len(senders) for c in cuts)})
    parts = [
        traffic.admit(frames(senders[a:b], [0] * (b - a))) for a, b in itertools.pairwise(edges)
    ]
    assert np.concatenate(parts).tolist() == at_once.tolist()
