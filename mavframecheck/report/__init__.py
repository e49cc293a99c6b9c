"""What a person or a machine is shown: one file a format behind one small interface.

A format is a module with a function ``render(results, context)``. It takes the judged files one by
one, as they are finished, and yields pieces of output: ``str`` for people, ``bytes`` (UTF-8) for
machines. A format that needs everything before it can write (a JSON document) collects; a format
that does not (text, jsonl) yields as it goes. A new format is a new file and a line in `FORMATS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, cast

from mavframecheck.model import FileReport, Finding, Rule, Severity, Suppressed

if TYPE_CHECKING:
    from mavframecheck.model.trace import Detail


class Checked(NamedTuple):
    """One file, judged."""

    file: FileReport
    findings: tuple[Finding, ...]
    suppressed: tuple[Suppressed, ...] = ()
    """Findings that the user knows of and has set aside; they do not count."""
    detail: Detail | None = None
    """Curves, tracks and bytes; there only where a format draws."""


class Remark(NamedTuple):
    """What there is to say about a run beside its findings."""

    text: str
    path: str | None = None
    """The file that could not be read; None when it is about a setting."""


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
    fail_on: Severity = Severity.WARNING
    """How bad a finding must be to count as a failure."""
    remarks: Sequence[Remark] = ()
    """Grows while results are used up, and is complete after the last one."""

    def for_a_file(self) -> Context:
        """Return the context for a report that nobody watches being written."""
        return self._replace(width=FILE_WIDTH, terminal=False, colour=False)


Piece: TypeAlias = str | bytes
Format: TypeAlias = Callable[[Iterable[Checked], Context], Iterator[Piece]]

FORMATS = {
    "text": "mavframecheck.report.text",
    "json": "mavframecheck.report.json",
    "jsonl": "mavframecheck.report.jsonl",
    "concise": "mavframecheck.report.concise",
    "sarif": "mavframecheck.report.sarif",
    "junit": "mavframecheck.report.junit",
    "github": "mavframecheck.report.github",
    "gitlab": "mavframecheck.report.gitlab",
    "statistics": "mavframecheck.report.statistics",
    "html": "mavframecheck.report.html",
}
"""Name of each format and the module that writes it, imported when asked for."""
DRAWN = frozenset({"html"})
"""Formats that draw: what they show is only kept for them."""


def load(name: str) -> Format:
    """Return the `render` of the format called `name`."""
    return cast("Format", import_module(FORMATS[name]).render)
