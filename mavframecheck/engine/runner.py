"""Runs rules over batches: tables to rows, rows to hits, hits to episodes, and how each rule ended."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from mavframecheck.checks import Check, Observation, load_check
from mavframecheck.engine.compiled import Binding, Choice, CompiledRule, bind
from mavframecheck.engine.episodes import Bools, Episode, Episodes, Judged, Words
from mavframecheck.engine.scope import RuleScope, ValueScope
from mavframecheck.engine.template import Template, first_value, plain
from mavframecheck.engine.waiting import Queue
from mavframecheck.missions.upload import ITEM, Upload
from mavframecheck.model import Evidence, Finding, RuleRun, Scalar, Severity, Subject
from mavframecheck.vehicle import NAMES, Context
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Batch, Dialect

if TYPE_CHECKING:
    from mavframecheck.engine.proofs import Proofs
    from mavframecheck.model.trace import Figure


class Onlooker(Protocol):
    """Who watches a recording being judged, for reports that draw."""

    proofs: Proofs

    def update(self, batch: Batch, context: Context) -> None:
        """See a batch, before its context is forgotten."""


@dataclass(slots=True)
class _Tally:
    """How much a rule could look at."""

    checked: int = 0
    late: int = 0
    """Rows whose context never came."""
    missing: set[str] = field(default_factory=set)
    """Context that never came."""


@dataclass(slots=True)
class _Desk:
    """The bindings on one message that need the same context, and the rows that wait for it."""

    queue: Queue
    rules: list[tuple[CompiledRule, str | None, list[Binding]]]
    at_once: set[str] = field(default_factory=set)
    """Context that the rows take along as it is known when they come."""


class _Hall:
    """The rules on one message that listen to the same senders; its desks open with the first row."""

    def __init__(self, message: str, senders: Choice, only: int | None) -> None:
        self._message = message
        self._senders = senders
        self._only = only
        self.rules: list[CompiledRule] = []
        self.desks: list[_Desk] = []

    def admit(self, rows: Rows | None) -> Rows | None:
        """Return the rows of the senders that count, None when there is none."""
        if rows is None:
            return None
        speaks = rows.context("sender.role").among(self._senders.allows)
        if self._only is not None:
            speaks = speaks & (rows.table.frames.sender == self._only)
        if not speaks.any():
            return None
        if not self.desks:
            self._open()
        return rows if speaks.all() else rows.take(speaks)

    def _open(self) -> None:
        desks: dict[tuple[str, ...], _Desk] = {}
        for rule in self.rules:
            labelled: dict[str | None, list[Binding]] = {}
            for binding in bind(rule, self._message):
                labelled.setdefault(binding.label, []).append(binding)
            names = tuple(sorted(rule.awaited))
            desk = desks.setdefault(names, _Desk(Queue(names), []))
            desk.at_once |= rule.asked_at_once
            desk.rules += [(rule, label, bindings) for label, bindings in labelled.items()]
        self.desks = list(desks.values())


class Runner:
    """Judges one recording with some rules."""

    def __init__(
        self,
        file: str,
        rules: list[CompiledRule],
        context: Context,
        dialect: Dialect,
        *,
        upload: Upload | None = None,
        only: int | None = None,
        onlooker: Onlooker | None = None,
    ) -> None:
        """Judge the recording called `file` with `rules`, learning `context` on the way.

        With `upload` the file is a mission: only its items are judged, and findings are placed in its text.
        With `only`, judge what that sender says, and learn from everybody.
        The `onlooker` sees every batch with its context, and keeps what rules draw.
        """
        self._rules = [rule for rule in rules if not rule.rule.detect.check]
        self._checks: list[tuple[CompiledRule, Check]] = [
            (rule, load_check(rule.rule.detect.check)(rule.params, dialect))
            for rule in rules
            if rule.rule.detect.check
        ]
        for _, check in self._checks:
            check.only = only
        self._only = only
        self._context = context
        self._dialect = dialect
        self._onlooker = onlooker
        self.episodes = Episodes(file, upload.locate if upload is not None else None)
        """What was found so far; of the Python checks, what they said when they were last asked."""
        self._judged = None if upload is None else {ITEM}
        self._halls: dict[str, list[_Hall]] = {}
        self._tallies = {rule.rule.code: _Tally() for rule in self._rules}

    def update(self, batch: Batch) -> None:
        """Judge the rows of a batch, and those that waited for what it says."""
        self._context.update(batch)
        for message in {**dict.fromkeys(batch.tables), **dict.fromkeys(self._halls)}:
            halls = self._halls_for(message)
            if not halls:
                continue
            table = batch.tables.get(message)
            rows = None if table is None else Rows(table, self._context)
            for hall in halls:
                admitted = hall.admit(rows)
                for desk in hall.desks:
                    self._serve(desk, admitted, batch)
        for _, check in self._checks:
            check.update(batch, self._context)
        if self._onlooker is not None:
            self._onlooker.update(batch, self._context)
        self._context.settle()

    def finish(self) -> tuple[list[Finding], list[RuleRun]]:
        """Return all findings, and how each rule ended."""
        for desk in (desk for halls in self._halls.values() for h in halls for desk in h.desks):
            self._judge_ready(desk, desk.queue.close())
        runs = [self._run_of(rule) for rule in self._rules]
        for rule, check in self._checks:
            self._observe(rule, check)
            runs.append(_verdict_of(rule, check))
        return self.episodes.findings(), sorted(runs, key=lambda run: run.code)

    @property
    def judging(self) -> int:
        """Rules with an expression that had something to judge so far."""
        return sum(tally.checked > 0 for tally in self._tallies.values())

    def ask(self) -> Iterator[None]:
        """Let each Python check say, one at a step, what it would if the recording ended here.

        `episodes` then holds it. Copies answer, so that asking changes nothing of what comes later.
        """
        shared = {id(each): each for each in (self._context, self._dialect)}
        copies = copy.deepcopy([check for _, check in self._checks], shared)
        for (rule, _), check in zip(self._checks, copies):
            self._observe(rule, check)
            yield

    def _observe(self, rule: CompiledRule, check: Check) -> None:
        observed = [each for each in check.finish() if self._concerns(each.subject)]
        found = [_episode(rule, each, self._drawn_by(check, each)) for each in observed]
        self.episodes.observe(rule.rule.code, found)

    def _drawn_by(self, check: Check, observation: Observation) -> Callable[[], tuple[Figure, ...]]:
        """Return what draws the proof of an observation, where somebody will look at it."""
        if self._onlooker is None:
            return tuple
        return functools.partial(check.figures, observation)

    def _concerns(self, subject: Subject) -> bool:
        """Return whether a finding is about a sender that is judged."""
        if self._only is None:
            return True
        return (subject.sysid, subject.compid) == (self._only >> 8, self._only & 0xFF)

    def figures(self) -> list[tuple[Figure, ...]]:
        """Return what proves each finding, once all is finished."""
        return [episode.figures() for episode in self.episodes.ordered()]

    def _halls_for(self, message: str) -> list[_Hall]:
        """Return the rules on a message by whom they listen to."""
        if self._judged is not None and message not in self._judged:
            return []
        if message not in self._halls:
            halls: dict[tuple[str, ...], _Hall] = {}
            for rule in self._rules:
                if rule.may_judge(message):
                    senders = rule.rule.applies.sender
                    hall = halls.setdefault(senders, _Hall(message, rule.senders, self._only))
                    hall.rules.append(rule)
            self._halls[message] = list(halls.values())
        return self._halls[message]

    def _serve(self, desk: _Desk, rows: Rows | None, batch: Batch) -> None:
        if desk.queue.names:
            if rows is not None:
                for name in desk.at_once:
                    rows.context(name)
            rows = desk.queue.offer(rows, batch.frames)
        self._judge_ready(desk, rows)

    def _judge(
        self, rule: CompiledRule, label: str | None, bindings: list[Binding], rows: Rows
    ) -> Bools:
        """Let one rule look at rows; return (n,) those it judged.

        Several bindings with one label (views of one field) act as one.
        """
        looked, hit = np.zeros((2, len(rows)), np.bool_)
        badness = np.zeros(len(rows))
        by = np.zeros(len(rows), np.int64)
        for k, binding in enumerate(bindings):
            seen = _applies(rule, binding, rows)
            if not seen.any():
                continue
            part, place = _part(rule, binding, rows, seen)
            scope = RuleScope(part, binding)
            inside = seen[place]
            if rule.when is not None:
                inside = inside & rule.when(scope)
            if not inside.any():
                continue
            looked[place] |= inside
            if self._onlooker is not None and rule.rule.proof:
                self._onlooker.proofs.record(
                    rule, scope, (rows.table.name, label), rows.stream[place], inside
                )
            found = inside & rule.flag(scope)
            if not found.any():
                continue
            found &= ~hit[place]
            hit[place] |= found
            rows_found = np.arange(len(rows))[place][found]
            by[rows_found] = k
            if rule.worst is not None:
                worst = np.abs(np.broadcast_to(rule.worst(scope), len(part)))
                badness[rows_found] = np.nan_to_num(worst[found])
        self._tallies[rule.rule.code].checked += int(np.count_nonzero(looked))
        if hit.any() or (
            looked.any() and self.episodes.follows(rule.rule.code, rows.table.name, label)
        ):
            self._collect(rule, label, bindings, rows, looked, hit, badness, by)
        return looked

    def _collect(
        self,
        rule: CompiledRule,
        label: str | None,
        bindings: list[Binding],
        rows: Rows,
        looked: Bools,
        hit: Bools,
        badness: np.typing.NDArray[np.float64],
        by: np.typing.NDArray[np.int64],
    ) -> None:
        places = np.flatnonzero(looked)
        frames = rows.table.frames
        shown = label if rule.rule.applies.report == "field" else None

        def describe(place: int) -> Words:
            row = places[place : place + 1]
            return _words(rule, RuleScope(rows.take(row), bindings[by[row[0]]]))

        def subject(place: int) -> Subject:
            row = places[place]
            return Subject(int(frames.sysid[row]), int(frames.compid[row]), rows.table.name, shown)

        judged = Judged(
            rows.stream[places],
            frames.take(places),
            hit[places],
            badness[places],
            subject,
            describe,
            figures=functools.partial(self._figures_of, rule, (rows.table.name, label)),
        )
        self.episodes.collect(rule, rows.table.name, label, judged)

    def _figures_of(
        self, rule: CompiledRule, key: tuple[str, str | None], stream: int
    ) -> tuple[Figure, ...]:
        if self._onlooker is None:
            return ()
        return self._onlooker.proofs.figures(rule, key, stream)

    def _judge_ready(self, desk: _Desk, rows: Rows | None) -> None:
        """Judge rows; where context never came, those that a rule can judge without. Count the others."""
        if rows is None or not len(rows):
            return
        complete = rows.complete(desk.queue.names)
        if complete.all():
            for rule, label, bindings in desk.rules:
                self._judge(rule, label, bindings, rows)
            return
        for rule, label, bindings in desk.rules:
            decidable = complete | rows.complete(rule.required)
            looked = np.zeros(len(rows), np.bool_)
            if decidable.any():
                looked[decidable] = self._judge(rule, label, bindings, rows.take(decidable))
            stuck = ~complete & ~looked & ~rows.complete(rule.judged_by)
            if stuck.any():
                concerned = stuck & np.any([_concerns(b, rows) for b in bindings], axis=0)
                tally = self._tallies[rule.rule.code]
                tally.late += int(concerned.sum())
                tally.missing |= {
                    n for n in rule.judged_by if not rows.context(n).known[concerned].all()
                }

    def _run_of(self, rule: CompiledRule) -> RuleRun:
        code, tally = rule.rule.code, self._tallies[rule.rule.code]
        why = "; ".join(sorted({NAMES[name].missing for name in tally.missing}))
        if tally.checked:
            reason = f"{tally.late} rows not judged: {why}" if tally.late else ""
            return RuleRun(code=code, status="ran", checked=tally.checked, reason=reason)
        if tally.late:
            return RuleRun(code=code, status="insufficient-data", reason=why)
        return RuleRun(code=code, status="not-applicable", reason=_what_was_missing(rule))


def _concerns(binding: Binding, rows: Rows) -> Bools:
    """Return (n,) rows that a binding is about, as far as the message itself tells."""
    concerned = np.ones(len(rows), np.bool_)
    for condition in binding.conditions:
        concerned &= rows.has(condition)
    return concerned


def _applies(rule: CompiledRule, binding: Binding, rows: Rows) -> Bools:
    """Return (n,) rows that a binding judges."""
    concerned = _concerns(binding, rows)
    if rule.rule.applies.autopilot:
        words = rule.rule.applies.autopilot
        concerned &= rows.among("vehicle.autopilot", words, rule.autopilots.allows)
    return concerned


def _part(
    rule: CompiledRule, binding: Binding, rows: Rows, seen: Bools
) -> tuple[Rows, slice | np.typing.NDArray[np.int64]]:
    """Return the rows to evaluate a rule on, and where they are: all, or only the few that it is about.

    Rules that are about the same few rows share them, and what is computed on them.
    """
    if np.count_nonzero(seen) * 2 > len(rows):
        return rows, slice(None)
    place = np.flatnonzero(seen)
    key = ("part", binding.conditions, rule.rule.applies.autopilot)
    return rows.cached(key, lambda: rows.take(place)), place


def _words(rule: CompiledRule, scope: RuleScope | ValueScope) -> Words:
    """Return severity, text, fix and evidence for the first row of `scope`."""
    severity = rule.rule.severity
    for condition, other in rule.severities:
        if bool(first_value(condition(scope))):
            severity = Severity(other)
            break
    return Words(
        severity, rule.text.fill(scope), rule.fix.fill(scope), dict(_evidence(rule.evidence, scope))
    )


def _evidence(
    templates: dict[str, Template], scope: RuleScope | ValueScope
) -> Iterator[tuple[str, Scalar]]:
    for key in ("expected", "observed", "unit", "frame"):
        yield key, None
    for key, template in templates.items():
        yield key, template.value(scope)


def _episode(
    rule: CompiledRule, observation: Observation, figures: Callable[[], tuple[Figure, ...]]
) -> Episode:
    """Return an observation of a Python check as an episode."""
    values = {
        name: plain(value) if value is not None else None
        for name, value in observation.values.items()
    }
    words = _words(rule, ValueScope(observation.values, rule.params, rule.lets))
    evidence: Evidence = {**values, **words.evidence}
    return Episode(
        rule=rule,
        subject=observation.subject,
        first=observation.first,
        last=observation.last,
        words=words._replace(evidence=evidence),
        count=observation.times,
        judged=observation.times,
        figures=figures,
    )


def _verdict_of(rule: CompiledRule, check: Check) -> RuleRun:
    verdict = check.verdict()
    code, checked = rule.rule.code, verdict.checked
    if verdict.insufficient:
        reason = verdict.insufficient
        return RuleRun(code=code, status="insufficient-data", reason=reason, checked=checked)
    if checked:
        return RuleRun(code=code, status="ran", checked=checked, reason=verdict.partly)
    reason = verdict.idle or _what_was_missing(rule)
    return RuleRun(code=code, status="not-applicable", reason=reason)


def _what_was_missing(rule: CompiledRule) -> str:
    """Say in words what would have had to be in the recording."""
    applies = rule.rule.applies
    if applies.message:
        what = f"no {' or '.join(applies.message)}"
    elif applies.tag:
        what = "no field with " + ", ".join(f"{key} {value}" for key, value in applies.tag.items())
    else:
        what = "nothing in the recording"
    conditions = (*applies.sender, *applies.autopilot, *applies.command, *applies.frame)
    return f"{what} that the rule is about" + (f" ({', '.join(conditions)})" if conditions else "")
