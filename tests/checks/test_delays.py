"""The delay of a track behind another one, whatever its frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.checks.delays import fit_delay, speeds

Floats = npt.NDArray[np.float64]
LEGS = np.array([[0, 0, 0], [15, 0, 0], [15, 12, -3], [2, 12, -3], [2, -4, 0]], float)


def flight(t: Floats) -> Floats:
    """(n, 3) m: five legs of eight seconds, with a stop at each end."""
    leg = np.clip(t / 8, 0, 3.999)
    start, part = leg.astype(int), np.clip((leg % 1) * 1.6 - 0.3, 0, 1)
    smooth = part**2 * (3 - 2 * part)
    return np.asarray(LEGS[start] + (LEGS[start + 1] - LEGS[start]) * smooth[:, None])


def track(hz: float, delay_s: float, turn: float = 0.0, noise_m: float = 0.0) -> Floats:
    t = np.arange(0, 32, 1 / hz)
    turned = np.array(
        [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    noise = np.random.default_rng(2).normal(0, noise_m, (len(t), 3))
    return np.column_stack((t, flight(t - delay_s) @ turned.T + [30, -5, 2] + noise))


@settings(max_examples=30, deadline=None)
@given(st.floats(-0.4, 1.2), st.floats(-3, 3), st.sampled_from([8.0, 20.0, 30.0]))
def test_delay_is_found_in_any_frame(delay_s: float, turn: float, hz: float) -> None:
    fit = fit_delay(speeds(track(hz, delay_s, turn, 0.03)), speeds(track(10, 0)))
    assert fit is not None
    assert fit.delay_s == pytest.approx(delay_s, abs=0.05)
    assert fit.correlation > 0.95


def test_gaps_and_leaps_of_the_origin_do_not_matter() -> None:
    rows = track(25, 0.4)
    rows = rows[(rows[:, 0] < 11) | (rows[:, 0] > 13.5)]
    rows[rows[:, 0] > 20, 1:] += 40
    fit = fit_delay(speeds(rows), speeds(track(10, 0)))
    assert fit is not None
    assert fit.delay_s == pytest.approx(0.4, abs=0.03)


def test_steady_speed_shows_no_delay() -> None:
    """A speed that changes slowly is nearly the same a little earlier."""
    t = np.arange(0, 60, 0.1)
    slow = np.column_stack((t, 5 * t + 20 * np.sin(0.05 * t), 0 * t, 0 * t))
    quick = np.column_stack((t, 5 * t + 2 * np.sin(2 * t), 0 * t, 0 * t))
    for rows, inert in ((slow, True), (quick, False)):
        fit = fit_delay(speeds(rows), speeds(rows))
        assert fit is not None
        assert (fit.inert > 0.99) == inert


def test_standing_still_says_nothing() -> None:
    still = np.column_stack((np.arange(0, 30, 0.1), np.zeros((300, 3))))
    assert fit_delay(speeds(track(20, 0.4)), speeds(still)) is None
