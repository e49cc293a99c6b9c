"""Rules made ready to run: expressions compiled, texts parsed, and bound to the messages they judge."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from mavframecheck.checks import load_check
from mavframecheck.engine.expression import ANY_NAME, Expression, ExpressionError, RuleFileError
from mavframecheck.engine.template import Template
from mavframecheck.missions.upload import ITEM
from mavframecheck.model import ProofLines, Rule, Severity
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.commands import location_commands
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import FrameKind, Quantity
from mavframecheck.semantics.mavframe import frames_of
from mavframecheck.semantics.tags import Condition, FieldTag
from mavframecheck.vehicle import NAMES

OWN_NAMES = frozenset({"message", "field", "unit"})
"""Names that every rule knows: the message and the field that it is looking at, and the field's unit."""
ALWAYS_KNOWN = frozenset({"sender.role"})
"""Context that never has to be waited for."""


class CompiledRule:
    """A rule with its parameters fixed; each of its texts is compiled when it is first needed.

    A recording is about a few of many rules, and compiling all of them would cost more than judging it.
    """

    def __init__(
        self,
        rule: Rule,
        params: Mapping[str, Any],
        source: str,
        binds: Collection[str] | None = None,
        speaks_of: Collection[str] | None = None,
    ) -> None:
        """Take `rule` from the file `source` with `params` in place of its own.

        `binds` are the messages that it can be about, and `speaks_of` the context that it names, where
        that was worked out before.
        """
        self.rule = rule
        self.params = {**rule.params, **params}
        self._source = source
        self._binds = binds
        self._known_to_speak_of = speaks_of
        self.messages = Choice(rule.applies.message)
        self.criteria = [(name, Choice(value)) for name, value in rule.applies.tag.items()]
        self.senders = Choice(rule.applies.sender)
        self.autopilots = Choice(rule.applies.autopilot)

    def validate(self) -> None:
        """Compile everything; RuleFileError names file, key and column of what cannot be."""
        _ = self.awaited, self.judged_by
        for figure, lines in self.proofs:
            parts = [part for line in lines.values() for part in self._with_lets(line)]
            named = set().union(*(part.contexts | part.hoped | part.tested for part in parts))
            if strange := sorted(named - self.spoken_of - ALWAYS_KNOWN):
                message = f"{self._source}: proof: '{figure.title}' names {strange[0]}, which nothing else in the rule does"
                raise RuleFileError(message)

    def may_judge(self, message: str) -> bool:
        """Return whether the rule can be about a message; a Python check: whether it judges mission items."""
        if self._binds is not None:
            return message in self._binds
        if self.rule.detect.check:
            return message in bound_messages(self)
        return bool(bind(self, message))

    @functools.cached_property
    def lets(self) -> dict[str, Expression]:
        """Named expressions, in order: each may use those before it."""
        names = frozenset(self.params) | OWN_NAMES
        if self.rule.detect.check:
            names |= {ANY_NAME}
        lets: dict[str, Expression] = {}
        for name, code in self.rule.let.items():
            lets[name] = self._expression(code, names, f"let.{name}")
            names |= {name}
        return lets

    @property
    def _names(self) -> frozenset[str]:
        return frozenset(self.params) | OWN_NAMES | frozenset(self.lets)

    @property
    def _text_names(self) -> frozenset[str]:
        return self._names | {ANY_NAME} if self.rule.detect.check else self._names

    @functools.cached_property
    def when(self) -> Expression | None:
        """Which rows are judged."""
        code = self.rule.detect.when
        return self._expression(code, self._names, "detect.when") if code else None

    @functools.cached_property
    def flag(self) -> Expression:
        """Which judged rows are wrong; none by itself where a Python check looks."""
        return self._expression(self.rule.detect.flag or "False", self._names, "detect.flag")

    @functools.cached_property
    def worst(self) -> Expression | None:
        """How bad a row is."""
        code = self.rule.detect.worst
        return self._expression(code, self._names, "detect.worst") if code else None

    @functools.cached_property
    def severities(self) -> list[tuple[Expression, Severity]]:
        """Conditions for another severity, the first that holds wins."""
        return [
            (
                self._expression(case.condition, self._text_names, f"severity_when[{k}]"),
                case.severity,
            )
            for k, case in enumerate(self.rule.severity_when)
        ]

    @functools.cached_property
    def text(self) -> Template:
        """What is wrong."""
        return self._template(self.rule.explain.text, "explain.text")

    @functools.cached_property
    def fix(self) -> Template:
        """How to mend it."""
        return self._template(self.rule.explain.fix, "explain.fix")

    @functools.cached_property
    def evidence(self) -> dict[str, Template]:
        """Typed evidence by key."""
        return {
            key: self._template(text, f"evidence.{key}") for key, text in self.rule.evidence.items()
        }

    @functools.cached_property
    def proofs(self) -> list[tuple[ProofLines, dict[str, Expression]]]:
        """What is drawn of the judged rows, and the expression of each line."""
        return [
            (
                figure,
                {
                    label: self._expression(code, self._names, f"proof[{k}].lines.{label}")
                    for label, code in figure.lines.items()
                },
            )
            for k, figure in enumerate(self.rule.proof)
        ]

    @functools.cached_property
    def required(self) -> frozenset[str]:
        """Context that a row must have before it is judged.

        What `when` asks about with known() is not among it: there the rule decides for itself.
        """
        found = {"vehicle.autopilot"} if self.rule.applies.autopilot else set()
        found = found.union(*map(self._contexts, (self.when, self.flag)))
        tested = [
            NAMES[name].sources for name in (self.when.tested if self.when is not None else ())
        ]
        together = {history for sources in tested for history, _ in sources}
        return frozenset(n for n in found - ALWAYS_KNOWN if NAMES[n].sources[0][0] not in together)

    @functools.cached_property
    def judged_by(self) -> frozenset[str]:
        """All context that decides whether a row is judged, and how."""
        tested = set().union(*(part.tested for part in self._with_lets(self.when)))
        return (self.required | self._contexts(self.when) | tested) - ALWAYS_KNOWN

    @functools.cached_property
    def awaited(self) -> frozenset[str]:
        """Context worth waiting for: what judging, severity and words speak of."""
        return frozenset(name for name in self.spoken_of if NAMES[name].waits)

    @functools.cached_property
    def asked_at_once(self) -> frozenset[str]:
        """Context that is not worth waiting for: as it is known when a row comes, however long that waits."""
        return self.spoken_of - self.awaited

    @functools.cached_property
    def spoken_of(self) -> frozenset[str]:
        """All context that judging, severity and words name."""
        if self._known_to_speak_of is not None:
            return frozenset(self._known_to_speak_of)
        spoken = [condition for condition, _ in self.severities]
        for template in (self.text, self.fix, *self.evidence.values()):
            spoken += template.expressions
        parts = [p for e in (self.when, self.flag, self.worst, *spoken) for p in self._with_lets(e)]
        named = self.required.union(*(part.contexts | part.hoped | part.tested for part in parts))
        return frozenset(named - ALWAYS_KNOWN)

    def _contexts(self, expression: Expression | None) -> set[str]:
        return set().union(*(each.contexts for each in self._with_lets(expression)))

    def _with_lets(self, expression: Expression | None) -> list[Expression]:
        """Return an expression and the named ones that it uses."""
        if expression is None:
            return []
        named = [self.lets[name] for name in expression.used_names if name in self.lets]
        return [expression, *(part for each in named for part in self._with_lets(each))]

    def _expression(self, code: str, names: frozenset[str], key: str) -> Expression:
        try:
            expression = Expression(code, names)
        except ExpressionError as error:
            message = f"{self._source}: {key}, column {error.column}: {error}"
            raise RuleFileError(message) from error
        expression.where = f"{self._source}: {key}"
        return expression

    def _template(self, text: str, key: str) -> Template:
        try:
            template = Template(text, self._text_names)
        except ExpressionError as error:
            message = f"{self._source}: {key}, column {error.column}: {error}"
            raise RuleFileError(message) from error
        for expression in template.expressions:
            expression.where = f"{self._source}: {key}"
        return template


@dataclass(frozen=True, slots=True)
class Binding:
    """A rule on one message: all rows of it, or the view of one tag."""

    rule: CompiledRule
    message: str
    tag: FieldTag | None
    partners: dict[str, FieldTag]
    conditions: tuple[Condition, ...]

    @property
    def label(self) -> str | None:
        """What tells findings of one message apart: field, group, or nothing."""
        report = self.rule.rule.applies.report
        if self.tag is None or report == "message":
            return None
        return self.tag.field if report == "field" else (self.tag.group or self.tag.field)

    def resolve(self, name: str) -> tuple[str, FieldTag | None]:
        """Return the field that a rule calls `name`, and what it means in this view."""
        if name == "value" and self.tag is not None:
            return self.tag.field, self.tag
        if name in self.partners:
            return self.partners[name].field, self.partners[name]
        for tag in catalogue.tags_of(self.message, name):
            if _compatible(tag.when, self.conditions):
                return name, tag
        return name, None


@functools.lru_cache(maxsize=4096)
def bind(rule: CompiledRule, message: str) -> tuple[Binding, ...]:
    """Return how `rule` judges `message`: one binding per matching tag, one for a message rule, or none."""
    applies = rule.rule.applies
    if rule.rule.detect.check:
        return ()
    if not rule.messages.allows(message):
        return ()
    if not applies.tag:
        conditions = tuple(_row_conditions(rule.rule, message, None))
        return (Binding(rule, message, None, {}, conditions),) if applies.message else ()
    return tuple(_bind_tags(rule, message))


def bound_messages(rule: CompiledRule) -> tuple[str, ...]:
    """Return every message that a rule can be about, sorted; of a Python check only whether it is mission items."""
    if rule.rule.detect.check:
        return (ITEM,) if load_check(rule.rule.detect.check).of_missions else ()
    named = {name for name in rule.rule.applies.message if not name.startswith("!")}
    return tuple(sorted(m for m in {*catalogue.messages(), *named} if bind(rule, m)))


def _bind_tags(rule: CompiledRule, message: str) -> Iterator[Binding]:
    for tag in catalogue.tags(message):
        if not all(choice.allows(str(getattr(tag, name))) for name, choice in rule.criteria):
            continue
        partners = catalogue.partners(tag)
        if all(name in partners for name in rule.rule.applies.has):
            conditions = (*tag.when, *_row_conditions(rule.rule, message, tag))
            yield Binding(rule, message, tag, partners, conditions)


class Choice:
    """A list in a rule file: any of its values; those with a leading ``!`` exclude."""

    def __init__(self, values: object) -> None:
        """Take one value or several."""
        several = values if isinstance(values, (list, tuple)) else (values,)
        words = [str(value) for value in several]
        self._excluded = frozenset(word[1:] for word in words if word.startswith("!"))
        self._included = frozenset(word for word in words if not word.startswith("!"))

    def allows(self, value: str) -> bool:
        """Return whether `value` is among the values."""
        return value not in self._excluded and (not self._included or value in self._included)


def _row_conditions(rule: Rule, message: str, tag: FieldTag | None) -> Iterator[Condition]:
    """Return the conditions on selector fields that `applies.command` and `applies.frame` make."""
    if rule.applies.command:
        yield Condition(
            "command", tuple(v for name in rule.applies.command for v in _commands(name))
        )
    if rule.applies.frame:
        field = (tag.frame_field if tag is not None else "") or _frame_field(message)
        yield Condition(field, tuple(v for name in rule.applies.frame for v in _frames(name)))


def _commands(name: str) -> tuple[int, ...]:
    return location_commands() if name == "location" else (constant(f"MAV_CMD.{name}"),)


def _frames(name: str) -> tuple[int, ...]:
    return (
        frames_of(FrameKind(name)) if name in set(FrameKind) else (constant(f"MAV_FRAME.{name}"),)
    )


def _frame_field(message: str) -> str:
    """Return the first field of a message that selects a MAV_FRAME."""
    tags = catalogue.tags(message)
    return next((t.field for t in tags if t.quantity is Quantity.FRAME_SELECTOR), "frame")


def _compatible(left: tuple[Condition, ...], right: tuple[Condition, ...]) -> bool:
    """Return whether one row can satisfy both sets of conditions."""
    theirs = {c.field: c.values for c in right}
    return all(not set(c.values).isdisjoint(theirs.get(c.field, c.values)) for c in left)


class Pack(msgspec.Struct, frozen=True):
    """Rules by ascending code, and the file that each came from."""

    rules: tuple[Rule, ...]
    sources: dict[str, str] = {}
    binds: dict[str, tuple[str, ...]] = {}
    """Code to the messages that the rule can be about, worked out when the pack was compiled."""
    context: dict[str, tuple[str, ...]] = {}
    """Code to the context that the rule names, worked out then too."""

    @property
    def by_code(self) -> dict[str, Rule]:
        """Rules by code."""
        return {rule.code: rule for rule in self.rules}
