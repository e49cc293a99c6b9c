"""Where `watch` says what it sees: lines, JSON, or a screen."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import TracebackType
from typing import Protocol, Self

from mavframecheck.cli.output import echo, page_context
from mavframecheck.engine.live.watched import Watched
from mavframecheck.model.live import Change, Event
from mavframecheck.report import Checked
from mavframecheck.report.jsonl import render as render_jsonl
from mavframecheck.report.layout import Page
from mavframecheck.report.live import json_line, plain_lines
from mavframecheck.report.text import render as render_text


class Output(Protocol):
    """Is told what happens; a context manager around the watch."""

    def say(self, said: Sequence[Change | Event]) -> None:
        """Take changes of findings and events."""

    def show(self, watched: Sequence[Watched], now: float) -> None:
        """Take how the links do; called with every tick."""

    def end(self, results: Sequence[Checked]) -> None:
        """Take the reports of the whole watch."""

    def __enter__(self) -> Self:
        """Begin."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End."""


class Lines:
    """Lines for people, and the report of `check` at the end."""

    def __init__(self) -> None:
        self._page = Page(page_context())
        self._links: set[str] = set()

    def say(self, said: Sequence[Change | Event]) -> None:
        """Write what is new."""
        self._links.update(each.link for each in said)
        for each in said:
            lines = plain_lines(each, self._page, links=len(self._links) > 1)
            echo(f"{line}\n" for line in lines)

    def show(self, watched: Sequence[Watched], now: float) -> None:
        """Write nothing: quiet when all is well."""

    def end(self, results: Sequence[Checked]) -> None:
        """Write what `check` would."""
        echo(["\n", *render_text(results, self._page.context)])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        sys.stdout.flush()


class JsonLines(Lines):
    """One JSON object a line: changes and events as they come, then the lines of `check`."""

    def say(self, said: Sequence[Change | Event]) -> None:
        """Write what is new."""
        echo(json_line(each) for each in said)
        if said:
            sys.stdout.flush()

    def end(self, results: Sequence[Checked]) -> None:
        """Write findings and files as `check --format jsonl` does."""
        echo(render_jsonl(results, self._page.context))


def output_for(form: str) -> Output:
    """Return the output for a format: ``text`` is a screen where a person watches one."""
    if form == "jsonl":
        return JsonLines()
    return Lines()
