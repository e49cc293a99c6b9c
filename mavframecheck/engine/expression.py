"""Expressions of rule files: compiled once through `ast` with a whitelist, evaluated on whole columns.

An expression computes, it never runs code: names, numbers, texts, comparisons, and/or/not, arithmetic, bit
operations, `in`, `x if c else y`, `f[i]` on array fields, and calls to a listed set of functions. Anything
else is an error that names the column of the text.
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np

from mavframecheck.engine.functions import FIELD_FUNCTIONS, FUNCTIONS
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import NAMES

MAX_LENGTH = 2000
OF_STACK = frozenset({"does", "does_surely", "answer_to", "note_on", "takes", "reference"})
"""Functions of a field that read the acceptance data."""
NEEDED = frozenset({"vehicle.autopilot", "vehicle.version"})
"""Context that those, and stack(), read."""
MAX_DEPTH = 60
ANY_NAME = "*"
"""Among the names of an expression: any name is allowed (a Python check gives the values)."""


class RuleFileError(Exception):
    """A rule file that cannot be used; the text names file, key and column."""


class ExpressionError(RuleFileError):
    """A text that is no expression of ours; `column` counts from 1."""

    def __init__(self, text: str, column: int) -> None:
        """Say what is wrong and where."""
        super().__init__(text)
        self.column = column


class Scope(Protocol):
    """What an expression is evaluated on: the rows of a table, seen through a rule."""

    def field(self, function: str, name: str) -> Any:
        """Return `function` (``raw``, ``si``, ``used``...) of the field called `name`, a column."""

    def name(self, name: str) -> Any:
        """Return a parameter or named expression of the rule."""

    def stack(self, key: str) -> Any:
        """Return what the autopilot's acceptance data says of the message under `key`."""

    def listed(self, key: str, values: Any) -> Any:
        """Return whether `values` are in the set that the acceptance data has under `key`."""

    def context(self, name: str) -> Any:
        """Return a context column, e.g. ``vehicle.lat``."""

    def known(self, name: str) -> Any:
        """Return where a context column is known."""


Evaluate = Callable[[Scope], Any]

_BINARY: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.FloorDiv: np.floor_divide,
    ast.Mod: np.mod,
    ast.BitAnd: np.bitwise_and,
    ast.BitOr: np.bitwise_or,
    ast.BitXor: np.bitwise_xor,
    ast.RShift: np.right_shift,
}
_UNARY: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Not: np.logical_not,
    ast.USub: np.negative,
    ast.UAdd: np.positive,
    ast.Invert: np.invert,
}
_COMPARE: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}


class Expression:
    """A compiled expression: what it needs, and a function from a scope to a column."""

    def __init__(self, source: str, names: frozenset[str]) -> None:
        """Compile `source`; `names` are the parameters and named expressions it may use."""
        self.source = source
        self.where = ""
        """File and key that it stands in."""
        self.contexts: set[str] = set()
        """Context columns it reads."""
        self.tested: set[str] = set()
        """Those of them that it asks about with known()."""
        self.hoped: set[str] = set()
        """Context that it can do without."""
        self.used_names: set[str] = set()
        self._names = names
        self._depth = 0
        self._evaluate = self._compile(_parse(source))

    def __call__(self, scope: Scope) -> Any:
        """Evaluate on the rows of `scope`: a column, or a scalar when it depends on no row."""
        try:
            with np.errstate(all="ignore"):
                return self._evaluate(scope)
        except (TypeError, ValueError, IndexError, OverflowError) as error:
            text = f"{self.where}: {self.source!r} cannot be computed ({error})"
            raise RuleFileError(text) from error

    def _compile(self, node: ast.expr) -> Evaluate:
        compiler = _COMPILERS.get(type(node))
        if compiler is None:
            raise _error(node, f"{type(node).__name__} is not allowed in an expression")
        if self._depth >= MAX_DEPTH:
            raise _error(node, "nested too deeply")
        self._depth += 1
        compiled = compiler(self, node)
        self._depth -= 1
        return compiled

    def _constant(self, node: ast.Constant) -> Evaluate:
        value = node.value
        if not isinstance(value, (bool, int, float, str)):
            raise _error(node, "only numbers and texts can be constants")
        if isinstance(value, int) and abs(value) >= 2**63:
            raise _error(node, "a number beyond 64 bits")
        return lambda _scope: value

    def _name(self, node: ast.Name) -> Evaluate:
        name = node.id
        if name not in self._names and ANY_NAME not in self._names:
            raise _error(
                node, f"unknown name {name!r}: a field is written raw({name}) or si({name})"
            )
        self.used_names.add(name)
        return lambda scope: scope.name(name)

    def _attribute(self, node: ast.Attribute) -> Evaluate:
        name = _dotted(node)
        if not name or not isinstance(node.value, ast.Name):
            raise _error(
                node, "a dotted name has two parts, as in home.alt_msl or MAV_FRAME.LOCAL_NED"
            )
        if name in NAMES:
            self.contexts.add(name)
            return lambda scope: scope.context(name)
        if node.value.id.isupper() or node.value.id.replace("_", "").isupper():
            try:
                value = constant(name)
            except KeyError as error:
                raise _error(node, str(error.args[0])) from error
            return lambda _scope: value
        raise _error(node, f"unknown context {name!r}: one of {', '.join(sorted(NAMES))}")

    def _binary(self, node: ast.BinOp) -> Evaluate:
        operator = _BINARY.get(type(node.op))
        if operator is None:
            raise _error(node, f"the operator {type(node.op).__name__} is not allowed")
        left, right = self._compile(node.left), self._compile(node.right)
        return lambda scope: operator(left(scope), right(scope))

    def _unary(self, node: ast.UnaryOp) -> Evaluate:
        operator, operand = _UNARY[type(node.op)], self._compile(node.operand)
        return lambda scope: operator(operand(scope))

    def _boolean(self, node: ast.BoolOp) -> Evaluate:
        """Compile ``a and b``: `b` is left out where `a` settles it for every row."""
        parts = [self._compile(value) for value in node.values]
        conjunction = isinstance(node.op, ast.And)
        operator = np.logical_and if conjunction else np.logical_or

        def evaluate(scope: Scope) -> Any:
            result = parts[0](scope)
            for part in parts[1:]:
                if not np.asarray(result).any() if conjunction else np.asarray(result).all():
                    break
                result = operator(result, part(scope))
            return result

        return evaluate

    def _compare(self, node: ast.Compare) -> Evaluate:
        links = list(self._links(node))

        def evaluate(scope: Scope) -> Any:
            result = links[0](scope)
            for link in links[1:]:
                result = np.logical_and(result, link(scope))
            return result

        return evaluate

    def _links(self, node: ast.Compare) -> Iterator[Evaluate]:
        """Compile ``a < b < c`` as its links ``a < b`` and ``b < c``."""
        left = self._compile(node.left)
        for operator, comparator in zip(node.ops, node.comparators, strict=True):
            if isinstance(operator, (ast.In, ast.NotIn)):
                yield self._membership(left, comparator, negate=isinstance(operator, ast.NotIn))
                continue
            if type(operator) not in _COMPARE:
                raise _error(node, f"the comparison {type(operator).__name__} is not allowed")
            right = self._compile(comparator)
            yield _link(_COMPARE[type(operator)], left, right)
            left = right

    def _membership(self, left: Evaluate, node: ast.expr, *, negate: bool) -> Evaluate:
        if not isinstance(node, (ast.List, ast.Tuple)):
            raise _error(node, "`in` needs a list, as in [1, 8]")
        choices = [self._compile(element) for element in node.elts]

        def evaluate(scope: Scope) -> Any:
            value = left(scope)
            found = np.zeros(np.shape(value), np.bool_)
            for choice in choices:
                found = np.logical_or(found, np.equal(value, choice(scope)))
            return np.logical_not(found) if negate else found

        return evaluate

    def _conditional(self, node: ast.IfExp) -> Evaluate:
        test, body, orelse = (
            self._compile(node.test),
            self._compile(node.body),
            self._compile(node.orelse),
        )
        return lambda scope: np.where(test(scope), body(scope), orelse(scope))

    def _subscript(self, node: ast.Subscript) -> Evaluate:
        if not isinstance(node.slice, ast.Constant) or not isinstance(node.slice.value, int):
            raise _error(node, "an element is picked by a plain number, as in raw(q)[0]")
        value, place = self._compile(node.value), node.slice.value
        return lambda scope: np.asarray(value(scope))[..., place]

    def _call(self, node: ast.Call) -> Evaluate:
        if not isinstance(node.func, ast.Name) or node.keywords:
            raise _error(node, "only listed functions can be called, without keywords")
        name = node.func.id
        if name in FIELD_FUNCTIONS:
            return self._field_call(name, node)
        if name == "known":
            return self._known(node)
        if name == "maybe":
            return self._maybe(node)
        if name == "stack":
            return self._stack(node)
        if name == "listed":
            return self._listed(node)
        if name not in FUNCTIONS:
            raise _error(
                node,
                f"unknown function {name!r}: one of {', '.join(sorted({*FUNCTIONS, *FIELD_FUNCTIONS}))}",
            )
        function, arguments = FUNCTIONS[name], [self._compile(argument) for argument in node.args]
        fewest, most = _arity(function)
        if not fewest <= len(arguments) <= most:
            number = f"{fewest}" if fewest == most else f"{fewest} to {most}"
            raise _error(node, f"{name}() takes {number} values, not {len(arguments)}")
        return lambda scope: function(*(argument(scope) for argument in arguments))

    def _field_call(self, function: str, node: ast.Call) -> Evaluate:
        if len(node.args) != 1 or not isinstance(node.args[0], ast.Name):
            raise _error(node, f"{function}() takes the name of one field")
        field = node.args[0].id
        if function in OF_STACK:
            self.hoped |= NEEDED
        return lambda scope: scope.field(function, field)

    def _stack(self, node: ast.Call) -> Evaluate:
        """Compile ``stack('partial_axes')``: a fact about the message, for the autopilot meant."""
        key = (
            node.args[0].value
            if len(node.args) == 1 and isinstance(node.args[0], ast.Constant)
            else None
        )
        if not isinstance(key, str):
            raise _error(node, "stack() takes the name of one fact, as in stack('partial_axes')")
        self.hoped |= NEEDED
        return lambda scope: scope.stack(key)

    def _listed(self, node: ast.Call) -> Evaluate:
        """Compile ``listed('child_frames', raw(child_frame_id))``: a value against a set of numbers."""
        first = node.args[0] if len(node.args) == 2 else None
        key = first.value if isinstance(first, ast.Constant) else None
        if not isinstance(key, str):
            raise _error(
                node,
                "listed() takes the name of a set and a value, as in listed('child_frames', raw(f))",
            )
        self.hoped |= NEEDED
        value = self._compile(node.args[1])
        return lambda scope: scope.listed(key, value(scope))

    def _maybe(self, node: ast.Call) -> Evaluate:
        """Compile ``maybe(vehicle.alt_msl)``: the context where it is known, without requiring it."""
        name = self._context_of(node, "maybe")
        self.hoped.add(name)
        return lambda scope: scope.context(name)

    def _known(self, node: ast.Call) -> Evaluate:
        """Compile ``known(home.lat)``: whether this context has come, or came in time."""
        name = self._context_of(node, "known")
        self.tested.add(name)
        return lambda scope: scope.known(name)

    def _context_of(self, node: ast.Call, function: str) -> str:
        """Return the context name that a call is about."""
        name = _dotted(node.args[0]) if len(node.args) == 1 else ""
        if name not in NAMES:
            raise _error(node, f"{function}() takes one context name, as in {function}(home.lat)")
        return name


_COMPILERS: dict[type[ast.expr], Callable[[Expression, Any], Evaluate]] = {
    ast.Constant: Expression._constant,
    ast.Name: Expression._name,
    ast.Attribute: Expression._attribute,
    ast.BinOp: Expression._binary,
    ast.UnaryOp: Expression._unary,
    ast.BoolOp: Expression._boolean,
    ast.Compare: Expression._compare,
    ast.IfExp: Expression._conditional,
    ast.Subscript: Expression._subscript,
    ast.Call: Expression._call,
}


def _parse(source: str) -> ast.expr:
    if len(source) > MAX_LENGTH:
        text = f"longer than {MAX_LENGTH} characters"
        raise ExpressionError(text, MAX_LENGTH)
    try:
        tree = ast.parse(source.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ExpressionError(
            f"not an expression ({error})", getattr(error, "offset", None) or 1
        ) from error
    return tree.body


@functools.cache
def _arity(function: Callable[..., Any]) -> tuple[int, int]:
    """Return how many values a function takes; numpy's would take one more for an array to write to."""
    if isinstance(function, np.ufunc):
        return function.nin, function.nin
    parameters = inspect.signature(function).parameters.values()
    if any(p.kind is p.VAR_POSITIONAL for p in parameters):
        return 2, MAX_LENGTH
    return sum(p.default is p.empty for p in parameters), len(parameters)


def _dotted(node: ast.expr) -> str:
    """Return ``home.lat`` for the name in two parts that a node is, nothing for any other."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        return f"{node.value.id}.{node.attr}"
    return ""


def _link(operator: Callable[..., Any], left: Evaluate, right: Evaluate) -> Evaluate:
    return lambda scope: operator(left(scope), right(scope))


def _error(node: ast.expr, text: str) -> ExpressionError:
    return ExpressionError(text, node.col_offset + 1)
