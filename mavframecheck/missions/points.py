"""Mission Planner's files of bare points: fences (`.fen`), polygons (`.poly`) and rally points (`.ral`).

A line of a fence or polygon is latitude and longitude; both end where they began, but a fence has the return
point before that. A line of a rally file is ``RALLY latitude longitude altitude break-altitude direction flags``.
Lines that begin with # say nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import islice

from mavframecheck.missions.planned import FENCE, RALLY, Item, Places, Planned, Said, bounded
from mavframecheck.missions.text import Text
from mavframecheck.semantics.constants import constant

_MOST_WORDS = 8
"""Words of a line that are looked at."""
_LINE = re.compile(r"[^\r\n]+")
_WORD = re.compile(r"[^ \t,]+")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_CORNER = constant("MAV_CMD.NAV_FENCE_POLYGON_VERTEX_INCLUSION")
_RETURN = constant("MAV_CMD.NAV_FENCE_RETURN_POINT")
_RALLY = constant("MAV_CMD.NAV_RALLY_POINT")
_GLOBAL = constant("MAV_FRAME.GLOBAL")
_ABOVE_HOME = constant("MAV_FRAME.GLOBAL_RELATIVE_ALT")


def read_points(text: Text) -> Planned:
    """Return the fence of a file of points: its return point, if it has one, and its corners."""
    corners = (_point(text, words, _CORNER, FENCE, _GLOBAL) for words in _lines(text))
    points = list(bounded(text, corners))
    has_return = (
        len(points) > 2 and _same(points[1], points[-1]) and not _same(points[0], points[-1])
    )
    ahead = [points.pop(0)._replace(command=_RETURN)] if has_return else []
    if len(points) > 1 and _same(points[0], points[-1]):
        points.pop()  # the corner that closes the line is the first one again
    params = (float(len(points)), 0.0, 0.0, 0.0)
    return Planned("points", text, ahead + [each._replace(params=params) for each in points])


def read_rally(text: Text) -> Planned:
    """Return the rally points of a file."""
    return Planned("rally", text, list(bounded(text, _rally_points(text))))


def _rally_points(text: Text) -> Iterator[Item]:
    for words in _lines(text):
        if words[0][0] != "RALLY":
            text.fail(words[0].start(), "a line of a rally file begins with RALLY")
        if len(words) < 4:
            text.fail(words[-1].end(), "latitude, longitude and altitude belong behind RALLY")
        point = _point(text, words[1:3], _RALLY, RALLY, _ABOVE_HOME)
        z, at = _number(text, words[3]), words[3].start()
        yield point._replace(z=z, places=point.places._replace(z=at))


def _lines(text: Text) -> Iterator[list[re.Match[str]]]:
    """Yield the words of each line that says something."""
    for line in _LINE.finditer(text.content):
        words = list(islice(_WORD.finditer(text.content, line.start(), line.end()), _MOST_WORDS))
        if words and not words[0][0].startswith("#"):
            yield words


def _point(text: Text, words: list[re.Match[str]], command: int, kind: int, frame: int) -> Item:
    if len(words) != 2:
        text.fail(words[-1].end(), f"{len(words)} columns where latitude and longitude belong")
    x, y = (word.start() for word in words)
    return Item(
        mission_type=kind,
        command=command,
        frame=frame,
        params=(0.0, 0.0, 0.0, 0.0),
        x=_number(text, words[0]),
        y=_number(text, words[1]),
        z=0.0,
        places=Places(x, words[1].end(), x=x, y=y),
        said=Said(x_decimals=text.decimals(x), y_decimals=text.decimals(y)),
    )


def _number(text: Text, word: re.Match[str]) -> float:
    if not _NUMBER.fullmatch(word[0]) or math.isinf(float(word[0])):
        text.fail(word.start(), f"{word[0][:40]!r} is no number")
    return float(word[0])


def _same(one: Item, other: Item) -> bool:
    return (one.x, one.y) == (other.x, other.y)
