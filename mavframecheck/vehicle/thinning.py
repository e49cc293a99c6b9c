"""Long series made short without losing an extreme: what is drawn of a recording.

A series keeps, of each stretch of time, the rows that hold the least and the greatest value of a column.
The stretches grow as the recording does, so memory is flat; what is kept depends neither on how the rows
came in pieces nor on when the stretches grew.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

MAX_BINS = 1024
"""Stretches that a series is divided into."""
FIRST_US = 10_000
"""Length of a stretch while the series is short, us; or so many frames without receive times."""


class Series:
    """Rows of `columns` values over a time that never goes back."""

    def __init__(self, columns: int) -> None:
        """Start with no rows."""
        self._t: Ints = np.zeros(0, np.int64)
        self._rows: Floats = np.zeros((0, columns))
        self._t0: int | None = None
        self._level = 0

    def add(self, t_us: Ints, rows: Floats) -> None:
        """Add (n,) times and (n, columns) values; rows without any value are left out."""
        given = np.isfinite(rows).any(axis=1)
        t_us, rows = t_us[given], rows[given]
        if not len(t_us):
            return
        if self._t0 is None:
            self._t0 = int(t_us[0])
        while (int(t_us.max()) - self._t0) // (FIRST_US << self._level) >= MAX_BINS:
            self._level += 1
        t = np.concatenate((self._t, t_us))
        values = np.concatenate((self._rows, rows))
        if (np.diff(t) < 0).any():
            order = np.argsort(t, kind="stable")
            t, values = t[order], values[order]
        kept = extremes((t - self._t0) // (FIRST_US << self._level), values)
        self._t, self._rows = t[kept], values[kept]

    def __len__(self) -> int:
        """Return the number of rows that are kept."""
        return len(self._t)

    @property
    def times(self) -> Ints:
        """(n,) as they were added."""
        return self._t

    @property
    def values(self) -> Floats:
        """(n, columns)."""
        return self._rows


def extremes(stretch: Ints, rows: Floats) -> Ints:
    """Return the places, ascending, of the first least and first greatest value of each column.

    `stretch` (n,), ascending, says which rows (n, k) belong together.
    """
    kept = np.zeros(len(stretch), np.bool_)
    for column in rows.T:
        for values in (column, -column):
            order = np.lexsort((values, stretch))  # stable, and NaN comes last
            first = order[np.diff(stretch[order], prepend=stretch[order[0]] - 1) > 0]
            kept[first[np.isfinite(column[first])]] = True
    return np.flatnonzero(kept)


def thinned(t_s: Floats, rows: Floats, bins: int = MAX_BINS) -> tuple[Floats, Floats]:
    """Return what is to be drawn of (n,) times, s, ascending, and (n, k) values, all at hand."""
    given = np.isfinite(rows).any(axis=1)
    t_s, rows = t_s[given], rows[given]
    if len(t_s) <= 2 * bins:
        return t_s, rows
    length = max((float(t_s[-1]) - float(t_s[0])) / bins, 1e-9)
    kept = extremes(((t_s - t_s[0]) / length).astype(np.int64), rows)
    return t_s[kept], rows[kept]
