"""Judging several files: one that cannot be read does not stop the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import click

from mavframecheck import engine
from mavframecheck.cli.output import complain
from mavframecheck.cli.progress import Progress
from mavframecheck.model import Severity
from mavframecheck.report import Checked
from mavframecheck.report.escape import sentence
from mavframecheck.report.words import plural
from mavframecheck.sources import NoRecordingError, SourceError, expand
from mavframecheck.wire import DialectError

CLEAN, FINDINGS, FAILED, NOTHING, INTERRUPTED = 0, 1, 2, 3, 130


class Audit:
    """The files of one command, and what is needed to choose its exit code."""

    def __init__(self, paths: Sequence[str], pack: engine.Pack, settings: engine.Settings) -> None:
        self._paths = paths
        self._pack = pack
        self._settings = settings
        self._unreadable = 0
        self._refused = 0
        self._frames = 0
        self._worst = -1
        self._interrupted = False

    def results(self) -> Iterator[Checked]:
        """Yield each file as it is judged; Ctrl-C ends the list, and what is done is reported."""
        files = self._files()
        progress = Progress(len(files))
        try:
            for path in files:
                yield from self._check(path, progress)
        except KeyboardInterrupt:
            self._interrupted = True
            complain("interrupted: what follows is not all")

    def exit_code(self, fail_on: Severity) -> int:
        """Return the exit code once the results are used up."""
        if self._interrupted:
            return INTERRUPTED
        if self._unreadable or (self._refused and self._frames):
            return FAILED
        if not self._frames:
            return NOTHING
        return FINDINGS if self._worst >= fail_on.rank else CLEAN

    def _files(self) -> list[str]:
        """Return every file once, in the order given."""
        files: dict[str, None] = {}
        for path in self._paths:
            try:
                found = expand([path])
            except (SourceError, OSError) as error:
                self._fail(path, error)
                continue
            if found.missions:
                complain(
                    f"{sentence(path)}: {plural(len(found.missions), 'mission')} skipped: not read yet"
                )
            if not found.recordings:
                complain(f"{sentence(path)}: no recording in this directory")
            files.update((str(each), None) for each in found.recordings)
        return list(files)

    def _check(self, path: str, progress: Progress) -> Iterator[Checked]:
        try:
            with progress.of(path) as advance:
                checked = Checked(*engine.check_file(path, self._pack, self._settings, advance))
        except (engine.SettingsError, engine.RuleFileError, DialectError) as error:
            raise click.UsageError(sentence(str(error))) from error
        except (SourceError, OSError) as error:
            self._fail(path, error)
            return
        self._frames += checked.file.messages
        self._worst = max([self._worst, *(each.severity.rank for each in checked.findings)])
        yield checked

    def _fail(self, path: str, error: SourceError | OSError) -> None:
        """Say which file cannot be read and why; the message may name it already."""
        if isinstance(error, NoRecordingError):
            self._refused += 1
        else:
            self._unreadable += 1
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        complain(sentence(reason if path in reason else f"{path}: {reason}"))
