"""Texts of rule files: `{expression}` or `{expression:format}`, filled in from one row."""

from __future__ import annotations

import math
from string import Formatter
from typing import Any

import numpy as np

from mavframecheck.engine.expression import Expression, ExpressionError, RuleFileError, Scope
from mavframecheck.model import Scalar


class Template:
    """A text with expressions in braces."""

    def __init__(self, source: str, names: frozenset[str]) -> None:
        """Compile `source`; ExpressionError when a piece in braces is no expression."""
        self.source = source
        try:
            pieces = list(Formatter().parse(source))
        except ValueError as error:
            raise ExpressionError(f"unbalanced braces ({error})", 1) from error
        self._pieces = [
            (literal, None if code is None else Expression(code, names), spec or "")
            for literal, code, spec, _conversion in pieces
        ]

    @property
    def expressions(self) -> list[Expression]:
        """The expressions in the text."""
        return [code for _, code, _ in self._pieces if code is not None]

    def fill(self, scope: Scope) -> str:
        """Return the text for the first row of `scope`."""
        return "".join(
            literal + ("" if code is None else _filled(code, spec, scope))
            for literal, code, spec in self._pieces
        )

    def value(self, scope: Scope) -> Scalar:
        """Return the bare value where the text is a single expression, else the text."""
        if len(self._pieces) == 1 and self._pieces[0][0] == "" and not self._pieces[0][2]:
            code = self._pieces[0][1]
            return plain(first_value(code(scope))) if code is not None else ""
        return self.fill(scope)


def _filled(code: Expression, spec: str, scope: Scope) -> str:
    """Return one piece in braces in words."""
    value = first_value(code(scope))
    try:
        return format_value(value, spec)
    except (ValueError, TypeError) as error:
        text = f"{code.where}: {value!r} cannot be written as {spec!r} ({error})"
        raise RuleFileError(text) from error


def first_value(column: Any) -> Any:
    """Return the value of the first row as a plain Python object (a list for an array field)."""
    if isinstance(column, list):
        return column[0]
    array = np.asarray(column)
    return array.tolist() if array.ndim == 0 else array[0].tolist()


def plain(value: Any) -> Scalar:
    """Return `value` as JSON can carry it: no NaN, no infinity, no bytes."""
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, (str, int, bool)) else str(value)


def format_value(value: Any, spec: str) -> str:
    """Return `value` in words for people; numbers without a format get as many digits as they need."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, float) and not spec:
        return f"{value:.10g}"
    return format(value, spec) if not isinstance(value, (str, list)) else str(value)
