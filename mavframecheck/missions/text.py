"""The text of a mission file: offsets to lines and columns, and errors that name them."""

from __future__ import annotations

import functools
import math
import re
from bisect import bisect_right
from itertools import accumulate
from typing import NoReturn

from mavframecheck.sources import SourceError

MOST_BYTES = 32 * 1024 * 1024
"""A mission of 65 535 items with all that QGroundControl writes around them fits into this."""
_WRITTEN = re.compile(r"[-+]?[0-9]*(?:\.([0-9]*))?(?:[eE]([-+]?[0-9]{1,3}))?")
_LINE_END = re.compile(r"\r\n|\n|\r")


class MissionError(SourceError):
    """A mission file that cannot be read; the message tells a person where and what to do about it."""


class Text:
    """A text whose places are asked for by line and column."""

    def __init__(self, name: str, content: str) -> None:
        """Hold `content`, without a byte order mark, of the file called `name`; line ends are as in the file."""
        self.name = name
        self.content = content

    @functools.cached_property
    def starts(self) -> list[int]:
        """Offsets at which lines begin; a line ends with LF, CR LF or CR."""
        if self.content.count("\r") > self.content.count("\r\n"):
            return [0, *(match.end() for match in _LINE_END.finditer(self.content))]
        lengths = map(len, self.content.split("\n"))
        return [0, *accumulate(map((1).__add__, lengths))][:-1]

    def place(self, offset: int) -> tuple[int, int]:
        """Return line and column of the character at `offset`, both counted from 1."""
        line = bisect_right(self.starts, offset)
        return line, offset - self.starts[line - 1] + 1

    def decimals(self, offset: int) -> float:
        """Return how many digits follow the decimal point of the number at `offset`; NaN where none is."""
        return decimals_of(self.number(offset))

    def number(self, offset: int) -> str:
        """Return the number that is written at `offset`."""
        match = _WRITTEN.match(self.content, offset)
        return match[0] if match else ""

    def fail(self, offset: int, problem: str) -> NoReturn:
        """Raise MissionError for the character at `offset`."""
        line, column = self.place(offset)
        raise MissionError(f"{self.name}, line {line}, column {column}: {problem}")


def decimals_of(word: str) -> float:
    """Return how many digits follow the decimal point of a number as it is written; NaN where none is."""
    whole, point, fraction = word.partition(".")
    if (fraction if point else whole).isdigit():
        return float(len(fraction))
    match = _WRITTEN.fullmatch(word)
    if match is None or not word:
        return math.nan
    return float(max(len(match[1] or "") - int(match[2] or 0), 0))


def decode(name: str, content: bytes) -> Text:
    """Return the text of a file; MissionError when it is not UTF-8 (a byte order mark is left out)."""
    if len(content) > MOST_BYTES:
        limit = MOST_BYTES // 1024**2
        raise MissionError(f"{name}: a mission file of more than {limit} MB is not read: split it")
    try:
        return Text(name, content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        before = Text(name, content[: error.start].decode("utf-8-sig"))
        before.fail(
            len(before.content),
            f"byte 0x{content[error.start]:02x} is not UTF-8: save the file as UTF-8",
        )
