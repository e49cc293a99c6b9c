"""TIMESYNC exchanges: who asks, who answers, and how far apart their clocks are.

A question has tc1 = 0 and the asker's clock in ts1, ns (ArduPilot adds its system id to tell its own
questions apart); an answer repeats ts1 and has the answerer's clock in tc1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mavframecheck.wire import Table

WINDOW = 5_000
"""Frames within which an answer follows its question."""
MAX_PAIRS = 64
"""Pairs of asker and answerer that are told apart."""

Ints = npt.NDArray[np.int64]


@dataclass(slots=True)
class Exchange:
    """The questions of one component that another one answers."""

    asker: int
    answerer: int
    """``sysid * 256 + compid`` of both."""
    answers: int = 0
    ahead_ns: int = 0
    """Least of answerer's clock minus asker's: the way of the question is in it, but no waiting."""


class Exchanges:
    """The exchanges of a recording."""

    def __init__(self) -> None:
        """Start with no question asked."""
        self.asked: dict[int, int] = {}
        """Questions of each sender."""
        self.pairs: dict[tuple[int, int], Exchange] = {}
        self.strange: dict[int, int] = {}
        """Answers of each sender that nobody asked for, as far as the recording has the questions."""
        self._questions: Ints = np.zeros((0, 3), np.int64)
        """(n, 3) frame number, ts1, sender of the questions of late."""

    def update(self, table: Table) -> None:
        """Take in the TIMESYNC messages of a batch."""
        number, sender = table.frames.number, table.frames.sender
        asks = table["tc1"] == 0
        for each, count in zip(*np.unique(sender[asks], return_counts=True)):
            self.asked[int(each)] = self.asked.get(int(each), 0) + int(count)
        asked = np.column_stack((number, table["ts1"], sender))[asks]
        questions = np.concatenate((self._questions, asked))
        self._answer(table, np.flatnonzero(~asks), questions)
        self._questions = questions[questions[:, 0] > number[-1] - WINDOW]

    def _answer(self, table: Table, rows: Ints, questions: Ints) -> None:
        """Put each answer to the last question with its ts1."""
        questions = questions[np.lexsort((questions[:, 0], questions[:, 1]))]
        ts1, sender = table["ts1"][rows], table.frames.sender[rows]
        place = np.searchsorted(questions[:, 1], ts1, side="right") - 1
        at = np.maximum(place, 0)
        found = place >= 0
        if len(questions):
            late = table.frames.number[rows] - questions[at, 0]
            found &= (questions[at, 1] == ts1) & (late > 0) & (late < WINDOW)
            found &= questions[at, 2] != sender
        ahead = table["tc1"][rows] - ts1
        for k in np.flatnonzero(found).tolist():
            self._count(int(questions[at[k], 2]), int(sender[k]), int(ahead[k]))
        for each in sender[~found].tolist():
            self.strange[each] = self.strange.get(each, 0) + 1

    def _count(self, asker: int, answerer: int, ahead_ns: int) -> None:
        pair = self.pairs.get((asker, answerer))
        if pair is None:
            if len(self.pairs) >= MAX_PAIRS:
                return
            pair = self.pairs[asker, answerer] = Exchange(asker, answerer, 0, ahead_ns)
        pair.answers += 1
        pair.ahead_ns = min(pair.ahead_ns, ahead_ns)
