"""Values over time, kept so that a whole column of rows can ask "what was known when I was sent?"."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.wire import Frames

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Values = npt.NDArray[Any]

LATE_FRAMES = 20_000
LATE_US = 60_000_000
"""A value may come this much later than the row it is needed for (frames, and us of receive time)."""

_INDEX_BITS = 44


class Asked(NamedTuple):
    """Rows that ask for context: whose (`key`), and when they were sent; all (n,)."""

    key: Ints
    """System or sender; negative where it is not known whom the row is about."""
    number: Ints
    """Running number of the frame."""
    t_us: Ints
    t_valid: Bools


class Answer(NamedTuple):
    """Where in a history the answer for each row lies; both (n,)."""

    place: Ints
    found: Bools


class History:
    """The values of some quantities per key (a system or a sender), in frame order.

    Holds what the current batch said and, before that, only the last value of each key.
    """

    def __init__(self, **blank: object) -> None:
        """Name the quantities; each default is what an unknown value reads as (NaN, ``unknown``)."""
        self._blank = {name: np.asarray(value) for name, value in blank.items()}
        self._order: Ints = np.zeros(0, np.int64)
        self._t_us: Ints = np.zeros(0, np.int64)
        self._t_valid: Bools = np.zeros(0, np.bool_)
        self._values: dict[str, Values] = {
            name: blank[:0] for name, blank in self._blanks(1).items()
        }

    def _blanks(self, n: int) -> dict[str, Values]:
        return {name: np.full(n, value) for name, value in self._blank.items()}

    def extend(self, key: Ints, frames: Frames, index: Ints, **values: Values) -> None:
        """Add rows of a batch: the `key` each is about, its frame and running number, and its values."""
        if not len(key):
            return
        order = np.concatenate((self._order, key << _INDEX_BITS | index))
        by = np.argsort(order, kind="stable")
        self._order = order[by]
        self._t_us = np.concatenate((self._t_us, frames.t_us))[by]
        self._t_valid = np.concatenate((self._t_valid, frames.t_valid))[by]
        for name, old in self._values.items():
            self._values[name] = np.concatenate((old, values[name]))[by]

    def settle(self) -> None:
        """Forget all but the last value of each key: the batch is done."""
        key = self._order >> _INDEX_BITS
        last = (
            np.flatnonzero(np.concatenate((key[1:] != key[:-1], [True])))
            if len(key)
            else np.zeros(0, np.int64)
        )
        self._order, self._t_us, self._t_valid = (
            self._order[last],
            self._t_us[last],
            self._t_valid[last],
        )
        self._values = {name: values[last] for name, values in self._values.items()}

    def ask(self, asked: Asked, *, late: bool = True) -> Answer:
        """Find, for each row, the last value said before it, else (if `late`) the first one soon after it."""
        if not len(self._order):
            return Answer(np.zeros(len(asked.key), np.int64), np.zeros(len(asked.key), np.bool_))
        wanted = asked.key << _INDEX_BITS | asked.number
        after = np.searchsorted(self._order, wanted, side="left")
        before = np.maximum(after - 1, 0)
        said = (after > 0) & (self._order[before] >> _INDEX_BITS == asked.key)
        after = np.minimum(after, len(self._order) - 1)
        soon = (self._order[after] >> _INDEX_BITS == asked.key) & (self._order[after] >= wanted)
        soon &= self._order[after] - wanted <= LATE_FRAMES
        timed = self._t_valid[after] & asked.t_valid
        soon &= ~timed | (np.abs(self._t_us[after] - asked.t_us) <= LATE_US)
        return Answer(
            np.where(said, before, after), (said | soon if late else said) & (asked.key >= 0)
        )

    def values(self, name: str, answer: Answer) -> Values:
        """Return the quantity `name` at the places of `answer`, blank where nothing was found."""
        blank = self._blank[name]
        if not len(self._order):
            return np.full(len(answer.place), blank)
        return np.where(answer.found, self._values[name][answer.place], blank)

    def last(self, name: str, key: int) -> Any:
        """Return the last value of the quantity `name` for one key, None when there is none."""
        place = int(np.searchsorted(self._order, (key + 1) << _INDEX_BITS)) - 1
        if place < 0 or self._order[place] >> _INDEX_BITS != key:
            return None
        return self._values[name][place]
