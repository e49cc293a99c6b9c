"""Nothing that a log says can move a cursor, hide text or break a line."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.report.escape import sentence, terminal, utf8


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain text, \u00e9t\u00e9 \u6771\u4eac", "plain text, \u00e9t\u00e9 \u6771\u4eac"),
        ("\x1b[2J\x1b]0;title\x07", r"\x1b[2J\x1b]0;title\x07"),
        ("a\r\nb\tc\x00", r"a\r\nb\tc\x00"),
        ("\x9b31m\x7f", r"\x9b31m\x7f"),
        ("\u202egnp.exe\u2066\u2069", r"\u202egnp.exe\u2066\u2069"),
        ("a\u200b\u2060\ufeffb", r"a\u200b\u2060\ufeffb"),
        ("a\u2028b\u2029\x85", r"a\u2028b\u2029\x85"),
        ("\U000e0041 tag", r"\U000e0041 tag"),
        ("name\udcff.tlog", r"name\xff.tlog"),
        ("\ud800", r"\ud800"),
    ],
)
def test_hostile_text_is_shown_and_not_obeyed(text: str, expected: str) -> None:
    """Control, bidirectional and invisible characters become escapes; letters stay."""
    assert terminal(text) == expected


@given(st.text(st.characters(categories=None)))
def test_nothing_invisible_is_left(text: str) -> None:
    """No text at all gets an invisible character through."""
    hidden = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
    assert not {unicodedata.category(c) for c in terminal(text)} & hidden
    assert "\n" not in sentence(text)


@given(st.text(st.characters(categories=None)))
def test_utf8_text_can_always_be_encoded(text: str) -> None:
    """What JSON writes is UTF-8, whatever a file is called."""
    utf8(text).encode()
