"""Restarts of a vehicle, told from its own clock: what it said before one need not hold behind it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

FALL_MS = 5_000
"""Stamps fall by more than this: what is sampled or relayed late lags by less."""
STEADY = 8
"""Stamps in a row that must be low: two vehicles under one system id take turns."""
MAX_BOOTS = 200


class Restart(NamedTuple):
    """A restart of a vehicle."""

    begun: int
    """Number of the first frame behind it."""
    certain: int
    """Number of the frame that proves it; what goes by frame order takes note of it there."""


class BootClock:
    """The clock of one vehicle, ms since its start, as its messages come in."""

    def __init__(self) -> None:
        """Start with no stamp seen."""
        self.boot = 0
        """Restarts so far."""
        self._highest = -1
        self._low: Ints = np.zeros(0, np.int64)
        """Frames in a row, up to now, whose stamps lie far below the highest one."""

    def update(self, number: Ints, t_ms: Ints) -> list[Restart]:
        """Return the restarts that become certain at frames `number`, (n,) with stamps `t_ms`."""
        restarts = []
        while len(t_ms) and self.boot < MAX_BOOTS:
            highest = np.maximum.accumulate(np.maximum(t_ms, self._highest))
            low = _lengths(t_ms < highest - FALL_MS, len(self._low))
            known = np.concatenate((self._low, number))
            certain = np.flatnonzero(low >= STEADY)
            if not len(certain):
                self._highest, self._low = int(highest[-1]), known[len(known) - int(low[-1]) :]
                break
            at = int(certain[0])
            first = int(known[at + len(self._low) + 1 - STEADY])
            restarts.append(Restart(first, int(number[at])))
            self.boot += 1
            self._highest, self._low = int(t_ms[at]), known[:0]
            number, t_ms = number[at + 1 :], t_ms[at + 1 :]
        return restarts


def _lengths(holds: Bools, before: int) -> Ints:
    """Return (n,) for how many rows in a row it holds, up to each; `before` ones came before the first."""
    rows = np.arange(len(holds))
    last = np.maximum.accumulate(np.where(holds, -1 - before, rows))
    return rows - last
