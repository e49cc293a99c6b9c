"""The catalogue as pages: message -> fields -> meaning, from the shipped tables.

They are made while the site is built and kept nowhere: the tables are the source.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from mavframecheck.engine.pack import load_pack
from mavframecheck.semantics import catalogue, masks
from mavframecheck.semantics.commands import (
    CARRIERS,
    CommandRows,
    all_commands,
    altitude_commands,
    location_commands,
)
from mavframecheck.semantics.constants import entry_name
from mavframecheck.semantics.enums import FrameKind
from mavframecheck.semantics.mavframe import FRAMES, frames_of
from mavframecheck.semantics.references import height_reference, reference
from mavframecheck.semantics.tags import Condition, FieldTag, Sentinel
from mavframecheck.wire import load_dialect
from tools.pages.markdown import code, page, table, text, without_empty

_SCOPES = {"element": "", "first": " in the first element", "all": " in all elements"}
_WORDS = "[conventions](../conventions.md#vocabulary)"
_HEAD = ("field", "holds", "unit", "frame and axis", "height above", "clock", "counts", "codes")


def pages() -> dict[str, str]:
    """Return every page by its path below the site's root."""
    judged = _judged_by()
    written = {f"{name}.md": page(_message(name, judged)) for name in catalogue.messages()}
    written["index.md"] = page(_index(judged))
    written["commands.md"] = page(_commands())
    written["frames.md"] = page(_frames())
    written["masks.md"] = page(_masks())
    return {f"catalogue/{name}": content for name, content in written.items()}


def _judged_by() -> dict[str, list[str]]:
    """Return message -> codes of the rules that are bound to it or name it."""
    pack = load_pack()
    found: dict[str, list[str]] = {}
    for rule in pack.rules:
        named = [name for name in rule.applies.message if not name.startswith("!")]
        for message in dict.fromkeys([*pack.binds.get(rule.code, ()), *named]):
            found.setdefault(message, []).append(rule.code)
    return found


# ---- the list of messages ----


def _index(judged: dict[str, list[str]]) -> Iterator[str]:
    yield "# Catalogue"
    yield (
        "What the fields of MAVLink messages mean, as mavframecheck reads them: quantity, unit, frame, "
        "height reference, clock, and the values that stand for something else. Made from the shipped "
        "tables. [Commands](commands.md), [frames and heights](frames.md) and [masks](masks.md) have "
        f"pages of their own. The words are explained in {_WORDS}, where you also find how to correct "
        "a row."
    )
    yield (
        f"{len(catalogue.messages())} messages. Fields that are mere numbers to this tool (voltages, "
        "texts, counters) are not listed."
    )
    rows = (
        (
            f"[{name}]({name}.md)",
            _id(name),
            text(", ".join(dict.fromkeys(_plain(tag.quantity) for tag in _own(name)))),
            str(len(judged.get(name, []))),
        )
        for name in sorted(catalogue.messages())
    )
    yield table(("message", "id", "holds", "rules"), rows)


def _id(message: str) -> str:
    layout = load_dialect().by_name.get(message)
    return str(layout.msgid) if layout else ""


def _own(message: str) -> list[FieldTag]:
    """Return the tags of a message; for carriers of commands those that many commands share."""
    tags = catalogue.tags(message)
    return [tag for tag in tags if not (message in CARRIERS and _of_one_command(tag))]


def _of_one_command(tag: FieldTag) -> bool:
    return any(c.field == "command" and len(c.values) == 1 for c in tag.when)


# ---- one message ----


def _message(name: str, judged: dict[str, list[str]]) -> Iterator[str]:
    tags = _own(name)
    yield f"# {name}"
    number = _id(name)
    source = f"Message {number}" if number else "Only in the XML of mavlink/mavlink"
    yield f"{source}. [All messages](index.md); the words are explained in {_WORDS}."
    if name in CARRIERS:
        yield (
            "What params mean hangs on the command: here is what all commands with a place share, "
            "the rest is under [commands](commands.md)."
        )
    yield from _fields(tags)
    if name in judged:
        codes = (f"[{each}](../rules/{each}.md)" for each in judged[name])
        yield f"Judged by {', '.join(codes)}, and by rules about the stream, time and motion."
    remarks = dict.fromkeys(f"{code(tag.field)}: {text(tag.remark)}" for tag in tags if tag.remark)
    if remarks:
        yield "## Remarks"
        yield "\n".join(f"- {remark}" for remark in remarks)
    layout = load_dialect().by_name.get(name)
    tagged = {tag.field for tag in catalogue.tags(name)}
    rest = [field.name for field in layout.fields if field.name not in tagged] if layout else []
    if rest:
        yield f"Not in the catalogue: {', '.join(map(code, rest))}."


def _fields(tags: Iterable[FieldTag]) -> Iterator[str]:
    """Yield a table for each view: fields with the same conditions belong together."""
    for conditions, members in groupby(sorted(tags, key=_conditions), key=_conditions):
        if conditions:
            yield f"Where {conditions}:"
        yield table(*without_empty(_HEAD, map(_row, members)))


def _row(tag: FieldTag) -> tuple[str, ...]:
    return (
        code(tag.field),
        text(_holds(tag)),
        text(tag.unit),
        text(_frame(tag)),
        text(_height(tag)),
        text(_plain(tag.clock)),
        text(_counts(tag)),
        text("; ".join(map(_code, tag.sentinels))),
    )


def _plain(word: str) -> str:
    return str(word).replace("_", " ")


def _holds(tag: FieldTag) -> str:
    """Return the quantity, whose it is, and the enumeration of a selector or mask."""
    of = f" of the {_plain(tag.ref_point)}" if tag.ref_point else ""
    layout = f" ({_plain(tag.cov_layout)})" if tag.cov_layout else ""
    enum = f" {tag.enum}" if tag.enum else ""
    return f"{_plain(tag.quantity)}{of}{layout}{enum}"


def _frame(tag: FieldTag) -> str:
    """Return frame, axis and the direction in which it grows."""
    if tag.frame == "by_field":
        frame = f"by {tag.frame_field}"
    else:
        frame = reference(tag.frame).label if tag.frame else ""
    axis = "" if tag.axis in ("lat", "lon") else _plain(tag.axis)
    known = tag.positive not in ("", "by_frame", tag.axis)
    return ", ".join(filter(None, (frame, axis, f"+ {_plain(tag.positive)}" if known else "")))


def _height(tag: FieldTag) -> str:
    if not tag.alt_ref:
        return ""
    if tag.alt_ref in ("by_frame", "by_field"):
        return f"by {tag.frame_field}"
    return (
        height_reference(tag.alt_ref).label.removeprefix("above ").removeprefix("height reference ")
    )


def _counts(tag: FieldTag) -> str:
    """Return which bit of which field says whether the field counts."""
    if not tag.ignore_field:
        return ""
    enum = masks.mask_of(tag.message, tag.ignore_field)
    named = [each.name for each in masks.bits(enum) if each.bit == tag.ignore_bit] if enum else []
    bit = named[0] if named else f"bit {tag.ignore_bit}"
    return f"{'unless' if tag.ignore_when_set else 'with'} {bit} in {tag.ignore_field}"


def _code(sentinel: Sentinel) -> str:
    """Return ``65535 = unknown``, or ``36000: north`` where the code stands for something known."""
    value = "below " * (sentinel.kind == "below") + f"{sentinel.value:.10g}".replace("nan", "NaN")
    sign = ": " if sentinel.known else " = "
    return f"{value}{_SCOPES[sentinel.scope]}{sign}{sentinel.meaning}"


def _conditions(tag: FieldTag, but: str = "") -> str:
    """Return when a tag holds, but for the conditions on one selector."""
    return " and ".join(
        f"{code(each.field)} is {_values(tag.message, each)}"
        for each in tag.when
        if each.field != but
    )


def _values(message: str, condition: Condition) -> str:
    """Return the values of a selector: kinds of frames, commands with a place, or names."""
    if condition.values == location_commands():
        return "a command with a place"
    if condition.values == altitude_commands():
        return "a command with a height"
    enum = next((tag.enum for tag in catalogue.tags_of(message, condition.field) if tag.enum), "")
    names = [entry_name(enum, each) if enum else str(each) for each in condition.values]
    if enum == "MAV_FRAME":
        names = _kinds(condition.values) or names
    return " or ".join(names)


def _kinds(values: tuple[int, ...]) -> list[str]:
    """Return the kinds of frames that make up these values, empty when they cut through one."""
    kinds = [kind for kind in FrameKind if set(frames_of(kind)) <= set(values)]
    whole = {frame for kind in kinds for frame in frames_of(kind)} == set(values)
    return [str(kind) for kind in kinds] if whole else []


# ---- commands, frames, masks ----


def _commands() -> Iterator[str]:
    yield "# Commands"
    yield (
        "Parameters of MAV_CMD that carry a position, angle, speed, length or time, as COMMAND_LONG "
        "carries them. Latitudes and longitudes are degrees there, and degrees times 1e7 in COMMAND_INT "
        "and MISSION_ITEM_INT. COMMAND_LONG has no frame: its heights are what the autopilot takes them "
        "for."
    )
    head = ("param", "name", "when", *_HEAD[1:])
    for facts in all_commands().values():
        yield f"## {facts.name}"
        yield f"Command {facts.id}{', with a place' if facts.location else ''}."
        yield table(*without_empty(head, _parameters(facts)))


def _parameters(facts: CommandRows) -> Iterator[tuple[str, ...]]:
    """Yield a row for each parameter of a command, in their order."""
    labels = {f"param{row['param']}": row["label"] for row in facts.rows}
    tags = [
        tag
        for tag in catalogue.tags("COMMAND_LONG")
        if any(each.field == "command" and facts.id in each.values for each in tag.when)
    ]
    for tag in sorted(tags, key=lambda tag: tag.field):
        name, *rest = _row(tag)
        yield name, text(labels.get(tag.field, "")), _conditions(tag, but="command"), *rest


def _frames() -> Iterator[str]:
    yield "# Frames and heights"
    yield "## MAV_FRAME"
    yield table(
        ("id", "name", "status", "kind", "axes", "origin", "third coordinate", "remark"),
        (
            (
                str(each.id),
                text(each.name),
                text(each.status),
                text(each.kind),
                text(each.axes),
                text(each.origin),
                text(each.words),
                text(each.remark),
            )
            for each in FRAMES
        ),
    )
    yield "## Heights"
    heights = ("msl", "ellipsoid", "home", "terrain", "origin", "pressure", "target")
    facts = [height_reference(name) for name in heights]
    yield table(
        ("word", "in a sentence", "surface"), ((f.name, f.label, text(f.surface)) for f in facts)
    )


def _masks() -> Iterator[str]:
    yield "# Masks"
    yield "A set bit says that its field is ignored, that its field counts (use), or something else (flag)."
    for enum in masks.mask_enums():
        yield f"## {enum}"
        rows = ((str(b.bit), text(b.name), text(b.words), str(b.sense)) for b in masks.bits(enum))
        yield table(("bit", "name", "about", "a set bit says"), rows)
