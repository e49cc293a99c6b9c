"""The loop behind `watch`: every tenth of a second what came is recorded, judged and said."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import click

from mavframecheck.cli.output import complain
from mavframecheck.cli.outputs import Output, output_for
from mavframecheck.engine import Pack, RuleFileError, Settings
from mavframecheck.engine.contract import read_contract
from mavframecheck.engine.live.notify import Notifier
from mavframecheck.engine.live.session import Session
from mavframecheck.engine.live.watched import Watched
from mavframecheck.model import Severity
from mavframecheck.model.contract import Deviation
from mavframecheck.model.live import Change, Event
from mavframecheck.report import Checked
from mavframecheck.report.escape import sentence
from mavframecheck.sources import SourceError
from mavframecheck.sources.links.clock import Clock
from mavframecheck.sources.links.line import FileLine, Line, LinkLine
from mavframecheck.sources.links.link import Inbox, Link
from mavframecheck.sources.links.recorder import Recorder
from mavframecheck.wire import Dialect, DialectError, load_dialect

CLEAN, FINDINGS, FAILED, NOTHING = 0, 1, 2, 3
TICK_S = 0.1
REST_S = 0.005
"""At least so long (s) the threads that read links have the interpreter to themselves."""


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """What to watch, for how long, and what becomes of it."""

    links: tuple[str, ...]
    files: tuple[Path, ...] = ()
    relay: str | None = None
    record: Path | None = None
    length_s: float | None = None
    exit_on: Severity | None = None
    expect: Path | None = None
    notify: str | None = None
    fail_on: Severity = Severity.WARNING


def watched(wishes: Wishes, pack: Pack, settings: Settings, *, form: str) -> int:
    """Watch as the user wishes, and return the exit code."""
    try:
        watch = Watch(wishes, pack, settings, load_dialect(settings.dialect))
        return watch.run(output_for(form))
    except (DialectError, RuleFileError) as error:
        raise click.UsageError(sentence(str(error))) from error
    except SourceError as error:
        complain(sentence(str(error)))
        return FAILED


class _Signals:
    """Lets Ctrl-C and SIGTERM end the watch between two batches, never within one; a second one at once."""

    def __init__(self) -> None:
        self.ended = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._end)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _end(self, _signal: int, _frame: object) -> None:
        if self.ended:
            raise KeyboardInterrupt
        self.ended = True


class Watch:
    """Some links under watch until the time is over, a finding ends it, or the user does."""

    def __init__(self, wishes: Wishes, pack: Pack, settings: Settings, dialect: Dialect) -> None:
        """Make ready to watch; SourceError when a link is none or a file cannot be used."""
        self._wishes = wishes
        self.clock = Clock()
        links = [LinkLine(link, wishes.relay, dialect, self.clock) for link in wishes.links]
        lines: list[Line] = [*links, *map(FileLine, wishes.files)]
        self._records = _recordings(wishes.record, len(lines))
        files = [str(path or line.name) for line, path in zip(lines, self._records)]
        self.watched = [
            Watched(line, Session(line.name, file, pack, settings, dialect), self.now())
            for line, file in zip(lines, files)
        ]
        self._dialect = dialect
        self._contract = None if wishes.expect is None else read_contract(wishes.expect)
        self._station = (
            None if wishes.notify is None else Link(wishes.notify, Inbox(self.clock, room=0))
        )
        self._notifier = None if self._station is None else Notifier(self._station.send, dialect)
        self._stopped_by_finding = False

    def now(self) -> float:
        """Return the time, s since 1970."""
        return self.clock.now_us() * 1e-6

    def run(self, output: Output) -> int:
        """Watch until the end, telling `output`; return the exit code."""
        self.start(meaning=output.wants_meaning)
        with _Signals() as signals:
            with output:
                self._watch(output, signals)
            return self._end(output)

    def start(self, *, meaning: bool) -> None:
        """Open links and files; `meaning`: find out what every stream means, as a contract needs it too.

        Raises SourceError when a port cannot be had or a file cannot be made.
        """
        for each in self.watched:
            if meaning or self._contract is not None:
                each.learn_meaning(self._dialect, self._contract)
            each.line.start()
        if self._station is not None:
            self._station.start()
        for each, path in zip(self.watched, self._records):
            if path is not None:
                each.record(Recorder(path))

    def _watch(self, output: Output, signals: _Signals) -> None:
        """Go from batch to batch until the end."""
        began = time.monotonic()
        length_s = math.inf if self._wishes.length_s is None else self._wishes.length_s
        while not (self._stopped_by_finding or signals.ended):
            tick = time.monotonic()
            if tick - began >= length_s:
                return
            self.tick(output)
            time.sleep(max(REST_S, TICK_S - (time.monotonic() - tick)))

    def tick(self, output: Output) -> None:
        """Take in what came on every link, and tell."""
        now = self.now()
        jump_s = self.clock.jump_s()
        if jump_s is not None:
            text = f"the clock of this computer was set by {jump_s:+.1f} s; stamps go on as before"
            self.watched[0].pulse.say("clock", now, text)
        for each in self.watched:
            said = each.tick(now)
            output.say(said)
            self._note(said)
            if self._notifier is not None:
                self._notifier.tell((e for e in said if isinstance(e, Change)), now)
        output.show(self.watched, now)
        for each in self.watched:
            each.session.ask()

    def _note(self, said: Iterable[Change | Event]) -> None:
        """Stop when a finding is bad enough."""
        exit_on = self._wishes.exit_on
        if exit_on is not None:
            self._stopped_by_finding |= any(
                isinstance(each, Change)
                and each.what in ("found", "worse")
                and each.finding.severity.rank >= exit_on.rank
                for each in said
            )

    def _end(self, output: Output) -> int:
        now = self.now()
        if self._station is not None:
            self._station.close()
        results, failed = [], False
        for each in self.watched:
            said, report, findings = each.finish(now)
            output.say(said)
            results.append(Checked(report, findings))
            failed |= each.recording_failed
        differ = [deviation for each in self.watched for deviation in each.deviations or ()]
        output.end(results, None if self._contract is None else differ)
        return FAILED if failed else self._verdict(results, differ)

    def _verdict(self, results: Sequence[Checked], differ: Sequence[Deviation]) -> int:
        if self._stopped_by_finding:
            return FINDINGS
        if not any(each.file.messages for each in results):
            return NOTHING
        if any(each.what != "unexpected" for each in differ):
            return FINDINGS
        worst = max((f.severity.rank for each in results for f in each.findings), default=-1)
        return FINDINGS if worst >= self._wishes.fail_on.rank else CLEAN


def _recordings(path: Path | None, count: int) -> list[Path | None]:
    """Return the file to record each of `count` links to: several get a number each."""
    if path is None or count == 1:
        return [path] * count
    return [path.with_stem(f"{path.stem}-{number}") for number in range(1, count + 1)]
