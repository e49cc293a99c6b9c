"""How commands write: to terminals, pipes that close early, and streams that lack characters."""

from __future__ import annotations

import io
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from typing import NoReturn

import click

from mavframecheck import __version__
from mavframecheck.report import Context, Piece

CLOSED_PIPE = 141
"""Exit code when the reader went away: what a process killed by SIGPIPE leaves (128 + 13)."""
_WIDEST = 100
"""Columns at most: longer lines are hard to read."""


def page_context(*, verbose: bool = False) -> Context:
    """Return the context for whoever reads standard output."""
    terminal = sys.stdout.isatty()
    plain = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"
    return Context(
        version=__version__,
        width=min(shutil.get_terminal_size().columns, _WIDEST) if terminal else 80,
        terminal=terminal,
        colour=terminal and not plain,
        verbose=verbose,
    )


def lines(texts: Iterable[str]) -> Iterator[str]:
    """Yield `texts` with line ends."""
    for text in texts:
        yield f"{text}\n"


def echo(pieces: Iterable[Piece]) -> None:
    """Write pieces as they come; when the reader goes away, leave quietly."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    for piece in pieces:
        try:
            click.echo(piece, nl=False)
        except BrokenPipeError:
            _leave(CLOSED_PIPE)
        except OSError as error:
            complain(f"cannot write the report: {error.strerror}")
            _leave(2)


def _leave(code: int) -> NoReturn:
    """Exit; Python flushes standard output once more on its way out, and would complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    raise click.exceptions.Exit(code)


def complain(message: str) -> None:
    """Write a line to standard error."""
    click.echo(f"mavframecheck: {message}", err=True)
