"""The text of a mission file: offsets to lines and columns."""

from __future__ import annotations

import functools
from bisect import bisect_right
from itertools import accumulate


class Text:
    """A text whose places are asked for by line and column."""

    def __init__(self, content: str) -> None:
        """Hold `content`, without a byte order mark; line ends are as in the file."""
        self.content = content

    @functools.cached_property
    def _starts(self) -> list[int]:
        """Offsets at which lines begin; a line ends with LF, CR LF or CR."""
        lines = self.content.splitlines(keepends=True)
        return list(accumulate((len(line) for line in lines), initial=0))

    def place(self, offset: int) -> tuple[int, int]:
        """Return line and column of the character at `offset`, both counted from 1."""
        line = bisect_right(self._starts, offset, hi=max(len(self._starts) - 1, 1))
        return line, offset - self._starts[line - 1] + 1
