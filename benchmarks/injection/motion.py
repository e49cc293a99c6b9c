"""Distortions of streams of poses and velocities: written into recordings, and what `check` says of them."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.injection.distortions import Case, cases
from benchmarks.injection.excitation import Excitation, excitation, metres
from benchmarks.injection.log import AUTOPILOT, Change, Log, put
from benchmarks.injection.make import records_of
from benchmarks.injection.places import Place, moved
from benchmarks.injection.plan import Distortion, MotionPlan, read_plan
from benchmarks.injection.words import Scope, evaluate
from mavframecheck.engine import Pack, Settings, check_recording
from mavframecheck.engine.pack import read_rule, rule_files, source_folder
from mavframecheck.model import FileReport, Finding
from mavframecheck.sources import Recording
from mavframecheck.wire import Table, load_dialect

RULES = ("MFC4", "MFC5", "MFC813")
"""Beginnings of the codes that are measured, and that may not be raised by anything else."""
PIECES = ("whole", "climb", "ground")
"""A recording, its beginning until the vehicle leaves the place where it took off, and until it takes off."""
OWN = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")
EXTERNAL = (
    "VISION_POSITION_ESTIMATE",
    "GLOBAL_VISION_POSITION_ESTIMATE",
    "VICON_POSITION_ESTIMATE",
    "ATT_POS_MOCAP",
    "ODOMETRY",
    "VISION_SPEED_ESTIMATE",
    "GPS_INPUT",
)
LEAST_ROWS = 30


PARTS = ("MFC401", "MFC402", "MFC403", "MFC507")
"""Codes that say a part of where axes point: right where motion shows no more."""


class Outcome(NamedTuple):
    """How a case fared in a piece of a recording."""

    distortion: str
    case: str
    where: str
    word: str
    """See `WORDS`."""
    text: str = ""


WORDS = ("found", "words", "missed", "early", "thin", "passed", "silent", "alarm")
"""With enough motion: found, found with other words, missed. Without: found, said to be insufficient data,
passed as if all were well. Legal: silent. Anything: a code that is none of those awaited."""


@dataclass
class Motions:
    """Everything that was found out."""

    outcomes: list[Outcome] = field(default_factory=list)
    alarms: list[str] = field(default_factory=list)
    originals: int = 0

    def add(self, other: Motions) -> None:
        """Take in what another process found out."""
        self.outcomes += other.outcomes
        self.alarms += other.alarms
        self.originals += other.originals


def is_reported(name: str) -> bool:
    """Return whether a recording counts for the figures; the others are for tuning the judge.

    By a bit of the hash of its name, so that nobody chooses.
    """
    return bool(_digest(name)[0] & 1)


def _digest(name: str) -> bytes:
    return hashlib.sha256(name.encode()).digest()


def recordings(folder: Path, beginnings: tuple[str, ...]) -> list[str]:
    """Return the names of the clean recordings."""
    labels = tomllib.loads((folder / "labels.toml").read_text("utf-8"))
    names = (name for name, label in labels.items() if label["kind"] == "clean")
    return [name for name in names if name.startswith(beginnings)]


@cache
def _pack() -> Pack:
    rules = [read_rule(file) for file in rule_files(source_folder()) if file.name.startswith(RULES)]
    return Pack(tuple(rule for rule, _ in rules), {rule.code: source for rule, source in rules})


def _judged(data: bytes, sender: int | None) -> tuple[FileReport, list[Finding]]:
    """Return what the rules say of a tlog, of everybody or of one sender."""
    recording = Recording("injected.tlog", BytesIO(data), None)
    settings = Settings(sender=sender)
    report, findings = check_recording(recording, _pack(), settings, load_dialect())
    return report, list(findings)


class _Piece(NamedTuple):
    """A recording or a part of it, and what is found in it undistorted."""

    log: Log
    recording: str
    name: str
    """One of `PIECES`."""
    before: list[Finding]

    @property
    def where(self) -> str:
        """What is printed."""
        return f"{self.recording} ({self.name})"


def judge_recording(folder: Path, name: str, *, full: bool = False) -> Motions:
    """Write distortions into a recording, whole and in pieces, and judge it; all of them where `full`."""
    plan = read_plan().motion
    found = Motions()
    log = _prepared(folder, name, plan)
    if _on_several_systems(log):
        return found
    one_of = {} if full else {str(kind): some for kind, some in plan.one_of.items()}
    for name_of_piece in PIECES:
        part = _cut(log, name_of_piece)
        if part is not None:
            before = _judged(part.written({}), None)[1]
            piece = _Piece(part, name, name_of_piece, before)
            found.alarms += [f"{piece.where}: {_said(f)}" for f in before if f.severity != "info"]
            found.originals += 1
            found.outcomes += _outcomes(piece, plan.distortion, one_of)
    return found


def _prepared(folder: Path, name: str, plan: MotionPlan) -> Log:
    """Return a recording, cut, where it is flown, with an estimate from outside in it."""
    dialect = load_dialect()
    log = Log((folder / f"{name}.tlog").read_bytes(), dialect)
    log = Log(log.first(plan.seconds), dialect)
    digest = _digest(name)
    place = ("", *plan.places)[digest[1] % (len(plan.places) + 1)]
    if place and log.own("HOME_POSITION") is not None:
        spot = read_plan().place[place]
        log = Log(moved(log, Place(spot.lat, spot.lon, spot.alt)), dialect)
    if not any(_streams(log, message) for message in EXTERNAL):
        stream = plan.stream[digest[2] % len(plan.stream)]
        log = Log(log.written({}, records_of(log, stream)), dialect)
    return log


def _cut(log: Log, piece: str) -> Log | None:
    """Return a beginning of a recording, None where the vehicle was under way from the start."""
    if piece == "whole":
        return log
    globe = log.own("GLOBAL_POSITION_INT")
    if globe is None:
        return None
    globe = globe.take(globe["lat"] != 0)
    if not len(globe):
        return None
    away = np.linalg.norm(metres(globe["lat"] * 1e-7, globe["lon"] * 1e-7), axis=1)
    if piece == "ground":
        away = np.maximum(away, np.abs(globe["relative_alt"] - globe["relative_alt"][0]) * 1e-3)
    left = np.flatnonzero(away > 1.5)
    if not len(left):
        return None
    seconds = float(log.seconds[globe.frames.number[left[0]]]) - 0.5
    return Log(log.first(seconds), log.dialect) if seconds > 10 else None


def _streams(log: Log, message: str) -> list[Table]:
    """Return the rows of each sender of a message: its own, or those of others."""
    table = log.tables.get(message)
    if table is None:
        return []
    table = table.take((table.frames.compid == AUTOPILOT) == (message in OWN))
    senders = np.unique(table.frames.sender).tolist()
    streams = [table.take(table.frames.sender == sender) for sender in senders]
    return [stream for stream in streams if len(stream) >= LEAST_ROWS]


def _outcomes(
    piece: _Piece, distortions: tuple[Distortion, ...], one_of: Mapping[str, int]
) -> Iterator[Outcome]:
    """Yield how the distortions of every stream fared."""
    for message in dict.fromkeys(m for d in distortions for m in d.message):
        kind = "piece" if piece.name != "whole" else "own" if message in OWN else "whole"
        for stream in _streams(piece.log, message):
            excited = excitation(piece.log, stream)
            scope = Scope(piece.log, stream)
            for distortion in (d for d in distortions if message in d.message):
                if evaluate(distortion.where, scope, len(stream)).all():
                    some = _some(cases(distortion), piece.where + message, one_of.get(kind, 1))
                    for case in some:
                        yield from _fared(piece, stream, case, excited)


def _some(all_cases: Iterator[Case], where: str, one_of: int) -> Iterator[Case]:
    """Yield one of so many cases, chosen by a hash."""
    for case in all_cases:
        if int.from_bytes(_digest(where + case.name)[:4]) % one_of == 0:
            yield case


def _fared(piece: _Piece, stream: Table, case: Case, excited: Excitation) -> Iterator[Outcome]:
    """Yield how a case fared, and each finding that it should not have raised."""
    known = {(f.code, f.subject) for f in piece.before}
    sender = int(stream.frames.sender[0])
    report, findings = _judged(_distorted(piece.log, stream, case), sender)
    about = [f for f in findings if f.message_name == stream.name]
    enough = excited.has(case.distortion.needs, case.value)
    awaited = (*case.codes, *PARTS) if case.codes and not enough else case.codes
    answers = [f for f in about if f.code in awaited and (f.code, f.subject) not in known]
    word, text = _word(case, report, answers, excited=enough)
    expected = (*awaited, *case.distortion.also)

    outcome = Outcome(case.distortion.name, case.name, f"{piece.where} {stream.name}", word, text)
    yield outcome
    for finding in findings:
        if finding.code not in expected and (finding.code, finding.subject) not in known:
            yield outcome._replace(word="alarm", text=_said(finding))


def _word(
    case: Case, report: FileReport, answers: list[Finding], *, excited: bool
) -> tuple[str, str]:
    if not case.codes:
        return "silent", ""
    right = [f for f in answers if re.search(case.says, f.text) or not excited]
    right = [f for f in right if _agrees(f, case)]
    if answers and not right:
        return "words", f"{_said(answers[0])} [{case.says}]"
    if right:
        return ("found" if excited else "early"), ""
    runs = [run for run in report.runs if run.code in case.codes]
    why = "; ".join(f"{run.code} {run.status} {run.reason}" for run in runs)
    if excited:
        return "missed", why
    thin = any(run.status == "insufficient-data" or run.reason for run in runs)
    return ("thin" if thin else "passed"), why


def _agrees(finding: Finding, case: Case) -> bool:
    """Return whether what a finding says of the fields is what they hold."""
    said = re.findall(
        r"\b(\w+) (?:is|holds) (north|south|east|west|up|down)\b", finding.text, re.IGNORECASE
    )
    if not case.held or case.distortion.free_heading:
        return True
    return all(case.held.get(name, held).lower() == held.lower() for name, held in said)


def _said(finding: Finding) -> str:
    return f"{finding.severity} {finding.code} {finding.subject}: {finding.text}"


def _distorted(log: Log, stream: Table, case: Case) -> bytes:
    """Return the recording with the stream distorted."""
    table = log.tables[stream.name]
    sender = int(stream.frames.sender[0])
    mine = np.flatnonzero(table.frames.sender == sender)
    scope = Scope(log, stream)
    scope["k"] = case.value
    holds = evaluate(case.distortion.rows, scope, len(stream)).astype(np.bool_)
    columns = stream.columns.copy()
    for name, text in case.set.items():
        values = np.asarray(evaluate(text, scope, len(stream)), np.float64)
        keep = holds if values.ndim == 1 else holds[:, None]
        put(columns, name, np.where(keep, values, stream[name].astype(np.float64)))
    return log.written({stream.name: Change(mine, columns)})


def _on_several_systems(log: Log) -> bool:
    """Return whether more than one vehicle speaks: whose motion a stream follows is then another question."""
    return len(set(log.frames.sysid[log.frames.compid == AUTOPILOT].tolist())) > 1
