"""How commands write: to terminals, pipes that close early, and streams that lack characters."""

from __future__ import annotations

import io
import os
import shutil
import sys
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from itertools import tee
from pathlib import Path
from typing import BinaryIO, NoReturn

import click

from mavframecheck import __version__
from mavframecheck.report import DRAWN, FILE_WIDTH, FORMATS, Checked, Context, Piece, load
from mavframecheck.report.escape import sentence

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
        width=min(shutil.get_terminal_size().columns, _WIDEST) if terminal else FILE_WIDTH,
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


def parse_outputs(
    ctx: click.Context, param: click.Parameter, values: Sequence[str]
) -> list[tuple[str, Path]]:
    """Return format and path of each ``FORMAT=PATH``: the callback of ``--output``."""
    return [_output(value, ctx, param) for value in values]


def _output(value: str, ctx: click.Context, param: click.Parameter) -> tuple[str, Path]:
    form, _, path = value.partition("=")
    if not (form and path):
        message = f"'{sentence(value)}' is not FORMAT=PATH, such as json=report.json"
    elif form not in FORMATS:
        message = f"no format is called '{sentence(form)}'; there are {', '.join(FORMATS)}"
    else:
        return form, Path(path)
    raise click.BadParameter(message, ctx, param)


def deliver(
    results: Iterable[Checked],
    form: str,
    outputs: Sequence[tuple[str, Path]],
    context: Context,
) -> None:
    """Write one pass over `results` to standard output and to every file of `outputs`.

    Files are opened first: a path that cannot be written is said before an hour of reading, and a
    run that dies leaves no report of an older one. They are written even when standard output is
    closed on the way.
    """
    with ExitStack() as stack:
        files = [(each, stack.enter_context(opened(path))) for each, path in outputs]
        for drawn in (path for each, path in outputs if each in DRAWN):
            results = drawing(results, drawn, context.for_a_file(), keep=form in DRAWN)
        first, *copies = tee(results, len(files) + 1)
        closed = None
        try:
            echo(load(form)(first, context))
        except click.exceptions.Exit as left:
            closed = left
        for (each, file), copy in zip(files, copies):
            if each in DRAWN:
                deque(copy, maxlen=0)
            else:
                _write(file, load(each)(copy, context.for_a_file()))
        if closed:
            raise closed


def drawing(
    results: Iterable[Checked], path: Path, context: Context, *, keep: bool = False
) -> Iterator[Checked]:
    """Yield `results`, and write pages to `path` meanwhile.

    Unless told to `keep` it, what is drawn leaves the results there: of all recordings it is too much.
    """
    from mavframecheck.report.html import write

    try:
        for checked in write(results, path, context):
            yield checked if keep else checked._replace(detail=None)
    except OSError as error:
        complain(sentence(f"{error.filename}: cannot write the report: {error.strerror}"))
        raise click.exceptions.Exit(2) from error


def opened(path: Path) -> BinaryIO:
    """Return a file to write a report to; one that cannot be written is a usage error."""
    try:
        return path.open("wb")
    except OSError as error:
        reason = f"{path}: cannot write a report here: {error.strerror}"
        raise click.UsageError(sentence(reason)) from error


def _write(file: BinaryIO, pieces: Iterable[Piece]) -> None:
    """Write a report as UTF-8 and close it; a full disk is no clean run."""
    try:
        with file:
            file.writelines(
                each if isinstance(each, bytes) else each.encode("utf-8", "backslashreplace")
                for each in pieces
            )
    except OSError as error:
        complain(sentence(f"{file.name}: cannot write the report: {error.strerror}"))
        raise click.exceptions.Exit(2) from error


def _leave(code: int) -> NoReturn:
    """Exit; Python flushes standard output once more on its way out, and would complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    raise click.exceptions.Exit(code)


def complain(message: str) -> None:
    """Write a line to standard error."""
    click.echo(f"mavframecheck: {message}", err=True)
