"""From a path to a report: read, judge, sum up."""

from __future__ import annotations

from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.pack import chosen_rules
from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.engine.runner import Runner
from mavframecheck.engine.settings import Settings
from mavframecheck.model import FileReport, Finding
from mavframecheck.sources import Recording, open_recording
from mavframecheck.wire import Dialect, load_dialect


def check_file(
    path: str, pack: Pack, settings: Settings, progress: Progress | None = None
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge the recording at `path` (``-``: standard input).

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` or `RuleFileError` when dialect or rules cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    with open_recording(path, settings.input_kind) as recording:
        return check_recording(recording, pack, settings, dialect, progress)


def check_recording(
    recording: Recording,
    pack: Pack,
    settings: Settings,
    dialect: Dialect,
    progress: Progress | None = None,
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge an open recording."""
    reading = Reading(recording, settings, dialect)
    runner = Runner(recording.name, chosen_rules(pack, settings), reading.context, dialect)
    for batch in reading.batches(progress):
        runner.update(batch)
    return summed_up(reading, runner)


def summed_up(reading: Reading, runner: Runner) -> tuple[FileReport, tuple[Finding, ...]]:
    """Return the report and the findings of a recording that is read to its end."""
    findings, runs = runner.finish()
    report = FileReport(
        **reading.summary(),
        vehicles=reading.vehicles(),
        damage=tuple(reading.damage),
        damage_total=reading.damage_total,
        runs=tuple(runs),
    )
    return report, tuple(findings)
