"""A progress bar on standard error, when somebody watches and the work is long."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from mavframecheck.report.escape import sentence

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

Result = TypeVar("Result")
PATIENCE_S = 1.0
"""Work that ends sooner shows no bar, and never pays for importing one."""


class Progress:
    """Counts files; each gets its own bar, gone before its findings are written."""

    def __init__(self, files: int) -> None:
        self._files = files
        self._number = 0
        self._started = time.monotonic()

    @contextmanager
    def of(self, path: str) -> Iterator[Callable[[int], None] | None]:
        """Give the function to call with the bytes read so far; None when nobody watches."""
        self._number += 1
        if not sys.stderr.isatty():
            yield None
            return
        bar: Bar | None = None

        def advance(read: int) -> None:
            nonlocal bar
            if bar is None and time.monotonic() - self._started > PATIENCE_S:
                bar = _bar(self._title(path), _size(path))
            if bar is not None:
                bar.update(bar.task_ids[0], completed=read)

        try:
            yield advance
        finally:
            if bar is not None:
                bar.stop()

    def together(
        self, results: Generator[tuple[str, Result]], paths: Sequence[str]
    ) -> Generator[tuple[str, Result]]:
        """Yield `results` of files that are judged at the same time: one bar for all of them.

        It is gone while a result is out: what is written then may go to the same terminal.
        """
        with closing(results):
            if not sys.stderr.isatty():
                yield from results
                return
            sizes = {path: _size(path) or 0 for path in paths}
            bar = _bar(f"0/{self._files}", sum(sizes.values()))
            try:
                for path, result in results:
                    self._number += 1
                    bar.stop()
                    yield path, result
                    title = f"{self._number}/{self._files}"
                    bar.update(bar.task_ids[0], advance=sizes[path], description=title)
                    bar.start()
            finally:
                bar.stop()

    def _title(self, path: str) -> str:
        number = f"{self._number}/{self._files} " if self._files > 1 else ""
        return f"{number}{sentence(Path(path).name)}"


def _bar(title: str, size: int | None) -> Bar:
    """Start a bar that disappears when stopped."""
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        DownloadColumn(),
        TransferSpeedColumn(),
    )
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task(title, total=size)
    bar.start()
    return bar


def _size(path: str) -> int | None:
    """Return the bytes of a file; None for what has no size, such as standard input."""
    return Path(path).stat().st_size if Path(path).is_file() else None
