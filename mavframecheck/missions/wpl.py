"""Waypoint files, `QGC WPL 110` and `120`: a line an item, twelve columns.

In version 110 the first item is home, as ArduPilot numbers them; in 120 there is none. Tabs and spaces both
separate, empty lines and those that begin with # say nothing. Sources: MAVLink developer guide, "File
Formats"; the readers of QGroundControl, Mission Planner and pymavlink.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import partial
from itertools import islice
from typing import Final, NoReturn

from mavframecheck.missions.planned import (
    FENCE,
    MISSION,
    RALLY,
    Home,
    Item,
    LaterPlaces,
    Places,
    Planned,
    Said,
    bounded,
)
from mavframecheck.missions.text import Text, decimals_of
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import AltRef
from mavframecheck.semantics.mavframe import FRAMES

COLUMNS: Final = (
    *("number", "current", "frame", "command", "param1", "param2", "param3", "param4"),
    *("latitude", "longitude", "altitude", "autocontinue"),
)
_MOST_WORDS = len(COLUMNS) + 1
"""Words of a line that are looked at."""
_VERSIONS = {"110": True, "120": False}
"""Version -> whether the first item is home."""
_HEADER = re.compile(r"\s*QGC[ \t]+WPL[ \t]+(\S+)[^\r\n]*")
_LINE = re.compile(r"[^\r\n]+")
_WORD = re.compile(r"[^ \t]+")
_NUMBER = re.compile(
    r"[-+]?(?:(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:e[-+]?[0-9]++)?|nan)", re.IGNORECASE
)
_ROW = re.compile(
    r"[ \t]*" + r"[ \t]+".join([f"({_NUMBER.pattern})"] * len(COLUMNS)) + r"[ \t]*", re.IGNORECASE
)
_WHOLE = {0: 65_535, 1: 255, 2: 255, 3: 65_535, 11: 255}
"""Column -> largest value, of the columns that hold whole numbers."""
_WAYPOINT = constant("MAV_CMD.NAV_WAYPOINT")
_ABOVE_SEA = frozenset(facts.id for facts in FRAMES if facts.alt_ref is AltRef.MSL)
_KINDS = {
    **{
        constant(f"MAV_CMD.NAV_FENCE_{name}"): FENCE
        for name in (
            *("RETURN_POINT", "POLYGON_VERTEX_INCLUSION", "POLYGON_VERTEX_EXCLUSION"),
            *("CIRCLE_INCLUSION", "CIRCLE_EXCLUSION"),
        )
    },
    constant("MAV_CMD.NAV_RALLY_POINT"): RALLY,
}


def read_wpl(text: Text) -> Planned:
    """Return the items of a waypoint file; MissionError names line and column of what is none."""
    header = _HEADER.match(text.content)
    version = header[1] if header else ""
    if header is None or version not in _VERSIONS:
        text.fail(
            0, f"version {version[:20]} of waypoint files is not known here, only 110 and 120"
        )
    planned = Planned("wpl", text, list(bounded(text, _items(text, header.end()))))
    if _VERSIONS[version] and planned.items:
        planned.home = _home(planned.items[0])
    return planned


def _home(first: Item) -> Home | None:
    """Return home, if the first item can be it; a height of 0 is one that nobody filled in."""
    placed = first.command == _WAYPOINT and first.mission_type == MISSION
    if not placed or first.x == first.y == 0 or math.isnan(first.x + first.y):
        return None
    told = first.frame in _ABOVE_SEA and first.z != 0
    return Home(first.x, first.y, first.z if told else math.nan, first.places.item)


def _items(text: Text, begin: int) -> Iterator[Item]:
    for line in _LINE.finditer(text.content, begin):
        row = _ROW.fullmatch(text.content, line.start(), line.end())
        if row is not None:
            yield _item(text, row)
            continue
        words = list(islice(_WORD.finditer(text.content, line.start(), line.end()), _MOST_WORDS))
        if words and not words[0][0].startswith("#"):
            _refuse(text, words)


def _item(text: Text, row: re.Match[str]) -> Item:
    """Return the item of a line."""
    written = row.groups()
    v = [float(word) for word in written]
    for column, most in _WHOLE.items():
        if not (0 <= v[column] <= most and v[column] == int(v[column])):
            problem = f"{COLUMNS[column]} must be a whole number from 0 to {most}"
            text.fail(row.start(column + 1), problem)
    if math.inf in map(abs, v):
        column = [*map(abs, v)].index(math.inf)
        _no_number(text, row.start(column + 1), COLUMNS[column], written[column])
    return Item(
        mission_type=_KINDS.get(int(v[3]), MISSION),
        command=int(v[3]),
        frame=int(v[2]),
        params=(v[4], v[5], v[6], v[7]),
        x=v[8],
        y=v[9],
        z=v[10],
        places=LaterPlaces(partial(_places, row)),
        current=int(v[1]),
        autocontinue=int(v[11]),
        said=Said(
            x_decimals=decimals_of(written[8]), y_decimals=decimals_of(written[9]), number=v[0]
        ),
    )


def _places(row: re.Match[str]) -> Places:
    """Return where an item and its parts stand."""
    at = [row.start(1 + column) for column in range(len(COLUMNS))]
    return Places(at[0], row.end(len(COLUMNS)), at[3], at[2], *at[4:11])


def _refuse(text: Text, words: list[re.Match[str]]) -> NoReturn:
    """Fail at what makes the words of a line no item."""
    if len(words) != len(COLUMNS):
        _wrong_columns(text, words)
    wrong = next(k for k, word in enumerate(words) if not _NUMBER.fullmatch(word[0]))
    _no_number(text, words[wrong].start(), COLUMNS[wrong], words[wrong][0])


def _no_number(text: Text, at: int, name: str, written: str) -> NoReturn:
    hint = ": write a point, not a comma" if "," in written else ""
    text.fail(at, f"{name} is {written[:40]!r}, which is no number{hint}")


def _wrong_columns(text: Text, words: list[re.Match[str]]) -> NoReturn:
    """Fail at the first word that is no number, at the end of a short line, or at the first word too many."""
    for word in words:
        if not _NUMBER.fullmatch(word[0]):
            text.fail(word.start(), f"{word[0][:40]!r} is no number")
    if len(words) < len(COLUMNS):
        missing = ", ".join(COLUMNS[len(words) :])
        text.fail(words[-1].end(), f"{len(words)} columns where 12 belong: {missing} missing")
    text.fail(words[len(COLUMNS)].start(), "more than 12 columns")
