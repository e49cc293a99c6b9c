"""Lines of a page: wrapped to its width, coloured only where a terminal will show it."""

from __future__ import annotations

import textwrap
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

import click

from mavframecheck.model import Severity
from mavframecheck.report import Context
from mavframecheck.report.escape import sentence

SEVERITY_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.INFO: "cyan"}


Found = TypeVar("Found")


class Page:
    """Writes lines for one context. Whatever is wrapped is made safe for a terminal on the way."""

    def __init__(self, context: Context) -> None:
        self.context = context

    def wrap(
        self, text: str, first: str = "", rest: str | None = None, style: str = ""
    ) -> Iterator[str]:
        """Yield `text` in lines; `first` and `rest` are what they start with."""
        lines = textwrap.wrap(
            sentence(text),
            self.context.width,
            initial_indent=first,
            subsequent_indent=first if rest is None else rest,
            break_on_hyphens=False,
        )
        for line in lines:
            yield self.dim(line) if style == "dim" else line

    def paragraphs(self, text: str, indent: str) -> Iterator[str]:
        """Yield paragraphs of `text` (parted by empty lines), each wrapped."""
        for number, paragraph in enumerate(text.strip().split("\n\n")):
            if number:
                yield ""
            yield from self.wrap(paragraph, indent)

    def labelled(self, label: str, value: str, column: int) -> Iterator[str]:
        """Yield a label and its value, which keeps to its own column if the label leaves it."""
        start, indent = f"    {label:{column}}", " " * (column + 4)
        if len(start) > len(indent):
            yield from self.wrap(label, "    ", style="dim")
            start = indent
        first, *rest = [*self.wrap(value, start, indent)] or [start.rstrip()]
        yield first.replace(label, self.dim(label), 1)
        yield from rest

    def bold(self, text: str) -> str:
        """Return `text` in bold where colours are shown."""
        return click.style(text, bold=True) if self.context.colour else text

    def dim(self, text: str) -> str:
        """Return `text` faint where colours are shown."""
        return click.style(text, dim=True) if self.context.colour and text else text

    def paint(self, text: str, colour: str) -> str:
        """Return `text` in bold `colour` where colours are shown."""
        return click.style(text, fg=colour, bold=True) if self.context.colour else text


class FilePage(Page, ABC, Generic[Found]):
    """Shows what was found in recordings, one below the other."""

    @abstractmethod
    def file(self, found: Found) -> Iterator[str]:
        """Yield the lines about one recording."""

    def render(self, files: Iterable[Found]) -> Iterator[str]:
        """Yield each recording as it is read."""
        for number, found in enumerate(files):
            lines = [*([""] if number else []), *self.file(found)]
            yield "".join(f"{line}\n" for line in lines)
