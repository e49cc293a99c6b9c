"""Expressions of rule files: they compute what Python would, and nothing else."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.engine.expression import (
    MAX_DEPTH,
    MAX_LENGTH,
    Expression,
    ExpressionError,
    RuleFileError,
)

NAMES = frozenset({"a", "b", "c"})


class Columns:
    """A scope of made-up columns: names, fields and context by the same letters."""

    def __init__(self, **columns: Any) -> None:
        self._columns = {name: np.asarray(values) for name, values in columns.items()}
        self.asked: list[str] = []

    def name(self, name: str) -> Any:
        return self._columns[name]

    def field(self, function: str, name: str) -> Any:
        self.asked.append(f"{function}({name})")
        return self._columns[name]

    def context(self, name: str) -> Any:
        self.asked.append(name)
        return self._columns[name.replace(".", "_")]

    def known(self, name: str) -> Any:
        column = np.asarray(self.context(name))
        return column != "unknown" if column.dtype.kind == "U" else ~np.isnan(column)

    def stack(self, key: str) -> Any:
        return self._columns[key]

    def listed(self, key: str, values: Any) -> Any:
        return np.isin(values, self._columns[key])


def compute(source: str, **columns: Any) -> Any:
    """Evaluate a text on columns."""
    return np.asarray(Expression(source, NAMES)(Columns(**columns))).tolist()


HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__[0].__subclasses__()",
    "raw(a).__class__",
    "a.tofile('x')",
    "(lambda: 1)()",
    "[x for x in (1, 2)]",
    "{x for x in (1, 2)}",
    "{1: 2}",
    "(yield 1)",
    "await a",
    "(a := 1)",
    "open('x')",
    "eval('1')",
    "getattr(a, 'b')",
    "raw('a')",
    "raw(*a)",
    "abs(x=1)",
    "abs(**a)",
    "f'{a}'",
    "b'bytes'",
    "1j",
    "None",
    "...",
    "a[b]",
    "a[1:2]",
    "a['x']",
    "a[0, 1]",
    "a @ b",
    "a << 62",
    "a ** 9 ** 9",
    "a is b",
    "a in b",
    "a in range(3)",
    "*a",
    "import os",
    "a; b",
    "a = 1",
    "del a",
    "9" * 30,
    "nobody",
    "vehicle.colour",
    "vehicle.lat.real",
    "MAV_FRAME.NOWHERE",
    "_A_.__class__",
    "known(a)",
    "known(vehicle.lat, 1)",
    "maybe('vehicle.lat')",
    "stack(a)",
    "stack()",
    "listed('x')",
    "raw()",
    "raw(a, b)",
    "abs()",
    "abs(a, b)",
    "max(a)",
    "max(a, b, a)",
    "round(a, 1, b)",
    "",
    "   ",
    "(",
    "a +",
    "\x00",
]


@pytest.mark.parametrize("source", HOSTILE)
def test_what_is_not_on_the_list_is_refused(source: str) -> None:
    """When the rule is loaded, with the column; not when it runs."""
    with pytest.raises(ExpressionError) as refusal:
        Expression(source, NAMES)
    assert refusal.value.column >= 1
    assert str(refusal.value)


@pytest.mark.parametrize(
    ("source", "column", "words"),
    [
        ("1 + nobody", 5, "raw(nobody) or si(nobody)"),
        ("a < 2 and vehicle.colour", 11, "vehicle.lat"),
        ("abs(a) + open('x')", 10, "unknown function 'open'"),
        ("a + MAV_FRAME.NOWHERE", 5, "NOWHERE"),
        ("a ** 2", 1, "the operator Pow is not allowed"),
        ("a in 3", 6, "needs a list"),
        ("1 + max(a)", 5, "max() takes 2 values, not 1"),
    ],
)
def test_refusals_name_the_place(source: str, column: int, words: str) -> None:
    with pytest.raises(ExpressionError) as refusal:
        Expression(source, NAMES)
    assert refusal.value.column == column
    assert words in str(refusal.value)


def test_size_is_bounded() -> None:
    """A text that would overflow the stack of the compiler is refused as well."""
    for source in ("1+" * MAX_LENGTH + "1", "(" * 1500 + "1" + ")" * 400, "-" * 500 + "1"):
        with pytest.raises(ExpressionError):
            Expression(source, NAMES)
    assert compute("not " * (MAX_DEPTH // 2) + "True") is True


@given(st.text(max_size=60))
def test_any_text_compiles_or_is_refused(source: str) -> None:
    with contextlib.suppress(ExpressionError):
        Expression(source, NAMES)


@pytest.mark.parametrize("source", ["a & 1", "a[5]", "~a", "a + 'x'", "round(b, 'x')"])
def test_what_cannot_be_computed_is_said(source: str) -> None:
    """A bit mask of a float, an element that is not there: a mistake in the rule, no crash."""
    with pytest.raises(RuleFileError, match="cannot be computed"):
        compute(source, a=[1.5, 2.5], b=[1.0, 2.0])


# What it computes

NUMBERS = st.one_of(st.floats(-1e6, 1e6), st.integers(-1000, 1000), st.just(math.nan))
LEAVES = st.sampled_from(["a", "b", "c", "1.5", "0", "-3"])


def _numbers(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        inner.map(lambda x: f"abs({x})"),
        inner.map(lambda x: f"(-{x})"),
        st.tuples(_truths(inner), inner, inner).map(lambda t: f"({t[1]} if {t[0]} else {t[2]})"),
    )


def _truths(numbers: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    compare = st.sampled_from(["<", "<=", ">", ">=", "==", "!="])
    two = st.tuples(numbers, compare, numbers).map(lambda t: f"({t[0]} {t[1]} {t[2]})")
    three = st.tuples(numbers, compare, numbers, compare, numbers).map(
        lambda t: f"({t[0]} {t[1]} {t[2]} {t[3]} {t[4]})"
    )
    among = st.tuples(numbers, st.sampled_from(["in", "not in"])).map(
        lambda t: f"({t[0]} {t[1]} [0, 1.5, 7])"
    )
    return st.one_of(two, three, among)


NUMERIC = st.recursive(LEAVES, _numbers, max_leaves=6)
BOOLEAN = st.recursive(
    _truths(NUMERIC),
    lambda inner: st.one_of(
        inner.map(lambda x: f"(not {x})"),
        st.tuples(inner, st.sampled_from(["and", "or"]), inner).map(" ".join).map("({})".format),
    ),
    max_leaves=4,
)


@settings(max_examples=300)
@given(
    source=st.one_of(NUMERIC, BOOLEAN),
    rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=1, max_size=5),
)
def test_columns_are_what_python_computes_row_by_row(
    source: str, rows: list[tuple[float, float, float]]
) -> None:
    """Arithmetic, chained comparisons, and/or/not, in, conditions; NaN as in Python."""
    columns = {n: np.array(c, np.float64) for n, c in zip("abc", zip(*rows))}
    found = np.broadcast_to(Expression(source, NAMES)(Columns(**columns)), len(rows))
    expected = [
        eval(source, {"__builtins__": {"abs": abs}}, dict(zip("abc", map(float, row))))
        for row in rows
    ]
    assert np.allclose(found.astype(float), np.array(expected, float), rtol=1e-12, equal_nan=True)


@given(
    a=st.lists(st.integers(-(2**40), 2**40), min_size=1, max_size=5),
    b=st.integers(1, 2**20),
    shift=st.integers(0, 30),
)
def test_bits(a: list[int], b: int, shift: int) -> None:
    found = compute(f"(a & {b}) + (a | {b}) + (a ^ {b}) + ~a", a=a)
    assert found == [(x & b) + (x | b) + (x ^ b) + ~x for x in a]
    assert compute(f"a >> {shift}", a=a) == [x >> shift for x in a]
    assert compute(f"a // {b} + a % {b}", a=a) == [x // b + x % b for x in a]


def test_nan_is_nothing() -> None:
    """It is neither less nor more than anything, nor itself, nor in a list."""
    for source in ("a < 1", "a > 1", "a == a", "a in [a]", "0 < a < 9", "isfinite(a)"):
        assert compute(source, a=[math.nan]) == [False]
    assert compute("a != a", a=[math.nan]) == [True]
    assert compute("not (a < 1)", a=[math.nan]) == [True]


def test_a_division_by_zero_is_no_crash() -> None:
    assert compute("1 / a", a=[0.0, 2.0]) == [math.inf, 0.5]


def test_texts() -> None:
    assert compute("a == 'px4'", a=["px4", "ardusub"]) == [True, False]
    assert compute("a in ['px4', 'arducopter']", a=["px4", "ardusub"]) == [True, False]


def test_elements_of_arrays() -> None:
    assert compute("a[0] + a[2]", a=[[1, 2, 3], [4, 5, 6]]) == [4, 10]
    assert compute("some(a > 2)", a=[[1, 2], [2, 3]]) == [False, True]
    assert compute("every(a > 1)", a=[[1, 2], [2, 3]]) == [False, True]
    assert compute("norm(a)", a=[[3.0, 4.0]]) == [5.0]
    assert compute("smallest(a)", a=[[math.nan, 4.0, 3.0]]) == [3.0]


def test_constants_have_names() -> None:
    assert compute("MAV_FRAME.LOCAL_NED") == 1
    assert compute("MAV_CMD.NAV_WAYPOINT + 1") == 17


def test_what_an_expression_needs() -> None:
    """Names, context, context it asks about, context it can do without."""
    source = "a > 1 and raw(lat) > vehicle.lat and known(home.lat) and maybe(vehicle.yaw) > 0"
    expression = Expression(source, NAMES)
    assert expression.used_names == {"a"}
    assert expression.contexts == {"vehicle.lat"}
    assert expression.tested == {"home.lat"}
    assert expression.hoped == {"vehicle.yaw"}


def test_known() -> None:
    assert compute("known(home.lat)", home_lat=[1.0, math.nan]) == [True, False]
    families = ["px4", "unknown"]
    assert compute("known(vehicle.autopilot)", vehicle_autopilot=families) == [True, False]


def test_a_function_writes_to_no_column() -> None:
    """Numpy's own would take an array to write to."""
    columns = Columns(a=[5.0], b=[1.0])
    Expression("max(a, b) + abs(-a)", NAMES)(columns)
    assert columns.name("a").tolist() == [5.0]
