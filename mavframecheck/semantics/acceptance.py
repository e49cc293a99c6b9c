"""What each autopilot does with a frame, a mask or a value, as data (`accepts/*.toml`).

The statements are written by hand, one file per autopilot, and compiled into `data/accepts.json` by
`python -m mavframecheck.semantics.acceptance`. A version is one number that sorts, as in
`vehicle.version` (4.5.7 is 4005007); NaN is an unknown one: then an answer is certain only when every
version that the file tells apart gives the same, and else it is the newest version's.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import TypeVar

import msgspec

from mavframecheck.semantics.mavframe import FRAMES

COMPILED = Path(__file__).parent / "data" / "accepts.json"
GENERIC = "generic"
"""The file for senders and receivers that are not known: what the protocol itself says."""

Value = str | float | tuple[int, ...]
"""What a fact holds: a word of its vocabulary, a number, or a set of numbers."""

NO_END = 1_000_000_000
"""`until` of a statement that still holds: later than any version."""

_T = TypeVar("_T")


class Consequence(StrEnum):
    """What the autopilot does with a message."""

    OBEYED = "obeyed"
    """It does what the protocol says."""
    MISREAD = "misread"
    """It takes the message and reads it in another frame."""
    REFUSED = "refused"
    """It drops the message and says so."""
    IGNORED = "ignored"
    """It drops the message, or the part in question, without a word."""
    STOPS = "stops"
    """It drops the message and brings the vehicle to a halt."""
    UNKNOWN = "unknown"


class Verdict(msgspec.Struct, frozen=True):
    """What becomes of a message in one frame."""

    accepted: bool | None = None
    """None: nothing is known. A misread message counts as accepted."""
    consequence: Consequence = Consequence.UNKNOWN
    certain: bool = False
    """Whether every version that could be meant does the same."""
    answer: str = ""
    """What the autopilot says to it: a STATUSTEXT, COMMAND_ACK or MISSION_ACK."""
    note: str = ""
    source: str = ""


class Fact(msgspec.Struct, frozen=True):
    """One fact, and how far it holds."""

    value: Value
    certain: bool
    note: str
    source: str


class Entry(msgspec.Struct, frozen=True, omit_defaults=True):
    """One statement of a file, names turned into numbers."""

    subjects: tuple[str, ...]
    """Messages, or the commands that a statement without a message is about."""
    source: str
    commands: tuple[int, ...] = ()
    rank: int = 0
    """The lowest speaks first: 0 about named commands, 1 about location commands, 2 about any."""
    since: int = 0
    until: int = NO_END
    accepts: tuple[int, ...] | None = None
    rejects: tuple[int, ...] | None = None
    """None: every frame that is neither accepted nor unknown."""
    unknown: tuple[int, ...] = ()
    then: Consequence | None = None
    answer: str = ""
    note: str = ""
    facts: dict[str, Value] = {}

    def verdict(self, frame: int) -> Verdict | None:
        """Return what this statement says of a frame, None when it does not speak of frames."""
        if self.accepts is None:
            return None
        if frame in self.accepts:
            return Verdict(True, Consequence.OBEYED, True, "", self.note, self.source)
        others = self.rejects is None and frame not in self.unknown
        if self.then is None or not (others or frame in (self.rejects or ())):
            return Verdict(note=self.note, source=self.source)
        taken = self.then is Consequence.MISREAD
        return Verdict(taken, self.then, True, self.answer, self.note, self.source)


class Stack(msgspec.Struct, frozen=True, omit_defaults=True):
    """The statements about one autopilot, before those of the one that it extends."""

    entries: tuple[Entry, ...]
    extends: str = ""


def accepts(
    family: str, message: str, frame: int, command: int | None = None, version: float = math.nan
) -> Verdict:
    """Return what `family` does with `message` (carrying `command`) in MAV_FRAME `frame`.

    A message without a frame, as COMMAND_LONG, is asked about with frame 0.
    """
    return _verdict(family, message, int(frame), command, _version(version))


def verdicts(
    family: str, message: str, command: int | None = None, version: float = math.nan
) -> tuple[Verdict, ...]:
    """Return the verdict on every defined frame, by its number: a table for whole columns."""
    number = _version(version)
    return tuple(_verdict(family, message, frame.id, command, number) for frame in FRAMES)


def frames_accepted(
    family: str, message: str, command: int | None = None, version: float = math.nan
) -> frozenset[int] | None:
    """Return the frames that every version in question takes and reads as the protocol means them.

    None when nothing is known of any frame; a frame that only some versions take is not in it.
    """
    table = verdicts(family, message, command, version)
    if all(verdict.accepted is None for verdict in table):
        return None
    obeyed = (Consequence.OBEYED, True)
    return frozenset(f for f, v in enumerate(table) if (v.consequence, v.certain) == obeyed)


def known_fact(
    family: str, subject: str, key: str, command: int | None = None, version: float = math.nan
) -> Fact | None:
    """Return a fact about a message, or about a command by its short name, with its provenance.

    `docs/acceptance.md` lists the keys and what each may hold.
    """
    return _fact(family, subject, key, command, _version(version))


def fact(
    family: str, subject: str, key: str, command: int | None = None, version: float = math.nan
) -> str | float | None:
    """Return a word or number that holds for every version in question, None when there is none."""
    found = known_fact(family, subject, key, command, version)
    if found is None or not found.certain or isinstance(found.value, tuple):
        return None
    return found.value


def numbers(
    family: str, subject: str, key: str, command: int | None = None, version: float = math.nan
) -> frozenset[int] | None:
    """Return a fact that is a set of numbers, None when there is none or the versions differ."""
    found = known_fact(family, subject, key, command, version)
    if found is None or not found.certain or not isinstance(found.value, tuple):
        return None
    return frozenset(found.value)


def member(
    family: str,
    subject: str,
    key: str,
    value: int,
    command: int | None = None,
    version: float = math.nan,
) -> bool | None:
    """Return whether a set of numbers holds `value`: in every version in question, in none, or None."""
    found = _entries_by_version(family, subject, key, command, _version(version))
    sets = [entry.facts[key] for entry in found]
    held = {value in numbers for numbers in sets if isinstance(numbers, tuple)}
    return held.pop() if len(held) == 1 else None


def families() -> tuple[str, ...]:
    """Return the autopilots that there is a file for."""
    return tuple(_stacks())


@cache
def _stacks() -> dict[str, Stack]:
    return msgspec.json.decode(COMPILED.read_bytes(), type=dict[str, Stack])


def _version(version: float) -> float | None:
    """Return a version that can be a key of a cache: NaN is not equal to itself."""
    return None if math.isnan(version) else float(version)


@cache
def _about(family: str, subject: str, command: int | None) -> tuple[Entry, ...]:
    """Return the statements on a subject: the more specific first, then the vehicle's own first."""
    name = family if family in _stacks() else GENERIC
    found: list[Entry] = []
    while name:
        stack = _stacks()[name]
        found += [e for e in stack.entries if subject in e.subjects and _meant(e, command)]
        name = stack.extends
    return tuple(sorted(found, key=lambda entry: entry.rank))


def _meant(entry: Entry, command: int | None) -> bool:
    return not entry.commands or command in entry.commands


@cache
def _verdict(
    family: str, message: str, frame: int, command: int | None, version: float | None
) -> Verdict:
    entries = _about(family, message, command)
    found = _by_version(entries, version, lambda now: _first(entry.verdict(frame) for entry in now))
    if not found:
        return Verdict()
    agreed = len({(verdict.accepted, verdict.consequence) for verdict in found}) == 1
    newest = found[-1]
    return msgspec.structs.replace(newest, certain=newest.certain and agreed)


@cache
def _fact(
    family: str, subject: str, key: str, command: int | None, version: float | None
) -> Fact | None:
    found = _entries_by_version(family, subject, key, command, version)
    if not found:
        return None
    newest = found[-1]
    agreed = len({entry.facts[key] for entry in found}) == 1
    return Fact(newest.facts[key], agreed, newest.note, newest.source)


def _entries_by_version(
    family: str, subject: str, key: str, command: int | None, version: float | None
) -> list[Entry]:
    """Return what states a fact at `version`, or at each version that is told apart."""
    entries = _about(family, subject, command)
    return _by_version(entries, version, lambda now: _first(e for e in now if key in e.facts))


def _by_version(
    entries: Sequence[Entry], version: float | None, pick: Callable[[list[Entry]], _T | None]
) -> list[_T]:
    """Return what `pick` finds at `version`, or at each version that the entries tell apart."""
    bounds = {0, *(e.since for e in entries), *(e.until for e in entries)}
    points = sorted(bounds) if version is None else [version]
    picked = (pick([e for e in entries if e.since <= point < e.until]) for point in points)
    return [found for found in picked if found is not None]


def _first(found: Iterable[_T | None]) -> _T | None:
    return next((each for each in found if each is not None), None)


if __name__ == "__main__":
    from mavframecheck.semantics import _authored

    sys.exit(_authored.main())
