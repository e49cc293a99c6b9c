"""Which receive stamps can be believed.

Recordings carry stamps that are torn from their neighbours (by up to 10^13 s). They stay as they are, but
must not enter a duration, rate, gap or fit.
"""

from __future__ import annotations

import itertools

import numpy as np

from mavframecheck.wire.frames import Bools, Ints

LATEST_US = 4_102_444_800_000_000
"""2100-01-01: no recording is younger."""
TEAR_US = 3_600_000_000
"""Neighbours further apart than an hour belong to different runs."""
SETTLED = 3
"""Stamps that must agree before a new run is believed."""


class Stamps:
    """Judges stamps in order, carrying its state from batch to batch."""

    def __init__(self) -> None:
        """Start with no stamp seen."""
        self._previous: int | None = None
        self._run = 0
        self._trusted: int | None = None
        self._continues = True
        """Whether the current run began within an hour of the last believed stamp."""

    def valid(self, t_us: Ints, has_stamp: Bools) -> Bools:
        """Return, for each stamp, whether it is plausible and agrees with those around it; (n,).

        A run of stamps within an hour of each other is believed when it continues the last believed run
        (or is the first), else from its third stamp on.
        """
        result = has_stamp & (t_us > 0) & (t_us < LATEST_US)
        rows = np.flatnonzero(result)
        if not len(rows):
            return result
        stamps = t_us[rows]
        before = np.concatenate(
            ([stamps[0] if self._previous is None else self._previous], stamps[:-1])
        )
        breaks = np.flatnonzero(np.abs(stamps - before) > TEAR_US)
        edges = sorted({0, *breaks.tolist(), len(stamps)})
        torn = set(breaks.tolist())
        for first, last in itertools.pairwise(edges):
            if first in torn:
                self._begin_run(int(stamps[first]))
            believed = self._believe(stamps[first:last])
            result[rows[first : first + believed]] = False
        self._previous = int(stamps[-1])
        return result

    def _begin_run(self, first: int) -> None:
        self._run = 0
        self._continues = self._trusted is None or abs(first - self._trusted) <= TEAR_US

    def _believe(self, run: Ints) -> int:
        """Take a stretch of one run; return how many of its first stamps are not believed."""
        distrusted = 0
        if not self._continues:
            distrusted = min(max(SETTLED - 1 - self._run, 0), len(run))
        if distrusted < len(run):
            self._trusted = int(run[-1])
        self._run += len(run)
        return distrusted
