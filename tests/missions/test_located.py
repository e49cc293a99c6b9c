"""JSON with places: the same values as the standard library's, and where each stands."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.missions.located import (
    DEEPEST,
    MOST_VALUES,
    Array,
    Object,
    Value,
    decimals,
    parse,
)
from mavframecheck.missions.text import MissionError, Text, decode

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**20), 10**20)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=30,
)
FRAGMENTS = st.text(st.sampled_from('[]{},:"0123.-eE \n\\ntruefalsenull\x00'), max_size=30)


def strict(written: str) -> Any:
    """Return what the standard library reads; ValueError also for what it is lenient about."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) != len(pairs):
            raise ValueError
        return dict(pairs)

    def no_constant(_: str) -> Any:
        raise ValueError

    value = json.loads(written, object_pairs_hook=once, parse_constant=no_constant)
    if "inf" in repr(value) and float("inf") in leaves(value):
        raise ValueError
    return value


def leaves(value: Any) -> list[Any]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [leaf for each in value for leaf in leaves(each)]
    return [abs(value)] if isinstance(value, float) else []


@given(VALUES, st.sampled_from([None, 1, 4]), st.booleans())
def test_values_are_those_of_the_standard_library(
    value: Any, indent: int | None, ascii_only: bool
) -> None:
    written = json.dumps(value, indent=indent, ensure_ascii=ascii_only)
    assert parse(Text("f", written)) == value


@given(FRAGMENTS)
def test_refuses_what_the_standard_library_refuses(written: str) -> None:
    try:
        expected = strict(written)
    except (ValueError, RecursionError):
        with pytest.raises(MissionError, match=r"^f, line \d+, column \d+: "):
            parse(Text("f", written))
    else:
        assert parse(Text("f", written)) == expected


def places(value: Value, at: int) -> list[tuple[int, Value]]:
    """Return every value with its place."""
    inner: list[tuple[int, Value]] = []
    if isinstance(value, Object):
        inner = [(value.at[key], each) for key, each in value.items()]
    elif isinstance(value, Array):
        inner = list(zip(value.at, value, strict=True))
    return [(at, value), *(pair for place, each in inner for pair in places(each, place))]


@given(VALUES, st.sampled_from([None, 3]))
def test_every_value_stands_where_it_says(value: Any, indent: int | None) -> None:
    written = json.dumps(value, indent=indent)
    found = parse(Text("f", written))
    for at, each in places(found, 0):
        assert json.JSONDecoder().raw_decode(written, at)[0] == each
        if isinstance(each, Object | Array):
            assert written[each.begin] in "[{"
            assert json.loads(written[each.begin : each.end]) == each


FLAT = st.dictionaries(
    st.text(max_size=3),
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=4)
    | st.lists(VALUES),
)


@given(st.lists(FLAT, max_size=4), st.sampled_from([None, 3]))
def test_the_quick_way_and_the_slow_one(value: Any, indent: int | None) -> None:
    """They read and refuse the same, and know the same places, in whatever order they are asked for."""
    text = Text("f", json.dumps(value, indent=indent))
    results = []
    for quick in (True, False):
        try:
            results.append(places(parse(text, quick=quick), 0))
        except MissionError as error:
            results.append([(0, str(error))])
    assert results[0] == results[1]


def test_an_array_is_asked_before_its_object() -> None:
    """Objects that are read the quick way know where their arrays are."""
    found = parse(Text("f", '[{"a": 1, "b": [2, 3.50]}]'))
    assert isinstance(found, Array)
    box = found[0]
    assert isinstance(box, Object)
    inner = box["b"]
    assert isinstance(inner, Array)
    assert (inner.at, inner.begin, inner.end) == ([16, 19], 15, 24)
    assert [decimals(value) for value in inner] == [0.0, 2.0]
    assert box.at == {"a": 7, "b": 15}


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ('{"a": 1,\n "a": 2}', 'line 2, column 2: "a" stands twice in one object (first in line 1)'),
        ('{"a": 1,\n "\\u0061": 2}', 'line 2, column 2: "a" stands twice'),
        ("[1,\r\n NaN]", "line 2, column 2: NaN is no JSON: write null"),
        ('{"a": nan}', "line 1, column 7: nan is no JSON"),
        ('{"a":}', "column 6: a value belongs between the comma or colon before this and the }"),
        ("[-Infinity]", "line 1, column 2: -Infinity is no JSON"),
        ("[1e999]", "1e999 is larger than any number"),
        (f"[{'9' * 5000}]", "a number of 5000 characters"),
        (f"[{'9' * 350}.0]", "larger than any number"),
        ("[" * (DEEPEST + 5), "levels of nesting"),
        ('{"a":' * (DEEPEST + 5), "levels of nesting"),
        ('{"a": [1, 2', "the file ends in the middle"),
        ('{"a": 1} x', "line 1, column 10: the JSON has ended before this"),
        ('{"a" 1}', "here belongs a key"),
        ("{'a': 1}", "\"'\" is no JSON"),
        ("[1, 2,]", "between the comma or colon before this and the ]"),
        ('["a\nb"]', "a string that does not end on its line"),
        ("[1 2]", "here belongs a comma, or the ] that closes the [ of line 1"),
        ("[1}", "} closes nothing that is open here"),
    ],
)  # fmt: skip
def test_says_what_is_wrong_and_where(written: str, words: str) -> None:
    with pytest.raises(MissionError) as error:
        parse(Text("f", written))
    assert words in str(error.value)
    assert len(str(error.value)) < 200


def test_too_many_values_are_refused_before_they_are_read() -> None:
    with pytest.raises(MissionError, match="more than 1500000 values"):
        parse(Text("f", "[" + "1," * (MOST_VALUES + 1) + "1]"))


def test_bytes_that_are_no_utf8_are_named() -> None:
    with pytest.raises(MissionError, match="line 2, column 3: byte 0xff is not UTF-8"):
        decode("f", b"{\n  \xff")
    assert decode("f", b"\xef\xbb\xbf{}").content == "{}"
    with pytest.raises(MissionError, match="more than 32 MB"):
        decode("f", bytes(33 * 1024 * 1024))
