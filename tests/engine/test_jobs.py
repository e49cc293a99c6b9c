"""Reading in several processes: order, exceptions, processes that die, and an early end."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import closing

from mavframecheck.engine.jobs import read_files
from mavframecheck.sources import SourceError


def read(path: str, advance: Callable[[int], None]) -> str:
    """Read what a path asks for."""
    if path == "dies":
        os._exit(1)
    if path == "refused":
        raise SourceError("refused: is no recording")
    if path.startswith("slow"):
        while True:
            time.sleep(0.1)
            advance(1)
    return path.upper()


def test_results_come_in_the_order_of_the_files() -> None:
    """An exception is a result like others."""
    names = [f"{k}" for k in range(20)]
    results = list(read_files([*names, "refused", "z"], read, 2))
    assert results[:20] == [(name, name) for name in names]
    path, error = results[20]
    assert (path, type(error), str(error)) == ("refused", SourceError, "refused: is no recording")
    assert results[21] == ("z", "Z")


def test_a_process_that_dies_is_said_of_its_file() -> None:
    """And nothing hangs."""
    (done, lost) = read_files(["a", "dies"], read, 1)
    assert done == ("a", "A")
    assert isinstance(lost[1], SourceError)
    assert str(lost[1]).startswith("dies: not judged: a process ended while it worked")


def test_an_early_end_does_not_wait_for_the_rest() -> None:
    """Processes stop where they next say how far they are; else this test would never end."""
    with closing(read_files(["a", *(f"slow {k}" for k in range(8))], read, 2)) as results:
        assert next(results) == ("a", "A")
