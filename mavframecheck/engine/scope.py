"""What the expressions of a rule are evaluated on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NoReturn

import numpy as np

from mavframecheck.engine import governed, stacks
from mavframecheck.engine.compiled import Binding
from mavframecheck.engine.expression import Expression, RuleFileError
from mavframecheck.semantics.acceptance import Verdict
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle.rows import Rows


class RuleScope:
    """Rows of one message, seen through one binding of a rule."""

    def __init__(self, rows: Rows, binding: Binding) -> None:
        """See `rows` through `binding`."""
        self.rows = rows
        self.binding = binding
        self._names: dict[str, Any] = {}

    def field(self, function: str, name: str) -> Any:
        """Return ``function(name)`` as a column; RuleFileError when the message has no such field."""
        if function == "takes":
            return stacks.taken(self.rows, self.binding.message)
        field, tag = self.binding.resolve(name)
        if field not in self.rows.table.layout.by_name:
            if function == "optional":
                return np.full(len(self.rows), np.nan)
            if function in _OF_STACK:
                return stacks.verdicts(self.rows, self.binding.message, "", _OF_STACK[function])
            self._refuse(f"{self.binding.message} has no field called {name!r}")
        plain = _OF_FIELD.get(function)
        if plain is not None:
            return plain(self.rows, field)
        if function in _OF_STACK:
            return stacks.verdicts(self.rows, self.binding.message, field, _OF_STACK[function])
        if function == "words":
            return self.rows.words(field, tag)
        if tag is None:
            meant = f"{self.binding.message}.{field}"
            self._refuse(f"{function}({name}): the catalogue has no meaning for {meant}")
        if function == "quaternion":
            return self.rows.quaternion(tag, self.binding.partners)
        if function == "reference":
            return stacks.references(self.rows, self.binding.message, tag)
        return _OF_TAG[function](self.rows, tag)

    def name(self, name: str) -> Any:
        """Return a parameter, a named expression, the message, or the field and its unit."""
        rule = self.binding.rule
        if name in rule.params:
            return rule.params[name]
        if name in rule.lets:
            if name not in self._names:
                self._names[name] = rule.lets[name](self)
            return self._names[name]
        if name == "message":
            return self.binding.message
        tag = self.binding.tag
        return "" if tag is None else tag.unit if name == "unit" else tag.field

    def stack(self, key: str) -> Any:
        """Return a fact about the message, by the autopilot that each row is about."""
        return stacks.facts(self.rows, self.binding.message, key)

    def listed(self, key: str, values: Any) -> Any:
        """Return whether `values` are among a set of numbers that is a fact about the message."""
        return stacks.listed(self.rows, self.binding.message, key, values)

    def context(self, name: str) -> Any:
        """Return the values of a context column."""
        return self.rows.context(name).words

    def known(self, name: str) -> Any:
        """Return where a context column is known."""
        return self.rows.context(name).known

    def _refuse(self, problem: str) -> NoReturn:
        message = f"rule {self.binding.rule.rule.code}: {problem}"
        raise RuleFileError(message)


class ValueScope:
    """What the texts of a rule with a Python check are filled in from: named values."""

    def __init__(
        self,
        values: Mapping[str, Any],
        params: Mapping[str, Any],
        lets: Mapping[str, Expression] | None = None,
    ) -> None:
        """Know `values`, the parameters of the rule and its named expressions."""
        self._values = {**params, **values}
        self._lets = lets or {}

    def field(self, function: str, name: str) -> Any:
        """Fields are unknown here."""
        raise RuleFileError(f"{function}({name}) cannot be used in the texts of a Python check")

    def name(self, name: str) -> Any:
        """Return the value, or the named expression, called `name`."""
        if name in self._lets:
            return self._lets[name](self)
        if name not in self._values:
            message = f"the check gives no value called {name!r}: it gives {', '.join(sorted(self._values))}"
            raise RuleFileError(message)
        return self._values[name]

    def stack(self, key: str) -> Any:
        """Facts are unknown here."""
        raise RuleFileError(f"stack({key!r}) cannot be used in the texts of a Python check")

    def listed(self, key: str, _: Any) -> Any:
        """Facts are unknown here."""
        raise RuleFileError(f"listed({key!r}) cannot be used in the texts of a Python check")

    def context(self, name: str) -> Any:
        """Context is unknown here."""
        raise RuleFileError(f"{name} cannot be used in the texts of a Python check")

    known = context


def _used(rows: Rows, tag: FieldTag) -> Any:
    return rows.used(tag)


def _ignored(rows: Rows, tag: FieldTag) -> Any:
    return np.logical_not(rows.used(tag))


_OF_STACK: dict[str, Callable[[Verdict], Any]] = {
    "does": lambda verdict: str(verdict.consequence),
    "does_surely": lambda verdict: verdict.certain,
    "answer_to": lambda verdict: verdict.answer,
    "note_on": lambda verdict: verdict.note,
}
_OF_FIELD: dict[str, Callable[[Rows, str], Any]] = {
    "raw": Rows.raw,
    "optional": Rows.raw,
    "present": Rows.present,
}
_OF_TAG: dict[str, Callable[[Rows, FieldTag], Any]] = {
    "si": Rows.si,
    "used": _used,
    "ignored": _ignored,
    "unknown": Rows.unknown,
    "any_unknown": Rows.any_unknown,
    "any_nan": Rows.any_nan,
    "undefined": Rows.undefined,
    "diagonal": Rows.diagonal,
    "correlation": Rows.correlation,
    "groups_used": governed.groups_used,
    "used_zero": governed.used_zero,
    "ignored_given": governed.ignored_given,
}
