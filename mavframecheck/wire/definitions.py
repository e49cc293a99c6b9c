"""MAVLink XML definitions to layouts (used by the generator and by `--dialect`)."""

from __future__ import annotations

import importlib.resources
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from mavframecheck.wire.crc import crc16
from mavframecheck.wire.dialect import (
    NUMPY_CODES,
    DialectError,
    Field,
    Layout,
    pymavlink_definitions,
)

SUPPLEMENTED = ("ardupilotmega", "common", "all", "development")
"""Dialects of the release that are completed with `data/supplement.xml`."""
ID_LIMIT = 1 << 24
LONGEST_PAYLOAD = 255


class _Message:
    """A message while its definition is being put together."""

    def __init__(self, msgid: int, name: str) -> None:
        self.msgid = msgid
        self.name = name
        self.base: list[Field] = []
        self.extensions: list[Field] = []


def read_definitions(file: Path) -> tuple[Layout, ...]:
    """Return the layouts of all messages in `file` and what it includes, by ascending id.

    Raises `DialectError` when the XML is malformed, an include is missing or a type is unknown.
    """
    messages: dict[int, _Message] = {}
    _read(file, messages, set())
    if file.stem in SUPPLEMENTED and file.parent == pymavlink_definitions():
        ours = importlib.resources.files(__package__).joinpath("data/supplement.xml")
        root = ET.fromstring(ours.read_text("utf-8"))
        _collect(root, messages, "supplement.xml", supplement=True)
    return tuple(_layout(messages[msgid]) for msgid in sorted(messages))


def _read(file: Path, messages: dict[int, _Message], seen: set[str]) -> None:
    if file.name in seen:
        return
    seen.add(file.name)
    try:
        root = ET.parse(file).getroot()
    except (OSError, ET.ParseError) as error:
        message = f"{file}: cannot read the dialect ({error})"
        raise DialectError(message) from error
    for include in root.findall("include"):
        name = (include.text or "").strip()
        beside = file.parent / name
        _read(beside if beside.is_file() else pymavlink_definitions() / name, messages, seen)
    _collect(root, messages, file.name)


def _collect(
    root: ET.Element, messages: dict[int, _Message], file: str, *, supplement: bool = False
) -> None:
    """Add the messages below `root`; one that is known already only gains extension fields.

    A supplement repeats what some dialects of the release have already.
    """
    for element in root.findall("messages/message"):
        try:
            msgid, name = int(element.attrib["id"]), element.attrib["name"]
        except (KeyError, ValueError):
            msgid, name = -1, ""
        if not (name and 0 <= msgid < ID_LIMIT):
            message = f"{file}: a message needs a name and a number of 24 bits as id"
            raise DialectError(message)
        known = msgid in messages
        entry = messages.setdefault(msgid, _Message(msgid, name))
        fields = entry.extensions if known else entry.base
        there = {f.name for f in (*entry.base, *entry.extensions)} if supplement else set()
        for child in element:
            if child.tag == "extensions":
                fields = entry.extensions
            elif child.tag == "field" and child.get("name") not in there:
                fields.append(
                    _field(child, f"{file}: {name}", extension=fields is entry.extensions)
                )


def _field(element: ET.Element, where: str, *, extension: bool) -> Field:
    kind, _, rest = element.attrib.get("type", "").partition("[")
    if kind not in NUMPY_CODES or "name" not in element.attrib:
        message = f"{where}: field {element.attrib.get('name')!r} has the unknown type {kind!r}"
        raise DialectError(message)
    if rest and not (rest[:-1].isdecimal() and rest.endswith("]") and int(rest[:-1])):
        message = f"{where}: field {element.attrib['name']!r} has the array length {rest[:-1]!r}"
        raise DialectError(message)
    length = int(rest[:-1]) if rest else 0
    return Field(
        element.attrib["name"], kind, length, 0, extension, element.attrib.get("units", "")
    )


def _size(field: Field) -> int:
    return np.dtype(NUMPY_CODES[field.type]).itemsize


def _layout(message: _Message) -> Layout:
    """Order the fields as on the wire (large types first, extensions last) and place them."""
    _refuse_impossible(message)
    base = sorted(message.base, key=_size, reverse=True)
    placed: list[Field] = []
    offset = 0
    for field in (*base, *message.extensions):
        placed.append(
            Field(field.name, field.type, field.length, offset, field.extension, field.unit)
        )
        offset += _size(field) * max(field.length, 1)
    base_length = sum(_size(f) * max(f.length, 1) for f in base)
    return Layout(
        message.msgid,
        message.name,
        _crc_extra(message.name, base),
        base_length,
        offset,
        tuple(placed),
    )


def _refuse_impossible(message: _Message) -> None:
    """Raise DialectError for a message that no frame could carry."""
    fields = [*message.base, *message.extensions]
    twice = [name for name, n in Counter(f.name for f in fields).items() if n > 1]
    size = sum(_size(f) * max(f.length, 1) for f in fields)
    problem = ""
    if not message.base:
        problem = "it has no field"
    elif twice:
        problem = f"it has the field {twice[0]!r} twice"
    elif size > LONGEST_PAYLOAD:
        problem = f"its fields take {size} bytes, and a payload has room for {LONGEST_PAYLOAD}"
    if problem:
        raise DialectError(f"message {message.name} ({message.msgid}) cannot be sent: {problem}")


def _crc_extra(name: str, base: list[Field]) -> int:
    """Return the seed that ties a checksum to the definition of the message."""
    text = f"{name} ".encode()
    for field in base:
        kind = "uint8_t" if field.type == "uint8_t_mavlink_version" else field.type
        text += f"{kind} {field.name} ".encode()
        if field.length:
            text += bytes([field.length])
    crc = crc16(text)
    return (crc & 0xFF) ^ (crc >> 8)
