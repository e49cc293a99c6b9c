"""Recordings that appear in a directory, each once it is complete."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

from mavframecheck.sources.paths import files_under, kind_of
from mavframecheck.sources.sniff import RECORDINGS

QUIET_S = 5.0
"""A file that has not grown for this long is complete; one that grows later comes again."""

_State: TypeAlias = tuple[int, int]
"""Size in bytes and time of the last change in ns."""


class Arrivals:
    """Watches a directory and those below it."""

    def __init__(self, directory: Path) -> None:
        """Begin; what is there already is old until it changes."""
        self._directory = directory
        self._given = dict(self._states())
        """Files and the state in which they were given out, or lay there at the beginning."""
        self._changed: dict[Path, tuple[_State, float]] = {}
        """Files that are new or changed, their state, and since when they have it."""

    def complete(self, now: float) -> Iterator[Path]:
        """Yield the recordings that were new or changed and have stood still; `now` is s of any clock."""
        for path, state in self._states():
            if self._given.get(path) == state or not state[0]:
                continue
            before, since = self._changed.get(path, (None, now))
            if before != state:
                self._changed[path] = state, now
            elif now - since >= QUIET_S:
                del self._changed[path]
                self._given[path] = state
                if kind_of(path) in (None, *RECORDINGS):
                    yield path

    def _states(self) -> Iterator[tuple[Path, _State]]:
        """Yield every file with its state; what vanishes on the way is left out."""
        for path in files_under(self._directory):
            try:
                stat = path.stat()
            except OSError:
                continue
            yield path, (stat.st_size, stat.st_mtime_ns)
