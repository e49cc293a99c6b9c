"""The meaning of every field, read on demand from `data/fields.csv` and `data/commands.csv`.

A *view* is a message together with conditions on its selector fields (`when`). Tags bind to views:
a field that means different things in different views has several tags.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import cache

import msgspec

from mavframecheck.semantics import _tables
from mavframecheck.semantics.commands import (
    BY_CARRIER,
    CARRIERS,
    INT_CARRIERS,
    all_commands,
    altitude_commands,
    location_commands,
)
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import (
    AltRef,
    Axis,
    Clock,
    CovLayout,
    Frame,
    FrameKind,
    Positive,
    Quantity,
    RefPoint,
)
from mavframecheck.semantics.mavframe import frames_of
from mavframecheck.semantics.sentinels import parse_sentinels
from mavframecheck.semantics.tags import Condition, FieldTag
from mavframecheck.semantics.units import UNITS, to_si


@cache
def _rows() -> dict[str, list[dict[str, str]]]:
    """Return the authored rows by message, in the order of the table."""
    rows: dict[str, list[dict[str, str]]] = {}
    for row in _tables.read("fields"):
        rows.setdefault(row["message"], []).append(row)
    return rows


def messages() -> tuple[str, ...]:
    """Return the names of all messages that have tags, in the order of the table."""
    return tuple(_rows())


@cache
def tags(message: str) -> tuple[FieldTag, ...]:
    """Return every tag of a message (command parameters included), empty for an unknown message."""
    rows = _rows().get(message, []) + _command_rows(message)
    dependents = _dependents(rows)
    return tuple(
        _tag(row, tuple(dependents.get((row.get("id", ""), row["field"]), ()))) for row in rows
    )


def tags_of(message: str, field: str) -> tuple[FieldTag, ...]:
    """Return the tags of one field: none, one, or one per view."""
    return tuple(tag for tag in tags(message) if tag.field == field)


def find(**criteria: object) -> tuple[FieldTag, ...]:
    """Return the tags whose attributes equal the given values, or are among the given collections.

    `find(quantity="latitude", unit=("degE7", "deg"))`. Without criteria: every tag.
    An unknown attribute is a TypeError, a word outside its closed vocabulary a ValueError.
    """
    unknown = set(criteria) - set(FieldTag.__struct_fields__)
    if unknown:
        raise TypeError(f"FieldTag has no attribute {', '.join(sorted(unknown))}")
    wanted = {name: _choices(value) for name, value in criteria.items()}
    for name, values in wanted.items():
        strange = set(values) - set(_VOCABULARIES.get(name, values))
        if strange:
            raise ValueError(f"{name} is never {', '.join(sorted(map(str, strange)))}")
    candidates: Iterable[FieldTag] = all_tags()
    if "quantity" in wanted:
        candidates = [t for q in sorted(map(str, wanted["quantity"])) for t in _by_quantity(q)]
    return tuple(
        tag
        for tag in candidates
        if all(getattr(tag, name) in values for name, values in wanted.items())
    )


def _choices(value: object) -> Collection[object]:
    """Return a criterion as a collection; a text or number stands for itself."""
    if isinstance(value, (list, set, frozenset, tuple)):
        return value
    return (value,)


@cache
def all_tags() -> tuple[FieldTag, ...]:
    """Return every tag of every message."""
    return tuple(tag for message in messages() for tag in tags(message))


@cache
def _by_quantity(quantity: str) -> tuple[FieldTag, ...]:
    return tuple(tag for tag in all_tags() if tag.quantity == quantity)


def group(message: str, name: str, when: tuple[Condition, ...] = ()) -> dict[str, FieldTag]:
    """Return the tags of one group by alias, in the views that can hold together with `when`."""
    members = [t for t in tags(message) if t.group == name and _compatible(t.when, when)]
    return _aliased(members)


def partners(tag: FieldTag) -> dict[str, FieldTag]:
    """Return what the same row says of the same subject, by alias; the tag itself included.

    Aliases: lat, lon, alt, x, y, z, vx, vy, vz, climb, ax, ay, az, roll, pitch, yaw, rollspeed,
    pitchspeed, yawspeed, q, qw, qx, qy, qz, mx, my, mz, wx, wy, wz. A second tag with the same
    alias, and everything else, goes by its field name: `relative_alt`. A tag without a group has
    no partners but itself.
    """
    if not tag.group:
        return {tag.field: tag}
    members = [
        other
        for other in tags(tag.message)
        if other.group and other.subject == tag.subject and _compatible(other.when, tag.when)
    ]
    return _aliased(members)


def _aliased(members: Iterable[FieldTag]) -> dict[str, FieldTag]:
    """Return the tags by alias, the first of an alias keeping it."""
    named: dict[str, FieldTag] = {}
    for tag in members:
        short = alias(tag)
        named[tag.field if short in named else short] = tag
    return named


def _compatible(left: tuple[Condition, ...], right: tuple[Condition, ...]) -> bool:
    """Return whether one row can satisfy both sets of conditions."""
    theirs = {condition.field: condition.values for condition in right}
    return all(
        not set(condition.values).isdisjoint(theirs.get(condition.field, condition.values))
        for condition in left
    )


_PLAIN_ALIASES = {
    Quantity.LATITUDE: "lat",
    Quantity.LONGITUDE: "lon",
    Quantity.ALTITUDE: "alt",
    Quantity.HEADING: "yaw",
}
_LETTERS = {
    **dict.fromkeys((Axis.NORTH, Axis.FORWARD, Axis.X), "x"),
    **dict.fromkeys((Axis.EAST, Axis.RIGHT, Axis.Y), "y"),
    **dict.fromkeys((Axis.DOWN, Axis.Z), "z"),
}
_VECTOR_PREFIXES = {
    Quantity.POSITION: "",
    Quantity.VELOCITY: "v",
    Quantity.ACCELERATION: "a",
    Quantity.SPECIFIC_FORCE: "a",
    Quantity.MAGNETIC_FIELD: "m",
    Quantity.WIND_VELOCITY: "w",
}
_RATE_ALIASES = {
    **dict.fromkeys((Axis.ROLL, Axis.FORWARD, Axis.X), "rollspeed"),
    **dict.fromkeys((Axis.PITCH, Axis.RIGHT, Axis.Y), "pitchspeed"),
    **dict.fromkeys((Axis.YAW, Axis.DOWN, Axis.Z), "yawspeed"),
}
_QUATERNION_ALIASES = {Axis.WXYZ: "q", Axis.W: "qw", Axis.X: "qx", Axis.Y: "qy", Axis.Z: "qz"}


def alias(tag: FieldTag) -> str:
    """Return the short name that a tag goes by among its partners, else its field name."""
    if tag.quantity in _PLAIN_ALIASES:
        return _PLAIN_ALIASES[tag.quantity]
    if tag.quantity is Quantity.ATTITUDE_ANGLE:
        return str(tag.axis) or tag.field
    if tag.quantity is Quantity.ATTITUDE_QUATERNION:
        return _QUATERNION_ALIASES.get(tag.axis, tag.field)
    if tag.quantity is Quantity.ANGULAR_RATE:
        return _RATE_ALIASES.get(tag.axis, tag.field)
    if tag.quantity is Quantity.VELOCITY and tag.axis is Axis.UP:
        return "climb"
    if tag.quantity in _VECTOR_PREFIXES and tag.axis in _LETTERS:
        return _VECTOR_PREFIXES[tag.quantity] + _LETTERS[tag.axis]
    return tag.field


class CommandFacts(msgspec.Struct, frozen=True):
    """One MAV_CMD: its name, whether it has a location, and its parameters in one carrier."""

    name: str
    id: int
    location: bool
    """The XML says `hasLocation`."""
    params: tuple[FieldTag, ...]
    """Tags of the carrier that hold for this command: own ones and generic location ones."""


def command(number: int, carrier: str = "COMMAND_INT") -> CommandFacts | None:
    """Return what is known of a command as carried by one message, None for an untagged command."""
    facts = all_commands().get(number)
    if facts is None:
        return None
    params = tuple(tag for tag in tags(carrier) if _is_for(tag, number))
    return CommandFacts(facts.name, facts.id, facts.location, params)


def _is_for(tag: FieldTag, number: int) -> bool:
    return any(c.field == "command" and number in c.values for c in tag.when)


def _command_rows(message: str) -> list[dict[str, str]]:
    """Return rows for the parameters that a carrier does not share with every location command."""
    fields = CARRIERS.get(message)
    if fields is None:
        return []
    return [
        _command_row(message, fields[int(row["param"]) - 1], row)
        for facts in all_commands().values()
        for row in facts.rows
        if row["unit"] != BY_CARRIER
    ]


def _command_row(message: str, field: str, row: dict[str, str]) -> dict[str, str]:
    """Return one command parameter as a row of the field table."""
    scaled = message in INT_CARRIERS and field in ("x", "y") and row["int_unit"]
    extra = f"&{row['when']}" if row["when"] else ""
    return {
        **_EMPTY_ROW,
        **row,
        "message": message,
        "field": field,
        "when": _in_carrier(message, f"command={row['id']}{extra}"),
        "unit": row["int_unit"] if scaled else row["unit"],
        "frame": _in_carrier(message, row["frame"]),
        "alt_ref": _in_carrier(message, row["alt_ref"]),
    }


def _in_carrier(message: str, text: str) -> str:
    """Rewrite references to other parameters, and to the frame, as fields of the carrier."""
    if message == "COMMAND_LONG":  # the only carrier without a frame, its fields are named alike
        return "unspecified" if text.endswith(":frame") else text
    for number, field in enumerate(CARRIERS[message], 1):
        text = text.replace(f"param{number}", field)
    return text


_EMPTY_ROW = dict.fromkeys(
    ("group", "ignore", "cov_layout", "ref_point", "time_field", "instance_field", "enum"), ""
)


Dependents = dict[tuple[str, str], dict[str, None]]
"""(command number or empty, selector field) -> the fields that it decides on, in order."""


def _dependents(rows: list[dict[str, str]]) -> Dependents:
    """Find whose view, frame, reference or validity each selector decides.

    A parameter selects only among the parameters of its own command.
    """
    found: Dependents = {}
    for row in rows:
        for selector in _selectors(row):
            scope = row.get("id", "") if selector.startswith("param") else ""
            found.setdefault((scope, selector), {})[row["field"]] = None
    return found


def _selectors(row: dict[str, str]) -> list[str]:
    """Return the fields of the same message that a row depends on."""
    found = [term.partition("=")[0] for term in row["when"].split("&")]
    found += [row[name].partition(":")[2] for name in ("frame", "alt_ref")]
    found.append(row["ignore"].partition(":")[0])
    return [field for field in found if field]


_QUANTITIES = {word.value: word for word in Quantity}
_FRAMES = {word.value: word for word in Frame}
_AXES = {word.value: word for word in Axis}
_POSITIVES = {word.value: word for word in Positive}
_ALT_REFS = {word.value: word for word in AltRef}
_CLOCKS = {word.value: word for word in Clock}
_LAYOUTS = {word.value: word for word in CovLayout}
_REF_POINTS = {word.value: word for word in RefPoint}
# plain dictionaries: calling an enumeration is ten times slower, and there are 15 000 cells
_VOCABULARIES: dict[str, Collection[object]] = {
    "quantity": _QUANTITIES,
    "unit": UNITS,
    "frame": _FRAMES,
    "axis": _AXES,
    "positive": _POSITIVES,
    "alt_ref": _ALT_REFS,
    "clock": _CLOCKS,
    "cov_layout": _LAYOUTS,
    "ref_point": _REF_POINTS,
}


def _tag(row: dict[str, str], selects: tuple[str, ...]) -> FieldTag:
    """Parse one row; a word outside the closed vocabularies is a KeyError."""
    quantity = _QUANTITIES[row["quantity"]]
    scale, si_unit = to_si(row["unit"], quantity)
    frame, _, frame_field = row["frame"].partition(":")
    alt_ref, _, alt_field = row["alt_ref"].partition(":")
    ignore_field, _, bit = row["ignore"].partition(":")
    return FieldTag(
        message=row["message"],
        field=row["field"],
        when=_conditions(row["when"]),
        group=row["group"],
        quantity=quantity,
        unit=row["unit"],
        scale=scale,
        si_unit=si_unit,
        frame=_FRAMES[frame],
        frame_field=frame_field or alt_field,
        axis=_AXES[row["axis"]],
        positive=_POSITIVES[row["positive"]],
        alt_ref=_ALT_REFS[alt_ref],
        clock=_CLOCKS[row["clock"]],
        ignore_field=ignore_field,
        ignore_bit=int(bit or 0),
        ignore_when_set=not bit.startswith("+"),
        sentinels=parse_sentinels(row["sentinels"]),
        cov_layout=_LAYOUTS[row["cov_layout"]],
        ref_point=_REF_POINTS[row["ref_point"]],
        time_field=row["time_field"],
        instance_field=row["instance_field"],
        enum=row["enum"],
        selects=selects,
        dialect="upstream" if row["dialect"] else "",
        source=row["source"],
        remark=row["remark"],
    )


@cache
def _conditions(text: str) -> tuple[Condition, ...]:
    """Parse `frame=global&command=location`."""
    terms = [term.partition("=") for term in text.split("&") if term]
    return tuple(
        Condition(field, tuple(v for word in words.split(",") for v in _values(field, word)))
        for field, _, words in terms
    )


def _values(field: str, word: str) -> tuple[int, ...]:
    """Return the numbers behind a word of a condition: a number, a named set or a constant."""
    if word.lstrip("-").isdigit():
        return (int(word),)
    if field == "command" and word == "location":
        return location_commands()
    if field == "command" and word == "altitude":
        return altitude_commands()
    if word in set(FrameKind):
        return frames_of(FrameKind(word))
    return (constant(word),)
