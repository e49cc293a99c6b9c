"""Tracks: one sample a bin, windows that thin out, and nothing that depends on batches."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.sources import Kind
from mavframecheck.vehicle import tracks
from mavframecheck.vehicle.tracks import PLACE, TIME, TrackKey, Tracks
from mavframecheck.wire import read_batches
from tests.engine.judged import CutRecording
from tests.strategies import DIALECT, START_US, cut, frame

KEY = TrackKey(1 * 256 + 1, "LOCAL_POSITION_NED")


def heard(data: bytes, cuts: list[int] | None = None) -> Tracks:
    """Return what was kept of a recording."""
    found = Tracks()
    opened = CutRecording(data, cut(data, cuts or []), Kind.TLOG)
    for batch in read_batches(opened.chunks(), DIALECT, stamped=True):
        found.update(batch)
    return found


def recording(times_s: list[float]) -> bytes:
    """Return local positions received at some times."""
    return b"".join(
        (START_US + round(t * 1e6)).to_bytes(8, "big")
        + frame("LOCAL_POSITION_NED", {"x": float(k), "time_boot_ms": 0})
        for k, t in enumerate(times_s)
    )


def test_one_sample_a_bin() -> None:
    """Bursts, and times that go back, leave one sample each 50 ms."""
    found = heard(recording([0.0, 0.01, 0.02, 0.06, 0.04, 0.12, -5.0, 0.2]))
    samples = found.tracks[KEY].samples()
    assert samples[:, PLACE][:, 0].tolist() == [0.0, 3.0, 5.0, 7.0]
    assert found.tracks[KEY].rows == 7


def test_long_recordings_thin_out() -> None:
    """What is kept of hours is bounded, and spread over all of them."""
    hours = [k * 7.0 for k in range(4000)]
    samples = heard(recording(hours)).tracks[KEY].samples()
    windows = np.unique(samples[:, TIME] // 10)
    assert len(windows) <= tracks.MAX_WINDOWS
    assert samples[-1, TIME] > 0.95 * hours[-1]


DATA = recording([k * 1.7 for k in range(900)])


@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, len(DATA)), max_size=30))
def test_cuts(cuts: list[int]) -> None:
    """The same samples, wherever batches end."""
    whole, parts = heard(DATA).tracks[KEY], heard(DATA, cuts).tracks[KEY]
    np.testing.assert_array_equal(whole.samples(), parts.samples())
    assert (whole.first, whole.last, whole.rows) == (parts.first, parts.last, parts.rows)
