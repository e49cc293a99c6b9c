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
"""A value may come this much later than the row it is needed for (frames, and us of the recording's time)."""

_NUMBER_BITS = 38
_NEVER = np.iinfo(np.int64).max


class Asked(NamedTuple):
    """Rows that ask for context: whose (`key`), and when they were sent; all (n,)."""

    key: Ints
    """System, sender, or system and command; negative where it is not known whom the row is about."""
    number: Ints
    """Running number of the frame."""
    since: Ints
    """The same, or of the frame that told whom the row is about: what is asked for is the value then."""
    t_us: Ints
    t_valid: Bools
    clock_us: Ints
    """Time of the recording, which never goes back: so what is late does not become early again."""


class Answer(NamedTuple):
    """Where in a history the value for each row lies; all (n,)."""

    place: Ints
    found: Bools


class History:
    """The values of some quantities per key, in frame order.

    Holds what the current batch said and, before that, only the last value of each key.
    """

    def __init__(self, quantities: tuple[str, ...], *, ages: bool = True) -> None:
        """Remember numbers for `quantities`; what was never said reads as NaN.

        What does not age (`ages` False) is remembered where it changes: to say it again adds nothing.
        """
        self._ages = ages
        self._order: Ints = np.zeros(0, np.int64)
        self._t_us: Ints = np.zeros(0, np.int64)
        self._t_valid: Bools = np.zeros(0, np.bool_)
        self._clock_us: Ints = np.zeros(0, np.int64)
        self._values: dict[str, Values] = {name: np.zeros(0) for name in quantities}

    def extend(self, key: Ints, frames: Frames, values: dict[str, Values]) -> None:
        """Add rows of a batch: the `key` and the frame of each, and its values."""
        order = np.concatenate((self._order, key << _NUMBER_BITS | frames.number))
        by: Ints | slice = slice(None)
        if (order[1:] < order[:-1]).any():
            by = np.argsort(order, kind="stable")
        self._order = order[by]
        self._t_us = np.concatenate((self._t_us, frames.t_us))[by]
        self._t_valid = np.concatenate((self._t_valid, frames.t_valid))[by]
        self._clock_us = np.concatenate((self._clock_us, frames.clock_us))[by]
        for name, old in self._values.items():
            new = values.get(name)
            said = np.full(len(key), np.nan) if new is None else new
            self._values[name] = np.concatenate((old, said))[by]
        if not self._ages:
            self._keep(self._news())

    def _news(self) -> Bools:
        """Return (n,) rows that begin a key, or say something else than the row before."""
        news: Bools = np.diff(self._order >> _NUMBER_BITS, prepend=-1) != 0
        for said in self._values.values():
            news[1:] |= (said[1:] != said[:-1]) & ~(np.isnan(said[1:]) & np.isnan(said[:-1]))
        return news

    def settle(self) -> None:
        """Forget all but the last value of each key: the batch is done."""
        self._keep(np.diff(self._order >> _NUMBER_BITS, append=-1) != 0)

    def _keep(self, rows: Bools) -> None:
        if rows.all():
            return
        self._order, self._t_us = self._order[rows], self._t_us[rows]
        self._t_valid, self._clock_us = self._t_valid[rows], self._clock_us[rows]
        self._values = {name: values[rows] for name, values in self._values.items()}

    def before(self, asked: Asked, max_age_us: int | None = None) -> Answer:
        """Find the last value said before each row, no older than `max_age_us`."""
        if self._holds_for_all(asked) and max_age_us is None:
            everywhere = np.zeros(len(asked.key), np.int64)
            return Answer(everywhere, everywhere == 0)
        wanted = asked.key << _NUMBER_BITS | asked.since
        place = np.searchsorted(self._order, wanted, side="left") - 1
        answer = self._answer(asked, place, np.asarray(place >= 0))
        if max_age_us is None or not len(self._order):
            return answer
        return answer._replace(found=answer.found & self._near(asked, answer.place, max_age_us))

    def _holds_for_all(self, asked: Asked) -> bool:
        """Return whether a single value is known, said before any of the rows that ask, and of their key."""
        if len(self._order) != 1 or not len(asked.key):
            return False
        key, number = divmod(int(self._order[0]), 1 << _NUMBER_BITS)
        return bool((asked.key == key).all() and asked.since.min() > number)

    def after(self, asked: Asked, max_delay_us: int = LATE_US) -> Answer:
        """Find the first value said soon after each row."""
        wanted = asked.key << _NUMBER_BITS | asked.since
        place = np.searchsorted(self._order, wanted, side="left")
        answer = self._answer(asked, place, np.asarray(place < len(self._order)))
        if not answer.found.any():
            return answer
        soon = self.numbers(answer) - asked.number <= LATE_FRAMES
        soon &= self._clock_us[answer.place] - asked.clock_us <= max_delay_us
        return answer._replace(found=answer.found & soon)

    def _answer(self, asked: Asked, place: Ints, inside: Bools) -> Answer:
        """Return the places that lie inside the history and hold what is said of the key asked for."""
        if not len(self._order):
            return Answer(np.zeros(len(place), np.int64), np.zeros(len(place), np.bool_))
        place = np.where(inside, place, 0)
        return Answer(place, inside & (self._order[place] >> _NUMBER_BITS == asked.key))

    def numbers(self, answer: Answer) -> Ints:
        """Return (n,) the running number of the frame that said each value; the largest number for none."""
        if not len(self._order):
            return np.full(len(answer.place), _NEVER)
        number = self._order[answer.place] & ((1 << _NUMBER_BITS) - 1)
        return np.where(answer.found, number, _NEVER)

    def _near(self, asked: Asked, place: Ints, limit_us: int) -> Bools:
        """Return (n,) values within `limit_us` of their row; times that cannot be believed count as near."""
        timed = self._t_valid[place] & asked.t_valid
        return np.asarray(~timed | (np.abs(self._t_us[place] - asked.t_us) <= limit_us))

    def values(self, name: str, answer: Answer) -> Values:
        """Return the quantity `name` at the places of `answer`, NaN where nothing was found."""
        if not len(self._order):
            return np.full(len(answer.place), np.nan)
        values = self._values[name][answer.place]
        return values if answer.found.all() else np.where(answer.found, values, np.nan)

    def last(self, name: str, key: int) -> float | None:
        """Return the last value of the quantity `name` for one key, None when there is none."""
        place = int(np.searchsorted(self._order, (key + 1) << _NUMBER_BITS)) - 1
        if place < 0 or self._order[place] >> _NUMBER_BITS != key:
            return None
        return float(self._values[name][place])
