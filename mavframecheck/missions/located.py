"""JSON whose values know where they stand: the standard library and msgspec give values without places.

Strict (RFC 8259), and stricter where a mission could be read in two ways: a key that comes twice in one
object is an error, and so is a number that no double holds. Depth and size are bounded. A match of one
pattern takes a whole member, from its key to the comma behind it: that is five times as fast as reading
token by token. Objects without others inside, as most are, the standard library reads, faster still; where
their members stand is worked out when somebody asks, and where it has the least doubt it is not followed.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any, NoReturn, Self, TypeAlias

from mavframecheck.missions.text import Text, decimals_of

MOST_VALUES = 1_500_000
"""Values of one file; 65 535 items with all that QGroundControl writes of them have fewer."""
DEEPEST = 60
"""Objects and arrays inside each other; a plan has six."""
LONGEST_NUMBER = 400
"""Characters of a number; a double written out in full has at most 330."""

_SPACE = r"[ \t\n\r]*+"
_NUMBER = r"-?(?:0|[1-9][0-9]*+)(?:\.[0-9]++)?(?:[eE][+-]?[0-9]++)?"
_STRING = r'"((?:[^"\\\x00-\x1f]++|\\.)*+)"'
_MEMBER = re.compile(
    rf"{_SPACE}(?:{_STRING}{_SPACE}:{_SPACE})?"
    rf"(?:({_NUMBER})|{_STRING}|(true|false|null)|([\[{{]))"
    rf"((?:{_SPACE}[\]}}])*+){_SPACE}(,?)"
)
_KEY = re.compile(rf"{_SPACE}{_STRING}{_SPACE}:")
_BEHIND = re.compile(rf"((?:{_SPACE}[\]}}])*+){_SPACE}(,?)")
_BLANK = re.compile(_SPACE)
_WORD = re.compile(r"[-+\w.]*")
_CONSTANTS = {"true": True, "false": False, "null": None}


class Written(float):
    """A number with a fraction or exponent, which knows how it is written."""

    __slots__ = ("word",)
    word: str

    def __new__(cls, word: str) -> Self:
        """Read `word`; ValueError where no double holds it, or nobody would write it so."""
        number = super().__new__(cls, word)
        if len(word) > LONGEST_NUMBER or not math.isfinite(number):
            raise ValueError(word)
        number.word = word
        return number


class Object(dict[str, "Value"]):
    """A JSON object: `at` holds the offset of each value, `begin` and `end` are its own.

    Of one that the standard library read, `at` is worked out when somebody asks.
    """

    __slots__ = ("at", "begin", "end", "text")
    text: Text

    def __init__(self, begin: int) -> None:
        """Start empty at offset `begin`."""
        super().__init__()
        self.begin = self.end = begin
        self.at: dict[str, int] = {}

    @classmethod
    def quick(cls, pairs: list[tuple[str, Any]]) -> Object:
        """Return the object of some members without their places; ValueError where they need a closer look."""
        box = cls.__new__(cls)
        box.update(pairs)
        if len(box) != len(pairs):
            raise ValueError("a key stands twice")
        for key, value in pairs:
            if type(value) is list:
                box[key] = Array.quick(value, box)
        return box

    def __getattr__(self, name: str) -> Any:
        """Work out where the members stand."""
        if name != "at":
            raise AttributeError(name)
        here = self.begin
        found = parse(Text("", self.text.content[here : self.end]), quick=False)
        if isinstance(found, Object):
            self.at = {key: at + here for key, at in found.at.items()}
            for key, value in found.items():
                mine = self[key]
                if isinstance(value, Array) and isinstance(mine, Array):
                    mine.begin, mine.end = value.begin + here, value.end + here
                    mine.at = [at + here for at in value.at]
        return self.at


class Array(list["Value"]):
    """A JSON array: `at` holds the offset of each value, `begin` and `end` are its own.

    Of one that the standard library read, they are worked out when somebody asks.
    """

    __slots__ = ("at", "begin", "end", "inside")
    inside: Object

    def __init__(self, begin: int) -> None:
        """Start empty at offset `begin`."""
        super().__init__()
        self.begin = self.end = begin
        self.at: list[int] = []

    @classmethod
    def quick(cls, values: list[Any], inside: Object) -> Array:
        """Return the array of some values inside an object; ValueError where others are inside it."""
        box = cls.__new__(cls)
        box.extend(values)
        if list in map(type, values):
            raise ValueError("an array in an array")
        box.inside = inside
        return box

    def __getattr__(self, name: str) -> Any:
        """Work out where it stands, with the object that it is in."""
        if name not in ("at", "begin", "end"):
            raise AttributeError(name)
        _ = self.inside.at
        return getattr(self, name)


Value: TypeAlias = Object | Array | str | int | float | bool | None


def parse(text: Text, *, quick: bool = True) -> Value:
    """Return the value that `text` is; MissionError where it is no JSON, ambiguous or too large.

    With `quick` the standard library reads the objects that hold no others.
    """
    content, take = text.content, _MEMBER.match
    _bound(text)
    root = Array(0)
    opened: list[Object | Array] = [root]
    box: Object | Array = root
    here = 0
    while box is not root or not root:
        match = take(content, here)
        if match is None:
            _refuse(text, here)
        _, number, string, word, opening, closing, comma = match.groups()
        here, closes = match.end(), match.start(6)
        value: Value
        if number is not None:
            at = match.start(2)
            short = len(number) < 18 and number.isdigit()
            value = int(number) if short else _number(text, number, at)
        elif string is not None:
            at = match.start(3) - 1
            value = string if "\\" not in string else _unescaped(text, string, at)
        elif word is not None:
            at, value = match.start(4), _CONSTANTS[word]
        else:
            at = match.start(5)
            flat = _flat(text, at) if quick and opening == "{" and not closing else None
            value = flat or (Object(at) if opening == "{" else Array(at))
            if flat is not None and (behind := _BEHIND.match(content, flat.end)):
                opening, closing, comma = None, *behind.groups()
                here, closes = behind.end(), behind.start(1)
        _put(text, box, match, value, at)
        if opening is not None and isinstance(value, Object | Array):
            opened.append(value)
            if len(opened) > DEEPEST:
                text.fail(at, f"more than {DEEPEST} levels of nesting: this is no mission")
        if closing:
            _close(text, opened, closing, closes)
        box = opened[-1]
        if (comma == "") != (box is root or (opening is not None and not closing)):
            _wrong_comma(text, opened, here, comma)
    if here < len(content):
        text.fail(here, "the JSON has ended before this: remove what follows")
    return root[0]


def _flat(text: Text, at: int) -> Object | None:
    """Return the object at an offset as the standard library reads it, None where it may hold others or be wrong."""
    content = text.content
    close = content.find("}", at)
    if close < 0 or content.find("{", at + 1, close) >= 0:
        return None
    try:
        box, end = _STANDARD.raw_decode(content, at)
    except (ValueError, RecursionError):
        return None
    if end != close + 1:
        return None
    box.begin, box.end, box.text = at, end, text
    return box if isinstance(box, Object) else None


def _whole(word: str) -> int:
    """Read a whole number; ValueError where it needs a closer look."""
    if len(word) > 17:
        raise ValueError(word)
    return int(word)


def _refused(word: str) -> NoReturn:
    """Refuse NaN and Infinity, which the standard library knows."""
    raise ValueError(word)


_STANDARD = json.JSONDecoder(
    object_pairs_hook=Object.quick, parse_float=Written, parse_int=_whole, parse_constant=_refused
)


def _bound(text: Text) -> None:
    """Fail before a text that could hold too many values is read: each but the first needs one of these."""
    most = sum(map(text.content.count, ",[{"))
    if most > MOST_VALUES:
        text.fail(0, f"more than {MOST_VALUES} values: this is no mission")


def _put(text: Text, box: Object | Array, match: re.Match[str], value: Value, at: int) -> None:
    """Add a member to the object or array that is open."""
    key = match[1]
    if isinstance(box, Array):
        if key is not None:
            text.fail(match.start(1), "a key in an array: only objects, in braces, have keys")
        box.append(value)
        box.at.append(at)
        return
    if key is None:
        if _KEY.match(text.content, match.start()):
            _refuse(text, match.start())
        text.fail(at, 'here belongs a key in double quotes, such as "items"')
    if "\\" in key:
        key = _unescaped(text, key, match.start(1) - 1)
    if key in box:
        line = text.place(box.at[key])[0]
        problem = f'"{key[:40]}" stands twice in one object (first in line {line}): remove one'
        text.fail(match.start(1) - 1, problem)
    box[key] = value
    box.at[key] = at


def _close(text: Text, opened: list[Object | Array], closing: str, begin: int) -> None:
    """Take what the closing brackets behind a member, at an offset, close off `opened`."""
    for at, bracket in enumerate(closing, begin):
        if bracket not in "]}":
            continue
        box = opened.pop()
        if not opened or isinstance(box, Object) != (bracket == "}"):
            text.fail(at, f"{bracket} closes nothing that is open here")
        box.end = at + 1


def _wrong_comma(text: Text, opened: list[Object | Array], at: int, comma: str) -> NoReturn:
    """Say what is wrong behind a member that ends at an offset: a comma too many, or none."""
    if comma:
        text.fail(at - 1, "a comma where none belongs: remove it")
    if at >= len(text.content):
        text.fail(at, "the file ends in the middle: it was cut off")
    box = opened[-1]
    line = text.place(box.begin)[0]
    opening, closing = "{}" if isinstance(box, Object) else "[]"
    text.fail(
        at, f"here belongs a comma, or the {closing} that closes the {opening} of line {line}"
    )


def _number(text: Text, word: str, at: int) -> int | float:
    if len(word) > LONGEST_NUMBER:
        text.fail(at, f"a number of {len(word)} characters: this is no mission")
    if word.removeprefix("-").isdigit() and math.isfinite(float(word)):
        return int(word)
    try:
        return Written(word)
    except ValueError:
        text.fail(at, f"{word[:40]} is larger than any number: correct it")


def _unescaped(text: Text, written: str, at: int) -> str:
    """Return what a string with escapes says."""
    try:
        return str(json.loads(f'"{written}"'))
    except json.JSONDecodeError as error:
        text.fail(at + error.pos, f"no string of JSON: {error.msg}")


def _refuse(text: Text, here: int) -> NoReturn:
    """Say what is wrong where a member belongs."""
    key = _KEY.match(text.content, here)
    blank = _BLANK.match(text.content, key.end() if key else here)
    at = blank.end() if blank else here
    if at >= len(text.content):
        text.fail(at, "the file ends in the middle: it was cut off")
    word = _WORD.match(text.content, at)
    written = (word[0] if word else "") or text.content[at]
    if written in "]}":
        text.fail(at, f"a value belongs between the comma or colon before this and the {written}")
    if written == '"':
        text.fail(at, "a string that does not end on its line, or holds a control character")
    if written.strip("-+").lower() in ("nan", "inf", "infinity"):
        text.fail(at, f"{written} is no JSON: write null for a number that is not set")
    text.fail(at, f"{written[:40]!r} is no JSON")


class Members:
    """A JSON object whose members must have certain types: MissionError says which does not, and where."""

    def __init__(self, text: Text, value: Value, at: int, called: str) -> None:
        """Read `value`, which stands at offset `at` of `text` and is `called` so in errors."""
        if not isinstance(value, Object):
            text.fail(at, f"{called} must be an object, in braces")
        self.text = text
        self.box = value
        self._called = called

    def _need(self, key: str) -> Value:
        if key not in self.box:
            self.text.fail(self.box.begin, f'{self._called} must have "{key}"')
        return self.box[key]

    def inner(self, key: str) -> Members:
        """Return an object."""
        value = self._need(key)
        return Members(self.text, value, self.box.at[key], f'"{key}"')

    def array(self, key: str, lengths: tuple[int, ...] = ()) -> Array:
        """Return an array, of one of the `lengths` if any are given."""
        value = self._need(key)
        if not isinstance(value, Array) or (lengths and len(value) not in lengths):
            _wrong_array(self.text, value, self.box.at[key], f'"{key}"', lengths)
        return value

    def objects(self, key: str, called: str) -> Iterator[Members]:
        """Yield the objects of an array, which may be missing."""
        if key in self.box:
            array = self.array(key)
            for value, at in zip(array, array.at, strict=True):
                yield Members(self.text, value, at, called)

    def number(self, key: str, default: float | None = None) -> float:
        """Return a number, null as NaN, a missing one as `default`; without that it must be there."""
        if default is not None and key not in self.box:
            return default
        number = _as_number(self._need(key))
        if number is None:
            self.text.fail(self.box.at[key], f'"{key}" must be a number or null')
        return number

    def whole(self, key: str, most: int) -> int:
        """Return a whole number from 0 to `most`."""
        number = self.number(key)
        if not (0 <= number <= most and number == int(number)):
            self.text.fail(self.box.at[key], f'"{key}" must be a whole number from 0 to {most}')
        return int(number)


def numbers(text: Text, array: Array) -> list[float]:
    """Return the numbers of an array, null as NaN."""
    found = []
    for k, value in enumerate(array):
        number = _as_number(value)
        if number is None:
            text.fail(array.at[k], f"value {k + 1} must be a number or null")
        found.append(number)
    return found


def decimals(value: Value) -> float:
    """Return how many digits follow the decimal point of a number as it is written; NaN of what is none."""
    if isinstance(value, Written):
        return decimals_of(value.word)
    return 0.0 if type(value) is int else math.nan


def arrays(text: Text, array: Array, lengths: tuple[int, ...]) -> Iterator[Array]:
    """Yield the arrays in an array, each of one of the `lengths`."""
    for value, at in zip(array, array.at, strict=True):
        if not isinstance(value, Array) or len(value) not in lengths:
            _wrong_array(text, value, at, "this", lengths)
        yield value


def _wrong_array(
    text: Text, value: Value, at: int, called: str, lengths: tuple[int, ...]
) -> NoReturn:
    """Say what a value must be that is no array of one of the `lengths`."""
    if not isinstance(value, Array):
        text.fail(at, f"{called} must be an array, in brackets")
    words = " or ".join(str(length) for length in lengths)
    text.fail(at, f"{called} must hold {words} values, not {len(value)}")


def _as_number(value: Value) -> float | None:
    """Return a number, null as NaN; None of what is neither."""
    if isinstance(value, float) or type(value) is int:
        return float(value)
    return math.nan if value is None else None
