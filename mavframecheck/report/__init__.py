"""What a person or a machine is shown: one file a format behind one small interface.

A format is a module with a function ``render(results, context)``. It takes the judged files one by
one, as they are finished, and yields pieces of output: ``str`` for people, ``bytes`` (UTF-8) for
machines. A format that needs everything before it can write (a JSON document) collects; a format
that does not (text, jsonl) yields as it goes. A new format is a new file and a line in `FORMATS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from typing import NamedTuple, TypeAlias, cast

from mavframecheck.model import FileReport, Finding, Rule


class Checked(NamedTuple):
    """One file, judged."""

    file: FileReport
    findings: tuple[Finding, ...]


FILE_WIDTH = 80
"""Columns of text in a file or a pipe."""


class Context(NamedTuple):
    """What a format may want to know beside the results."""

    version: str
    """Version of mavframecheck."""
    rules: tuple[Rule, ...] = ()
    """The rules that were at hand, for formats that describe them."""
    width: int = FILE_WIDTH
    """Columns to write for."""
    terminal: bool = False
    """Whether a person is watching: text for a pipe keeps its last line in one piece."""
    colour: bool = False
    verbose: bool = False

    def for_a_file(self) -> Context:
        """Return the context for a report that nobody watches being written."""
        return self._replace(width=FILE_WIDTH, terminal=False, colour=False)


Piece: TypeAlias = str | bytes
Format: TypeAlias = Callable[[Iterable[Checked], Context], Iterator[Piece]]

FORMATS = {
    "text": "mavframecheck.report.text",
    "json": "mavframecheck.report.json",
    "jsonl": "mavframecheck.report.jsonl",
}
"""Name of each format and the module that writes it, imported when asked for."""


def load(name: str) -> Format:
    """Return the `render` of the format called `name`."""
    return cast("Format", import_module(FORMATS[name]).render)
