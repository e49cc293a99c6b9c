"""Texts of rule files, filled in from the first row."""

from __future__ import annotations

import math
from typing import Any

import pytest

from mavframecheck.engine.expression import ExpressionError, RuleFileError
from mavframecheck.engine.template import Template
from tests.engine.test_expression import NAMES, Columns


def fill(text: str, **columns: Any) -> str:
    """Fill in a text."""
    return Template(text, NAMES).fill(Columns(**columns))


@pytest.mark.parametrize(
    ("text", "filled"),
    [
        ("plain", "plain"),
        ("", ""),
        ("{{a}}", "{a}"),
        ("a is {a}", "a is 1.5"),
        ("{a:.3f} m", "1.500 m"),
        ("{a * 2:g}, {b}", "3, 7"),
        ("{'x' if a > 1 else 'y'}", "x"),
        ("{c}", "[1, 2]"),
        ("{raw(b)}", "7"),
        ("{b:>4}", "   7"),
    ],
)
def test_filled(text: str, filled: str) -> None:
    assert fill(text, a=[1.5, 9.0], b=[7, 8], c=[[1, 2], [3, 4]]) == filled


def test_numbers_get_the_digits_they_need() -> None:
    """Without a format: no 0.30000000000000004, no lost degree of a degE7."""
    assert fill("{a}", a=[0.1 + 0.2]) == "0.3"
    assert fill("{a}", a=[47.3977421]) == "47.3977421"
    assert fill("{a}", a=[math.nan]) == "nan"


def test_text_of_a_log_stays_text() -> None:
    """Braces in it are not filled in again, bytes that are no UTF-8 are replaced."""
    assert fill("{a}", a=np_bytes(b"{b}\xff")) == "{b}\ufffd"


def np_bytes(value: bytes) -> list[bytes]:
    """Return a column of one text."""
    return [value]


@pytest.mark.parametrize("text", ["{a", "a}", "{a + }", "{nobody}", "{__import__('os')}", "{}"])
def test_refused(text: str) -> None:
    with pytest.raises(ExpressionError) as refusal:
        Template(text, NAMES)
    assert refusal.value.column >= 1


def test_a_format_that_does_not_fit() -> None:
    with pytest.raises(RuleFileError, match="cannot be written as 'd'"):
        fill("{a:d}", a=[1.5])


def test_evidence_keeps_the_type_of_a_lone_value() -> None:
    """JSON gets a number where the text is one expression, a text otherwise; never NaN."""
    columns = Columns(a=[1.5], b=[7], c=[math.nan])
    assert Template("{a}", NAMES).value(columns) == 1.5
    assert Template("{b}", NAMES).value(columns) == 7
    assert Template("{a > 1}", NAMES).value(columns) is True
    assert Template("{a} m", NAMES).value(columns) == "1.5 m"
    assert Template("{a:.2f}", NAMES).value(columns) == "1.50"
    assert Template("{c}", NAMES).value(columns) == "nan"
    assert Template("", NAMES).value(columns) == ""
