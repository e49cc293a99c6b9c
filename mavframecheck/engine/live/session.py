"""One link judged while it runs: the engine of `check`, fed with tlog records as they are made.

What `finish` returns is what `check` says of these records, wherever they were cut and whenever somebody
asked: the records are read as the tlog that they are.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator

import numpy as np

from mavframecheck.engine.check import summed_up
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.live.news import FindingNews
from mavframecheck.engine.pack import chosen_rules
from mavframecheck.engine.reading import Reading
from mavframecheck.engine.runner import Runner
from mavframecheck.engine.settings import Settings
from mavframecheck.model import FileReport, Finding
from mavframecheck.model.live import Change
from mavframecheck.sources import Kind
from mavframecheck.wire import Batch, Chunk, Dialect, whole

ASK_S = 0.02
"""Python checks are asked for so long (s) at a time: one at least."""
ASK_SHARE = 0.1
"""Asking takes at most this part of the time."""


class Feed:
    """A recording that is being made: records are put in at one end and read at the other."""

    kind = Kind.TLOG
    stamped = True
    notes: tuple[str, ...] = ()

    def __init__(self, name: str) -> None:
        """Hold nothing yet; `name` is what findings call it."""
        self.name = name
        self.waiting: deque[bytes] = deque()
        self.ended = False
        self._offset = 0

    def chunks(self) -> Iterator[list[Chunk]]:
        """Yield what was put in; while there is nothing, an empty chunk."""
        while self.waiting or not self.ended:
            data = self.waiting.popleft() if self.waiting else b""
            yield [whole(data, self._offset)]
            self._offset += len(data)


class Session:
    """The judgement of one link."""

    def __init__(
        self,
        link: str,
        file: str,
        pack: Pack,
        settings: Settings,
        dialect: Dialect,
        timer: Callable[[], float] = time.perf_counter,
    ) -> None:
        """Judge `link` with the rules of `pack` that `settings` choose; findings are about `file`."""
        self._feed = Feed(file)
        self.reading = Reading(self._feed, settings, dialect)
        self.runner = Runner(file, chosen_rules(pack, settings), self.reading.context, dialect)
        self._batches = self.reading.batches()
        self._news = FindingNews(link, self.runner.episodes)
        self._timer = timer
        self._asking: Iterator[None] = iter(())
        self._rested_until = 0.0
        self._asked_s = 0.0
        self.now: float | None = None
        """Receive time of the newest message, s since 1970."""

    def take(self, records: bytes) -> Batch:
        """Judge further tlog records, or parts of them; return the frames that became certain."""
        if records:
            self._feed.waiting.append(records)
        batch = next(self._batches)
        self._judge(batch)
        return batch

    def _judge(self, batch: Batch) -> None:
        self.runner.update(batch)
        if len(batch) and (times := batch.frames.t_us[batch.frames.t_valid]).size:
            self.now = float(np.max(times)) * 1e-6

    def changes(self) -> list[Change]:
        """Return what is new about findings since the last call."""
        return self._news.since(self.now or 0.0)

    def ask(self) -> None:
        """Ask some Python checks, or none if the last round is not long ago; `changes` then tells."""
        began = now = self._timer()
        if now < self._rested_until or self.now is None:
            return
        while now - began < ASK_S:
            if next(self._asking, self) is self:
                self._asking = self.runner.ask()
                self._rested_until = now + self._asked_s / ASK_SHARE
                self._asked_s = 0.0
                break
            now = self._timer()
        self._asked_s += self._timer() - began

    def finish(self) -> tuple[FileReport, tuple[Finding, ...]]:
        """Return the report of the whole link: nothing more comes."""
        self._feed.ended = True
        for batch in self._batches:
            self._judge(batch)
        return summed_up(self.reading, self.runner)
