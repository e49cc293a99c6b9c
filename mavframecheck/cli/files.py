"""Reading several files, one after the other: one that cannot be read does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from typing import Any, Generic, TypeVar

import click

from mavframecheck.cli.group import INTERRUPTED
from mavframecheck.cli.interrupts import Interrupts
from mavframecheck.cli.output import complain
from mavframecheck.cli.progress import Progress
from mavframecheck.engine.memory import keep_freed_memory
from mavframecheck.report import Remark
from mavframecheck.report.escape import sentence
from mavframecheck.report.words import plural
from mavframecheck.sources import NoRecordingError, SourceError, expand
from mavframecheck.wire import DialectError

DONE, FAILED, NOTHING = 0, 2, 3

Result = TypeVar("Result")
Advance = Callable[[int], None]
Read = Callable[[str, Advance | None], tuple[Result, int]]
"""Reads one file; returns what is to be shown, and how many frames could be decoded."""


class Files(Generic[Result]):
    """The files of one command, what reads each, and what is needed to choose its exit code."""

    usage_errors: tuple[type[Exception], ...] = (DialectError,)
    """What no file is to blame for."""

    def __init__(self, paths: Sequence[str], read: Read[Result], *, missions: bool = False) -> None:
        """Read what `paths` stand for; with `missions` also the mission files in directories."""
        self._paths = paths
        self._read = read
        self._missions = missions
        self._unreadable = 0
        self._refused = 0
        self._frames = 0
        self._interrupted = False
        self.remarks: list[Remark] = []
        """Files that could not be read, and why."""

    def results(self) -> Iterator[Result]:
        """Yield what each file gives; Ctrl-C ends the list, and what is done is shown."""
        keep_freed_memory()
        with Interrupts() as interrupts, closing(self.outcomes(self._files())) as outcomes:
            while True:
                try:
                    with interrupts.reading():
                        read = next(outcomes, None)
                except KeyboardInterrupt:
                    self.stopped()
                    return
                if read is None:
                    return
                yield from self._one(*read)

    def stopped(self) -> None:
        """Take note that Ctrl-C ended the run before its last file."""
        self._interrupted = True
        complain("interrupted: what follows is not all")

    def outcomes(self, files: Sequence[str]) -> Generator[tuple[str, Any]]:
        """Yield each path with what `read` returns of it, or with the exception that it raises."""
        progress = Progress(len(files))
        for path in files:
            with progress.of(path) as advance:
                outcome = attempt(self._read, path, advance)
            yield path, outcome

    def exit_code(self) -> int:
        """Return the exit code once the results are used up."""
        if self._interrupted:
            return INTERRUPTED
        if self._unreadable or (self._refused and self._frames):
            return FAILED
        return DONE if self._frames else NOTHING

    def _files(self) -> list[str]:
        """Return every recording once, in the order given."""
        files: dict[str, None] = {}
        for path in self._paths:
            try:
                found = expand([path])
            except (SourceError, OSError) as error:
                self._fail(path, error)
                continue
            wanted = [*found.recordings, *(found.missions if self._missions else ())]
            if found.missions and not self._missions:
                skipped = plural(len(found.missions), "mission file")
                complain(f"{sentence(path)}: {skipped} skipped: 'mavframecheck check' judges them")
            if not wanted:
                sought = "recording or mission" if self._missions else "recording"
                complain(f"{sentence(path)}: no {sought} in this directory")
            files.update((str(each), None) for each in wanted)
        return list(files)

    def _one(self, path: str, outcome: Any) -> Iterator[Result]:
        if isinstance(outcome, self.usage_errors):
            raise click.UsageError(sentence(str(outcome))) from outcome
        if isinstance(outcome, SourceError | OSError):
            self._fail(path, outcome)
        elif isinstance(outcome, Exception):
            raise outcome
        else:
            result, frames = outcome
            self._frames += frames
            yield result

    def _fail(self, path: str, error: SourceError | OSError) -> None:
        """Say which file cannot be read and why; the message may name it already."""
        if isinstance(error, NoRecordingError):
            self._refused += 1
        else:
            self._unreadable += 1
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        self.remarks.append(Remark(reason, path))
        complain(sentence(reason if path in reason else f"{path}: {reason}"))


def attempt(read: Read[Any], path: str, advance: Advance | None) -> Any:
    """Return what `read` returns, or the exception that it raises."""
    try:
        return read(path, advance)
    except Exception as error:  # noqa: BLE001  (the one who asked for it decides)
        return error
