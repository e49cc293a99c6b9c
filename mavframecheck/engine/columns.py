"""Statistics of columns that grow batch by batch and stay small: counts, ranges, values, rates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from mavframecheck.semantics.tags import FieldTag, Sentinel
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Field, Frames

Bools = npt.NDArray[np.bool_]

MOST_VALUES = 32
"""Different values that a tally tells apart: a hostile log has 65 000 masks."""
FEWEST_FOR_RATE = 5
"""Messages below which a rate would say nothing."""
PAUSE = 20.0
"""An interval this many times longer than the others is a pause..."""
PAUSE_SHARE = 0.05
"""... as long as at most this share of the intervals are pauses."""
FASTEST_HZ = 1000.0
"""What seems faster came all at once: it has no rate."""
_BINS = 80


class Tally:
    """How often a column had each of its first 32 different values."""

    __slots__ = ("counts", "others")

    def __init__(self) -> None:
        """Start with nothing counted."""
        self.counts: dict[Any, int] = {}
        self.others = 0
        """Rows with further values."""

    def add(self, column: npt.NDArray[Any]) -> None:
        """Count the values of a column, (n,), in the order in which they first come."""
        values, first, counts = np.unique(column, return_index=True, return_counts=True)
        for place in np.argsort(first).tolist():
            value, count = values[place].item(), int(counts[place])
            if value in self.counts or len(self.counts) < MOST_VALUES:
                self.counts[value] = self.counts.get(value, 0) + count
            else:
                self.others += count

    def ranked(self) -> list[tuple[Any, int]]:
        """Return values and counts, most frequent first."""
        return sorted(self.counts.items(), key=lambda item: (-item[1], item[0]))


class Intervals:
    """The time between messages of a stream, as a histogram of half octaves."""

    __slots__ = ("_counts", "_last", "_sums")

    def __init__(self) -> None:
        """Start with no message."""
        self._counts = np.zeros(_BINS, np.int64)
        self._sums = np.zeros(_BINS, np.int64)
        self._last: int | None = None

    def add(self, frames: Frames) -> None:
        """Take the receive times of further messages; stamps that cannot be believed are left out."""
        t_us = frames.t_us[frames.t_valid]
        if not len(t_us):
            return
        before = t_us[0] if self._last is None else self._last
        gaps = np.abs(np.diff(t_us, prepend=before))[self._last is None :]
        bins = np.minimum(2 * np.log2(np.maximum(gaps, 1)), _BINS - 1).astype(np.int64)
        self._counts += np.bincount(bins, minlength=_BINS)
        np.add.at(self._sums, bins, gaps)
        self._last = int(t_us[-1])

    def rate_hz(self) -> float | None:
        """Return messages per second while the stream ran, None where there is no such number."""
        counts, sums = self._counts.tolist(), self._sums.tolist()
        count, total = sum(counts), sum(sums)
        most_pauses = PAUSE_SHARE * count
        if count + 1 < FEWEST_FOR_RATE:
            return None
        for number, length in reversed(list(zip(counts, sums, strict=True))):
            most_pauses -= number
            rest, left = count - number, total - length
            if most_pauses < 0 or (number and length * rest < PAUSE * left * number):
                break
            count, total = rest, left
        return count * 1e6 / total if total * FASTEST_HZ >= count * 1e6 else None


class FieldColumn:
    """One field with one meaning (or none), over all messages in which it means that."""

    __slots__ = (
        *("count", "field", "infinite", "maximum", "minimum", "nan", "present", "seen"),
        *("selected", "sentinels", "tag", "used", "values", "_codes"),
    )

    def __init__(self, field: Field, tag: FieldTag | None, *, tallied: bool) -> None:
        """Watch `field`, which means `tag`; `tallied`: its values are to be told apart."""
        self.field = field
        self.tag = tag
        self.count = self.present = self.used = 0
        """Messages: all, those that give the field, those whose mask lets it count."""
        self.values = self.nan = self.infinite = 0
        """Numbers in the used messages."""
        self.minimum: float | None = None
        self.maximum: float | None = None
        """Raw, over numbers that are measurements."""
        self.seen = Tally() if tallied else None
        self.selected = Tally() if tag is not None and tag.frame_field else None
        """Values of the field that selects frame or height reference, in the used messages."""
        self._codes = _one_by_one(tag)
        self.sentinels = [0] * len(self._codes)

    def add(self, rows: Rows) -> None:
        """Take in further messages."""
        raw, tag = rows.raw(self.field.name), self.tag
        present = rows.present(self.field.name)
        used = present if tag is None else rows.used(tag)
        self.count += len(rows)
        self.present += int(np.count_nonzero(present))
        number = int(np.count_nonzero(used))
        self.used += number
        if not number:
            return
        chosen: Any = slice(None) if number == len(rows) else used
        if self.seen is not None:
            self.seen.add(raw[chosen])
        if self.selected is not None and tag is not None:
            self.selected.add(_whole(rows.raw(tag.frame_field)[chosen]))
        if raw.dtype.kind in "iuf":
            self._measure(raw[chosen], [rows.unknown(code)[chosen] for code in self._codes])

    def _measure(self, raw: npt.NDArray[Any], codes: Sequence[Bools]) -> None:
        """Count codes and numbers that are none, and widen the range by the rest."""
        self.values += raw.size
        valid = np.ones(raw.shape, np.bool_)
        for place, code in enumerate(codes):
            self.sentinels[place] += int(np.count_nonzero(code & valid))
            valid &= ~code
        if raw.dtype.kind == "f":
            nan, finite = np.isnan(raw), np.isfinite(raw)
            self.nan += int(np.count_nonzero(nan))
            self.infinite += int(np.count_nonzero(~(finite | nan)))
            valid &= finite
        if valid.any():
            self._widen(raw if valid.all() else raw[valid])

    def _widen(self, raw: npt.NDArray[Any]) -> None:
        low, high = raw.min().item(), raw.max().item()
        self.minimum = low if self.minimum is None else min(self.minimum, low)
        self.maximum = high if self.maximum is None else max(self.maximum, high)


def _one_by_one(tag: FieldTag | None) -> tuple[FieldTag, ...]:
    """Return the tag once for each of its sentinels, as if that were its only unknown value."""
    if tag is None:
        return ()
    replace = msgspec.structs.replace
    return tuple(replace(tag, sentinels=(_unknown(code),)) for code in tag.sentinels)


def _unknown(sentinel: Sentinel) -> Sentinel:
    return msgspec.structs.replace(sentinel, known=False)


def _whole(column: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return selectors as integers; one that travels as a float and holds none becomes -1."""
    if column.dtype.kind != "f":
        return column
    whole = np.isfinite(column) & (np.abs(column) < 2**31)
    return np.where(whole, column, -1).astype(np.int64)
