"""Rows that wait for context: home, identity and version often come after the row they judge."""

from __future__ import annotations

import numpy as np

from mavframecheck.vehicle import NAMES
from mavframecheck.vehicle.history import LATE_FRAMES, LATE_US
from mavframecheck.vehicle.rows import Bools, Ints, Rows, join
from mavframecheck.wire import Frames


class Queue:
    """The rows of one message that wait for one set of context names."""

    def __init__(self, names: tuple[str, ...]) -> None:
        """Wait for the context columns called `names`."""
        self.names = names
        self._patience_us = max((_patience_us(name) for name in names), default=0)
        self._waiting: Rows | None = None

    def offer(self, rows: Rows | None, now: Frames) -> Rows | None:
        """Add `rows`; return those that have their context, and those that waited too long.

        Rows of one stream leave in the order in which they came. `now` are the frames of the current
        batch: their end is the present.
        """
        parts = [part for part in (self._waiting, rows) if part is not None and len(part)]
        self._waiting = None
        if not parts:
            return None
        both = parts[0] if len(parts) == 1 else join(parts)
        both.refresh(self.names)
        complete = both.complete(self.names)
        if complete.all():
            return both
        undecided = ~complete & ~_too_old(both, now, self._patience_us)
        if not undecided.any():
            return both
        held = _from_first(both.stream, undecided)
        self._waiting = both.take(held).compact()
        return both.take(~held)

    def close(self) -> Rows | None:
        """Return what still waits when the recording ends."""
        waiting, self._waiting = self._waiting, None
        return waiting


def _patience_us(name: str) -> int:
    """Return how long a row waits for a context name, us."""
    entry = NAMES[name]
    return (entry.max_age_us or 0) if entry.after else LATE_US


def _too_old(rows: Rows, now: Frames, patience_us: int) -> Bools:
    """Return (n,) rows for which a value said after `now` would come too late."""
    if not len(now):
        return np.zeros(len(rows), np.bool_)
    frames = rows.table.frames
    old = now.number[-1] - frames.number > LATE_FRAMES
    return np.asarray(old | (now.clock_us[-1] - frames.clock_us > patience_us))


def _from_first(stream: Ints, rows: Bools) -> Bools:
    """Return (n,) the given rows, and those that come after one of them in its stream."""
    held, first = np.unique(stream[rows], return_index=True)
    since = np.flatnonzero(rows)[first]
    which = np.searchsorted(held[:-1], stream)
    return np.asarray((held[which] == stream) & (np.arange(len(stream)) >= since[which]))
