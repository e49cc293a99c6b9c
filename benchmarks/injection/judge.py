"""Judging a recording as it is, and with each mistake in it."""

from __future__ import annotations

import sys
import tomllib
from dataclasses import dataclass, field
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, NamedTuple

from benchmarks.injection.log import AUTOPILOT, Log
from benchmarks.injection.make import Made, with_mistake, with_streams
from benchmarks.injection.places import Place, moved
from benchmarks.injection.plan import Mistake, Plan, read_plan
from mavframecheck.engine import Pack, RuleFileError, Settings, check_recording
from mavframecheck.engine.pack import read_rule, rule_files, source_folder
from mavframecheck.model import Finding, Rule
from mavframecheck.sources import Recording
from mavframecheck.wire import load_dialect

FAMILIES = ("MFC1", "MFC2", "MFC3", "MFC408", "MFC416", "MFC419", "MFC6", "MFC707", "MFC9")
"""Beginnings of the codes that are measured."""
LOUD = ("error", "warning")


class Outcome(NamedTuple):
    """How one mistake fared in one variant of a recording."""

    mistake: str
    variant: str
    word: Literal["found", "missed", "silent", "wrong"]
    """`silent` and `wrong`: kept quiet, or not, where nothing can be decided."""
    hits: int
    rows: int
    text: str = ""


@dataclass
class Verdicts:
    """Everything that was found out."""

    outcomes: list[Outcome] = field(default_factory=list)
    alarms: list[str] = field(default_factory=list)
    originals: int = 0

    def add(self, other: Verdicts) -> None:
        """Take in what another process found out."""
        self.outcomes += other.outcomes
        self.alarms += other.alarms
        self.originals += other.originals


@cache
def known_rules() -> tuple[tuple[Rule, str], ...]:
    """Return the rules of the working tree that are measured; one that cannot be read is no rule yet."""
    rules = []
    for file in rule_files(source_folder()):
        if file.name.startswith(FAMILIES):
            try:
                rules.append(read_rule(file))
            except RuleFileError as error:
                print(f"not a rule yet: {error}", file=sys.stderr)
    return tuple(rules)


def findings_in(data: bytes, codes: tuple[str, ...]) -> list[Finding]:
    """Return what the rules whose codes begin like `codes` find in a tlog."""
    chosen = [(rule, source) for rule, source in known_rules() if rule.code.startswith(codes)]
    pack = Pack(tuple(rule for rule, _ in chosen), {rule.code: source for rule, source in chosen})
    recording = Recording("injected.tlog", BytesIO(data), None)
    _, findings = check_recording(recording, pack, Settings(preview=True), load_dialect())
    return list(findings)


def variant_of(folder: Path, plan: Plan, name: str, place: str) -> Log:
    """Return a recording, cut, flown at `place` (empty: where it was made), with clean streams added."""
    dialect = load_dialect()
    source = next(source for source in plan.recording if source.name == name)
    log = Log((folder / f"{name}.tlog").read_bytes(), dialect)
    log = Log(log.first(source.seconds), dialect)
    if place:
        spot = plan.place[place]
        log = Log(moved(log, Place(spot.lat, spot.lon, spot.alt)), dialect)
    return Log(with_streams(log, plan.stream), dialect)


def judge_variant(
    folder: Path, variant: tuple[str, str], mistakes: list[Mistake], codes: tuple[str, ...]
) -> Verdicts:
    """Judge one recording at one place: as it is, then with each mistake."""
    name, place = variant
    plan = read_plan()
    labels = tomllib.loads((folder / "labels.toml").read_text("utf-8"))
    log = variant_of(folder, plan, name, place)
    said = f"{name} {f'at {place}' if place else 'as recorded'}"
    before = findings_in(log.written({}), codes)
    alarms = [alarm for f in before if (alarm := _alarm(f, labels[name]))]
    verdicts = Verdicts([], [f"{said}: {alarm}" for alarm in alarms], 1)
    built = {rule.code for rule, _ in known_rules()}
    for mistake in mistakes:
        if set(mistake.codes) & built:
            verdicts.outcomes += _outcomes(log, said, mistake, before)
    return verdicts


def _alarm(finding: Finding, label: dict[str, Any]) -> str:
    """Return what is printed of a false alarm, empty for anything else."""
    if finding.severity not in LOUD or finding.code in label.get("allow", ()):
        return ""
    at = f"x{finding.count}"
    return f"{finding.severity} {finding.code} {finding.subject} {at}: {finding.text}"


def _outcomes(log: Log, said: str, mistake: Mistake, before: list[Finding]) -> list[Outcome]:
    """Return how a mistake fared where the method can decide, and where it cannot."""
    outcomes = []
    if made := with_mistake(log, mistake, mistake.decides):
        hits, text = _answers(made, mistake, before)
        outcomes.append(
            Outcome(mistake.name, said, "found" if hits else "missed", hits, made.rows, text)
        )
    blind = mistake.blind or f"~({mistake.decides})"
    if mistake.decides != "True" and (made := with_mistake(log, mistake, blind)):
        hits, text = _answers(made, mistake, before)
        outcomes.append(
            Outcome(mistake.name, said, "wrong" if hits else "silent", hits, made.rows, text)
        )
    return outcomes


def _answers(made: Made, mistake: Mistake, before: list[Finding]) -> tuple[int, str]:
    """Return the hits on the message that were not there before, and the first text."""
    after = [f for f in findings_in(made.data, mistake.codes) if _is_about(f, mistake)]
    old = sum(f.count for f in before if f.code in mistake.codes and _is_about(f, mistake))
    hits = max(sum(finding.count for finding in after) - old, 0)
    return hits, after[0].text if after and hits else ""


def _is_about(finding: Finding, mistake: Mistake) -> bool:
    """Return whether a finding is about the message that holds the mistake."""
    own = finding.compid == AUTOPILOT
    by_autopilot = (mistake.about_by if mistake.about else mistake.by) == "autopilot"
    message = mistake.about or mistake.message
    return finding.message_name in (message, None) and own == by_autopilot
