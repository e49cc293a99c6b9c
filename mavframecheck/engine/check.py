"""From a path to a report: read, judge, sum up."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.pack import chosen_rules
from mavframecheck.engine.runner import Runner
from mavframecheck.engine.settings import Settings
from mavframecheck.model import Damage, FileReport, Finding, Vehicle
from mavframecheck.semantics.names import type_name
from mavframecheck.sources import Recording, open_recording
from mavframecheck.vehicle import Context, Traffic
from mavframecheck.vehicle.roles import version_text
from mavframecheck.wire import Batch, Dialect, load_dialect, read_batches

MAX_DAMAGE = 100
"""Damaged ranges that a report lists; all are counted."""

Progress = Callable[[int], None]


class _Reading:
    """What is counted while a recording is read."""

    def __init__(self) -> None:
        self.messages = 0
        self.unknown = 0
        self.bad_crc = 0
        self.skipped = 0
        self.damage: list[Damage] = []
        self.damage_total = 0
        self._open: Damage | None = None

    def add(self, batch: Batch) -> None:
        """Count the frames of `batch`, and join damaged ranges that touch."""
        frames = batch.frames
        self.messages += int(np.count_nonzero(frames.good))
        self.unknown += int(np.count_nonzero(~frames.known))
        self.bad_crc += int(np.count_nonzero(frames.known & ~frames.crc_ok))
        for damage in batch.damage:
            self.skipped += damage.length
            last = self._open
            if last is not None and last.offset + last.length == damage.offset:
                self._open = Damage(last.offset, last.length + damage.length, last.reason)
            else:
                self.close()
                self._open = damage

    def close(self) -> None:
        """Take the last damaged range as finished."""
        if self._open is not None:
            self.damage_total += 1
            if len(self.damage) < MAX_DAMAGE:
                self.damage.append(self._open)
        self._open = None


def check_file(
    path: str, pack: Pack, settings: Settings, progress: Progress | None = None
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge the recording at `path` (``-``: standard input).

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot be
    read, `DialectError` or `RuleFileError` when dialect or rules cannot be used.
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
    context, traffic, reading = Context(settings.autopilot), Traffic(dialect), _Reading()
    runner = Runner(recording.name, chosen_rules(pack, settings), context, dialect)
    for batch in read_batches(recording.chunks(), dialect, stamped=recording.stamped):
        reading.add(batch)
        admitted = traffic.admit(batch.frames)
        if traffic.refused:
            batch.restrict(admitted)
        runner.update(batch)
        if progress is not None and len(batch):
            progress(int(batch.frames.offset[-1]))
    reading.close()
    findings, runs = runner.finish()
    notes = [*recording.notes]
    if traffic.refused:
        notes.append(
            f"{traffic.refused} frames of further senders or streams were read but not judged: "
            "more than 256 senders or 4096 streams"
        )
    report = FileReport(
        path=recording.name,
        kind=str(recording.kind),
        messages=reading.messages,
        unknown=reading.unknown,
        bad_crc=reading.bad_crc,
        skipped_bytes=reading.skipped,
        duration_s=_duration(traffic),
        time_start=traffic.t_first,
        vehicles=tuple(_vehicles(context, traffic)),
        damage=tuple(reading.damage),
        damage_total=reading.damage_total,
        notes=tuple(notes),
        runs=tuple(runs),
    )
    return report, tuple(findings)


def _duration(traffic: Traffic) -> float | None:
    if traffic.t_first is None or traffic.t_last is None:
        return None
    return traffic.t_last - traffic.t_first


def _vehicles(context: Context, traffic: Traffic) -> list[Vehicle]:
    """Return every sender, with what it said it is."""
    counts: dict[tuple[int, int], int] = {}
    for stream in traffic.streams():
        key = (stream.sysid, stream.compid)
        counts[key] = counts.get(key, 0) + stream.frames
    return [_vehicle(context, sysid, compid, count) for (sysid, compid), count in counts.items()]


def _vehicle(context: Context, sysid: int, compid: int, messages: int) -> Vehicle:
    role = context.role(sysid * 256 + compid)
    if role != "autopilot":
        return Vehicle(sysid=sysid, compid=compid, role=role, messages=messages)
    mav_type = context.last("vehicle.type", sysid)
    return Vehicle(
        sysid=sysid,
        compid=compid,
        role=role,
        autopilot=context.last("vehicle.autopilot", sysid),
        type=None if mav_type is None else type_name(int(mav_type)),
        version=version_text(context.last("vehicle.version", sysid)),
        messages=messages,
    )
