"""Where `watch` says what it sees: lines, JSON, or a screen."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Sequence
from types import TracebackType
from typing import Protocol, Self

from mavframecheck.cli.output import echo, page_context
from mavframecheck.engine.live.view import Eye
from mavframecheck.engine.live.watched import Watched
from mavframecheck.model.contract import Deviation
from mavframecheck.model.live import Change, Event
from mavframecheck.report import Checked
from mavframecheck.report.contract import contract_lines
from mavframecheck.report.jsonl import line
from mavframecheck.report.jsonl import render as render_jsonl
from mavframecheck.report.layout import Page
from mavframecheck.report.live import json_line, plain_lines
from mavframecheck.report.screen import screen
from mavframecheck.report.text import render as render_text

SHOW_S = 0.5
"""The screen is drawn this often (s), and when something happens."""
MOST_SAID = 200


class Output(Protocol):
    """Is told what happens; a context manager around the watch."""

    wants_meaning: bool
    """Whether it shows what every stream means."""

    def say(self, said: Sequence[Change | Event]) -> None:
        """Take changes of findings and events."""

    def show(self, watched: Sequence[Watched], now: float) -> None:
        """Take how the links do; called with every tick."""

    def end(self, results: Sequence[Checked], differ: Sequence[Deviation] | None) -> None:
        """Take the reports of the whole watch, and how it differs from the contract, if there is one."""

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

    wants_meaning = False

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

    def end(self, results: Sequence[Checked], differ: Sequence[Deviation] | None) -> None:
        """Write what `check` would, and what is not as agreed."""
        echo(["\n", *render_text(results, self._page.context)])
        if differ is not None:
            echo(f"{line}\n" for line in contract_lines(differ, self._page))

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

    def end(self, results: Sequence[Checked], differ: Sequence[Deviation] | None) -> None:
        """Write what is not as agreed, then findings and files as `check --format jsonl` does."""
        echo(line("deviation", each) for each in differ or ())
        echo(render_jsonl(results, self._page.context))


class Screen(Lines):
    """The screen: what is known of every link, twice a second."""

    wants_meaning = True

    def __init__(self) -> None:
        from rich.console import Console
        from rich.live import Live

        super().__init__()
        self._console = Console()
        self._live = Live(console=self._console, screen=True, auto_refresh=False)
        self._eyes: dict[str, Eye] = {}
        self._log: deque[Change | Event] = deque(maxlen=MOST_SAID)
        self._next = 0.0

    def say(self, said: Sequence[Change | Event]) -> None:
        """Keep what happened, and show it at once."""
        self._log += said
        if any(isinstance(each, Event) or each.what == "found" for each in said):
            self._next = 0.0

    def show(self, watched: Sequence[Watched], now: float) -> None:
        """Draw the screen, when it is time."""
        if now < self._next:
            return
        self._next = now + SHOW_S
        from rich.console import Group

        views = [self._eyes.setdefault(each.line.name, Eye()).look(each, now) for each in watched]
        width, height = self._console.size
        lines = screen(views, list(self._log), now, width, height)
        self._live.update(Group(*lines), refresh=True)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()


def output_for(form: str) -> Output:
    """Return the output for a format: ``text`` is a screen where a person watches one."""
    if form == "jsonl":
        return JsonLines()
    return Screen() if form == "text" and _is_screen() else Lines()


def _is_screen() -> bool:
    """Return whether standard output is a terminal that moves its cursor and shows what is drawn."""
    unicode = (sys.stdout.encoding or "").lower().startswith("utf")
    return sys.stdout.isatty() and unicode and os.environ.get("TERM") != "dumb"
