"""Restarts told from a vehicle's own clock."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.vehicle.boots import STEADY, BootClock, Restart


def restarts(stamps: list[int], cuts: list[int] | None = None) -> list[Restart]:
    """Return the restarts that a clock sees in stamps, which come in pieces."""
    clock, found = BootClock(), []
    number = np.arange(100, 100 + len(stamps))
    pieces = np.split(np.arange(len(stamps)), sorted(cuts or []))
    for piece in pieces:
        found += clock.update(number[piece], np.array(stamps, np.int64)[piece])
    return found


def test_a_clock_that_begins_anew() -> None:
    """The restart began with the first low stamp, and is certain with the last of several."""
    stamps = [*range(60_000, 70_000, 1000), *range(500, 20_500, 1000)]
    assert restarts(stamps) == [Restart(110, 110 + STEADY - 1)]


def test_several_restarts() -> None:
    once = [*range(0, 60_000, 1000)]
    assert [each.begun for each in restarts(once * 3)] == [160, 220]


@pytest.mark.parametrize(
    "stamps",
    [
        [60_000 + 100 * k - (3000 if k % 7 == 0 else 0) for k in range(200)],
        [clock + 100 * k for k in range(100) for clock in (60_000, 500_000)],
        [60_000] * 50,
        [60_000, 1000, 1100, 60_300, 1200] * 20,
    ],
    ids=["late copies", "two vehicles in turn", "frozen", "stray"],
)
def test_no_restart(stamps: list[int]) -> None:
    assert restarts(stamps) == []


@given(
    stamps=st.lists(st.sampled_from([0, 10, 900, 9_000, 30_000, 31_000]), max_size=60),
    cuts=st.lists(st.integers(0, 60), max_size=6),
)
def test_pieces(stamps: list[int], cuts: list[int]) -> None:
    """Restarts do not depend on where the stamps are cut."""
    assert restarts(stamps, cuts) == restarts(stamps)
