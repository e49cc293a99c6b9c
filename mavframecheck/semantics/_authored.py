"""Reading `accepts/*.toml`: the words checked, the names turned into numbers."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

import msgspec

from mavframecheck.semantics.acceptance import (
    COMPILED,
    GENERIC,
    NO_END,
    Consequence,
    Entry,
    Stack,
    Value,
)
from mavframecheck.semantics.commands import location_commands
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.mavframe import FRAMES

FOLDER = Path(__file__).parent / "accepts"
FORM = 1000
"""Each part of a version is below this (`vehicle.version`)."""

LOCATION = "location"
"""In `command`: every command whose params 5 and 6 are a latitude and a longitude."""

_DONE = tuple(Consequence)
_NAN = (*_DONE, "not_set", "passed_on")
_MASK = ("per_axis", "group", "xy_group", "z_only")

FACTS: dict[str, tuple[str, ...] | type] = {
    # setpoints
    "mode": ("offboard", "guided"),
    "frame_checked": ("always", "with_position"),
    "body_position": ("ignored", "offset"),
    "body_velocity": ("heading", "attitude"),
    "body_acceleration": ("heading", "attitude"),
    "partial_position": _MASK,
    "partial_velocity": _MASK,
    "partial_acceleration": _MASK,
    "partial_body_velocity": _MASK,
    "nothing_set": _DONE,
    "yaw_only": _DONE,
    "force": _DONE,
    "acceleration": _DONE,
    "position_and_acceleration": _DONE,
    "terrain_and_velocity": _DONE,
    "yaw_in_body_frame": ("relative", "absolute"),
    "nan_position": _NAN,
    "nan_velocity": _NAN,
    "nan_acceleration": _NAN,
    "nan_yaw": _NAN,
    # attitude
    "throttle_ignored": _DONE,
    "partial_rates": _DONE,
    "quaternion_not_unit": _DONE,
    "quaternion_tolerance": float,
    "thrust": ("climb_rate", "thrust", "speed"),
    # estimates and sensors
    "read": ("no",),
    "child_frames": tuple,
    "estimator_types": tuple,
    "quaternion": ("converted", "copied"),
    "position_valid": ("required",),
    "distance": ("required",),
    "ignored_altitude": ("zero",),
    "ignored_velocity": ("kept",),
    "eph": ("dop", "accuracy_cm"),
    "origin_again": ("moved", *_DONE),
    # commands and missions
    "z_reference": ("msl", "home", "vehicle"),
    "position": ("unread",),
    "null_position": ("here", "literal", "refused"),
    "int32_max_position": ("here",),
    "nan_z": ("default", "refused"),
    "yaw": ("radians", "unread", "loiter_direction"),
    "mission_frame": ("msl", "refused"),
    "nan_params": tuple,
    "zero_yaw": ("north", "unread"),
    "home_item": ("first", "none"),
}
"""Every key of `facts` with what it may hold: words, one number, or a set of numbers."""


class Statement(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One `[[statement]]` as it is written."""

    source: str
    message: tuple[str, ...] = ()
    command: tuple[str, ...] = ()
    since: str = ""
    until: str = ""
    accepts: tuple[str, ...] | None = None
    rejects: tuple[str, ...] | None = None
    unknown: tuple[str, ...] = ()
    then: Consequence | None = None
    answer: str = ""
    note: str = ""
    evidence: tuple[str, ...] = ()
    facts: dict[str, str | float | tuple[str | int, ...]] = {}


class File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One file as it is written."""

    about: str
    extends: str = ""
    statement: tuple[Statement, ...]


def read_file(path: Path) -> File:
    """Return a file; ValueError names it and the key that cannot be used."""
    try:
        return msgspec.convert(tomllib.loads(path.read_text("utf-8")), File)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise ValueError(f"{path.name}: {error}") from error


def compile_files(folder: Path = FOLDER) -> dict[str, Stack]:
    """Return the statements of every file by the name of the file."""
    files = {path.stem: read_file(path) for path in sorted(folder.glob("*.toml"))}
    for name, file in files.items():
        if file.extends and file.extends not in files:
            raise ValueError(f"{name}.toml: extends {file.extends}, which is no file")
    if GENERIC not in files:
        raise ValueError(f"{folder.name}: {GENERIC}.toml is missing")
    return {
        name: Stack(tuple(_entries(f"{name}.toml", file.statement)), file.extends)
        for name, file in files.items()
    }


def _entries(file: str, statements: Iterable[Statement]) -> Iterable[Entry]:
    for place, statement in enumerate(statements, 1):
        try:
            yield _entry(statement)
        except (KeyError, ValueError) as error:
            raise ValueError(f"{file}: statement {place}: {error.args[0]}") from error


def _entry(written: Statement) -> Entry:
    if not (written.message or written.command):
        raise ValueError("names neither a message nor a command")
    if written.then is not None and written.accepts is None:
        raise ValueError("then needs accepts, be it empty")
    commands = () if not written.message else tuple(_commands(written.command))
    return Entry(
        subjects=written.message or written.command,
        source="; ".join((written.source, *written.evidence)),
        commands=commands,
        rank=2 if not commands else int(LOCATION in written.command),
        since=version_number(written.since) if written.since else 0,
        until=version_number(written.until) if written.until else NO_END,
        accepts=_frames(written.accepts),
        rejects=_frames(written.rejects),
        unknown=_frames(written.unknown) or (),
        then=written.then,
        answer=written.answer,
        note=written.note,
        facts={key: _fact(key, value) for key, value in written.facts.items()},
    )


def _commands(names: Iterable[str]) -> Iterable[int]:
    for name in names:
        yield from location_commands() if name == LOCATION else (constant(f"MAV_CMD.{name}"),)


def _frames(names: Iterable[str] | None) -> tuple[int, ...] | None:
    if names is None:
        return None
    if tuple(names) == ("any",):
        return tuple(frame.id for frame in FRAMES)
    return tuple(constant(f"MAV_FRAME.{name}") for name in names)


def version_number(text: str) -> int:
    """Return `4.6` or `4.5.7` as the number that sorts: 4006000, 4005007."""
    major, minor, patch = (*(int(part) for part in text.split(".")), 0)[:3]
    return (major * FORM + minor) * FORM + patch


def _fact(key: str, value: str | float | tuple[str | int, ...]) -> Value:
    """Return a fact's value; ValueError when the key is unknown or cannot hold the value."""
    if key not in FACTS:
        raise ValueError(f"facts.{key}: no such fact")
    allowed = FACTS[key]
    if allowed is tuple and isinstance(value, tuple):
        return tuple(v if isinstance(v, int) else constant(v) for v in value)
    if allowed is float and isinstance(value, float):
        return value
    if isinstance(allowed, tuple) and isinstance(value, str) and value in allowed:
        return value
    raise ValueError(f"facts.{key} cannot hold {value!r}")


def compiled() -> bytes:
    """Return what `data/accepts.json` must hold: one statement a line."""
    stacks = (_lines(name, stack) for name, stack in compile_files().items())
    return b"{\n" + b",\n".join(stacks) + b"\n}\n"


def _lines(name: str, stack: Stack) -> bytes:
    entries = b",\n".join(msgspec.json.encode(entry) for entry in stack.entries)
    extends = msgspec.json.encode(stack.extends)
    return b'"%s":{"extends":%s,"entries":[\n%s]}' % (name.encode(), extends, entries)


def main() -> int:
    """Write `data/accepts.json`."""
    COMPILED.write_bytes(compiled())
    return 0
