"""Many recordings at once: a process judges a file, results come in the order of the files."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from typing import Any

from mavframecheck.engine.memory import keep_freed_memory
from mavframecheck.sources import SourceError

Read = Callable[..., Any]
"""Takes the path of a file, and a function to call with the bytes read so far."""


class _Stopped(Exception):  # noqa: N818  (nobody catches it)
    """The run is over; what a process is still reading is of no use."""


def read_files(paths: Sequence[str], read: Read, jobs: int) -> Generator[tuple[str, Any]]:
    """Yield each path with what `read` returns of it, or with the exception that it raises.

    When the caller stops, or an exception such as Ctrl-C ends the wait, the processes stop at their
    next batch. They are new ones, not forks: threads of the caller do not matter.
    """
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    count = max(1, min(jobs, len(paths)))
    with ProcessPoolExecutor(count, context, _begin, (read, stop)) as pool:
        with _deaf():
            futures = [(path, pool.submit(_read, path)) for path in paths]
        try:
            for path, future in futures:
                yield path, _outcome(path, future)
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


@contextmanager
def _deaf() -> Iterator[None]:
    """Hold back Ctrl-C while processes begin: they inherit that, and the caller hears it afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _outcome(path: str, future: Future[Any]) -> Any:
    try:
        return future.result()
    except BrokenProcessPool:
        return SourceError(
            f"{path}: not judged: a process ended while it worked, perhaps for want of memory; "
            "try fewer --jobs"
        )
    except Exception as error:  # noqa: BLE001  (raised where the file would have been judged)
        return error


# ---- in the processes ----

_given: tuple[Read, Event]
"""What a process was given when it began."""


def _begin(read: Read, stop: Event) -> None:
    """Take what all files of this process share."""
    global _given  # noqa: PLW0603  (a process pool has no other place)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    keep_freed_memory()
    _given = read, stop


def _read(path: str) -> Any:
    read, stop = _given

    def advance(_read: int) -> None:
        if stop.is_set():
            raise _Stopped

    advance(0)
    return read(path, advance)
