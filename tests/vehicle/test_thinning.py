"""Series that are drawn keep every extreme, in bounded memory, however the rows came."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.vehicle.thinning import MAX_BINS, Series, thinned

VALUES = st.one_of(st.floats(-1e6, 1e6), st.just(float("nan")))
ROWS = st.lists(st.tuples(st.integers(0, 3_000_000), VALUES, VALUES), min_size=1, max_size=200)


@given(rows=ROWS, cuts=st.lists(st.integers(0, 200), max_size=6), scale=st.sampled_from([1, 10**5]))
def test_pieces_do_not_matter(
    rows: list[tuple[int, float, float]], cuts: list[int], scale: int
) -> None:
    """Steps between rows are small and large, so stretches grow while rows come."""
    t = np.cumsum([step for step, _, _ in rows]) * scale
    values = np.array([pair for _, *pair in rows])
    whole, parts = Series(2), Series(2)
    whole.add(t, values)
    for piece in np.split(np.arange(len(t)), sorted(cut % (len(t) + 1) for cut in cuts)):
        parts.add(t[piece], values[piece])
    np.testing.assert_array_equal(whole.times, parts.times)
    np.testing.assert_array_equal(whole.values, parts.values)


def test_long_series_keep_extremes_in_bounded_memory() -> None:
    """A day at 50 Hz, with one spike in it, in batches."""
    random = np.random.default_rng(1)
    series, spike, t0 = Series(1), (np.inf, -np.inf), 1_772_445_600_000_000
    for batch in range(60):
        values = random.normal(size=(72_000, 1))
        if batch == 37:
            values[12_345] = 99.0
        t = t0 + (np.arange(72_000) + batch * 72_000) * 20_000
        series.add(t, values)
        assert len(series) <= 2 * MAX_BINS
        spike = min(spike[0], values.min()), max(spike[1], values.max())
    assert (series.values.min(), series.values.max()) == spike
    assert series.times[np.argmax(series.values)] == t0 + (12_345 + 37 * 72_000) * 20_000
    assert len(series) > MAX_BINS / 2


def test_a_stretch_keeps_least_and_greatest_of_each_column() -> None:
    """An independent loop over the stretches finds the same."""
    random = np.random.default_rng(2)
    t, values = np.arange(50_000.0), random.normal(size=(50_000, 2))
    times, rows = thinned(t, values, bins=100)
    assert len(times) <= 400
    for k in range(100):
        inside = (t / (t[-1] / 100)).astype(int) == k
        kept = (times / (t[-1] / 100)).astype(int) == k
        assert rows[kept].min(axis=0) == pytest.approx(values[inside].min(axis=0))
        assert rows[kept].max(axis=0) == pytest.approx(values[inside].max(axis=0))


def test_short_series_stay_as_they_are() -> None:
    t, values = np.arange(50.0), np.arange(100.0).reshape(50, 2)
    times, rows = thinned(t, values)
    np.testing.assert_array_equal(times, t)
    np.testing.assert_array_equal(rows, values)
