"""Ctrl-C ends the reading, never the writing of what was read."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Self


class Interrupts:
    """Hears Ctrl-C; a context manager around a run."""

    def __init__(self) -> None:
        self._asked = False
        self._reading = False
        self._main = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Self:
        if self._main:
            self._before = signal.signal(signal.SIGINT, self._heard)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._main:
            signal.signal(signal.SIGINT, self._before)

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Let Ctrl-C end what is done inside, also when it came before."""
        if self._asked:
            raise KeyboardInterrupt
        self._reading = True
        try:
            yield
        finally:
            self._reading = False

    def _heard(self, _signal: int, _frame: FrameType | None) -> None:
        """Take note; who asks again while a report is written gives the report up."""
        if self._reading or self._asked:
            self._reading = False
            raise KeyboardInterrupt
        self._asked = True
