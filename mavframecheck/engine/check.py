"""From a path to a report: read, judge, sum up."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from mavframecheck.checks.missions.plans import Plans
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.pack import chosen_rules
from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.engine.runner import Onlooker, Runner
from mavframecheck.engine.settings import Settings
from mavframecheck.missions import read_mission, uncollected
from mavframecheck.missions.upload import ITEM, Upload
from mavframecheck.model import FileReport, Finding, RuleRun, Vehicle
from mavframecheck.semantics.names import family, type_name
from mavframecheck.sources import (
    MISSIONS,
    RECORDINGS,
    NoRecordingError,
    Recording,
    SourceError,
    open_recording,
)
from mavframecheck.vehicle import Context
from mavframecheck.wire import Dialect, load_dialect

if TYPE_CHECKING:
    from mavframecheck.geo.terrain import Ground
    from mavframecheck.model.trace import Detail


def check_file(
    path: str, pack: Pack, settings: Settings, progress: Progress | None = None
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge the recording or mission file at `path` (``-``: standard input).

    `progress` is told how many bytes were read so far. Raises `SourceError` when the file cannot
    be read, `DialectError` or `RuleFileError` when dialect or rules cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    with open_recording(path, settings.input_kind, RECORDINGS | MISSIONS) as recording:
        if recording.kind in MISSIONS:
            return check_mission(recording, pack, settings, dialect)
        return check_recording(recording, pack, settings, dialect, progress)


def check_recording(
    recording: Recording,
    pack: Pack,
    settings: Settings,
    dialect: Dialect,
    progress: Progress | None = None,
    ground: Ground | None = None,
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge an open recording, over `ground` where no terrain model is among the settings."""
    return summed_up(*_judged(recording, pack, settings, dialect, progress, ground=ground))


def draw_file(
    path: str, pack: Pack, settings: Settings, progress: Progress | None = None
) -> tuple[FileReport, tuple[Finding, ...], Detail | None]:
    """Judge like `check_file`, and keep what a report that draws shows besides; of a mission file, nothing."""
    dialect = load_dialect(settings.dialect)
    with open_recording(path, settings.input_kind, RECORDINGS | MISSIONS) as recording:
        if recording.kind in MISSIONS:
            return *check_mission(recording, pack, settings, dialect), None
        return draw_recording(recording, pack, settings, dialect, progress)


def draw_recording(
    recording: Recording,
    pack: Pack,
    settings: Settings,
    dialect: Dialect,
    progress: Progress | None = None,
) -> tuple[FileReport, tuple[Finding, ...], Detail]:
    """Judge an open recording, and keep what a report that draws shows besides."""
    from mavframecheck.engine.detail import Gatherer

    gatherer = Gatherer(recording)
    reading, runner = _judged(recording, pack, settings, dialect, progress, gatherer)
    report, findings = summed_up(reading, runner)
    detail = gatherer.detail(reading, findings, runner.figures(), settings, dialect)
    return report, findings, detail


def _judged(
    recording: Recording,
    pack: Pack,
    settings: Settings,
    dialect: Dialect,
    progress: Progress | None,
    onlooker: Onlooker | None = None,
    ground: Ground | None = None,
) -> tuple[Reading, Runner]:
    """Read and judge a recording to its end."""
    reading = Reading(recording, settings, dialect)
    if settings.plan is not None:
        Plans.of(reading.context).intend(_upload_of(settings.plan, settings, dialect).batch)
    reading.remarks += _given_ground(reading.context, settings, ground)
    rules = chosen_rules(pack, settings)
    runner = Runner(
        recording.name,
        rules,
        reading.context,
        dialect,
        only=settings.sender,
        onlooker=onlooker,
    )
    deque(map(runner.update, reading.batches(progress)), maxlen=0)  # no batch outlives its turn
    return reading, runner


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


@uncollected()
def check_mission(
    file: Recording,
    pack: Pack,
    settings: Settings,
    dialect: Dialect,
    ground: Ground | None = None,
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge an open mission file with the rules that can be about mission items, over `ground` as above."""
    planned = read_mission(file)
    upload = Upload(planned, dialect, settings.autopilot)
    chosen = chosen_rules(pack, settings)
    rules = [rule for rule in chosen if rule.may_judge(ITEM)]
    context = Context()
    notes = [*planned.notes, *_given_ground(context, settings, ground)]
    runner = Runner(file.name, rules, context, dialect, upload=upload)
    runner.update(upload.batch)
    findings, runs = runner.finish()
    reason = "a mission file holds nothing that the rule is about"
    idle = [
        RuleRun(code=rule.rule.code, status="not-applicable", reason=reason)
        for rule in chosen
        if rule not in rules
    ]
    report = FileReport(
        path=file.name,
        kind=str(file.kind),
        messages=len(upload),
        unknown=0,
        bad_crc=0,
        skipped_bytes=0,
        duration_s=None,
        time_start=None,
        notes=tuple(notes),
        vehicles=_vehicles(upload),
        damage=(),
        damage_total=0,
        runs=tuple(sorted((*runs, *idle), key=lambda run: run.code)),
    )
    return report, tuple(findings)


def _upload_of(path: str, settings: Settings, dialect: Dialect) -> Upload:
    """Return the batch of the mission file at `path`; SourceError when it is none."""
    try:
        with open_recording(path, None, MISSIONS) as file:
            return Upload(read_mission(file), dialect, settings.autopilot)
    except NoRecordingError as error:  # what is asked for is a setting, not a file to judge
        raise SourceError(f"--plan: {error}") from error


def _given_ground(context: Context, settings: Settings, ground: Ground | None) -> list[str]:
    """Let the rules about missions know how high the ground lies; return what to say of the terrain model."""
    if settings.dem is None:
        Plans.of(context).ground = ground
        return []
    from mavframecheck.geo.terrain import Terrain

    terrain = Plans.of(context).ground = Terrain(settings.dem)
    return [terrain.note]


def _vehicles(upload: Upload) -> tuple[Vehicle, ...]:
    """Return the vehicle that a mission is for, where that is known."""
    if upload.told is None:
        return ()
    autopilot, vehicle_type = upload.told
    named = None if vehicle_type is None else type_name(vehicle_type)
    found = family(autopilot, vehicle_type or 0)
    return (Vehicle(sysid=1, compid=1, role="autopilot", autopilot=found, type=named),)
