"""The MAVLink XML that the catalogue is checked against, read with ElementTree."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import pytest

_ROOT = Path(__file__).parents[2]
UPSTREAM = _ROOT.parent / "shared" / "research" / "upstream"
_NOT_DIALECTS = ("all.xml", "test.xml", "python_array_test.xml", "paparazzi.xml", "matrixpilot.xml")

needs_upstream = pytest.mark.skipif(
    not UPSTREAM.is_dir(), reason="the XML of mavlink/mavlink is not beside this checkout"
)


class Definitions(NamedTuple):
    """What a set of dialects defines."""

    fields: dict[tuple[str, str], ET.Element]
    enums: dict[str, dict[str, int]]
    commands: dict[str, ET.Element]


def pymavlink_folder() -> Path:
    """Return the folder of the XML that pymavlink ships."""
    spec = importlib.util.find_spec("pymavlink")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent / "dialects" / "v20"


def _included(folder: Path, name: str) -> list[Path]:
    """Return a dialect and what it includes, each file once."""
    found: list[Path] = []
    pending = [folder / name]
    while pending:
        path = pending.pop()
        if path in found or not path.exists():
            continue
        found.append(path)
        pending += [folder / str(i.text).strip() for i in ET.parse(path).iter("include")]
    return found


def _definitions(paths: list[Path]) -> Definitions:
    found = Definitions({}, {}, {})
    for path in paths:
        root = ET.parse(path).getroot()
        for message in root.iter("message"):
            for field in message.iter("field"):
                found.fields[message.get("name", ""), field.get("name", "")] = field
        for enum in root.iter("enum"):
            _add_enum(found, enum)
    return found


def _add_enum(found: Definitions, enum: ET.Element) -> None:
    entries = found.enums.setdefault(enum.get("name", ""), {})
    for entry in enum.iter("entry"):
        entries[entry.get("name", "")] = _number(entry.get("value", "0"))
        if enum.get("name") == "MAV_CMD":
            found.commands[entry.get("name", "")] = entry


def _number(text: str) -> int:
    """Read `16`, `0x10` and `2**4`."""
    base, _, power = text.partition("**")
    return int(pow(int(base, 0), int(power or 1)))


@cache
def pymavlink_xml() -> Definitions:
    """Return every dialect that pymavlink ships."""
    paths = [p for p in sorted(pymavlink_folder().glob("*.xml")) if p.name not in _NOT_DIALECTS]
    return _definitions(paths)


@cache
def ardupilotmega_xml() -> Definitions:
    """Return the ardupilotmega dialect of pymavlink with all that it includes."""
    return _definitions(_included(pymavlink_folder(), "ardupilotmega.xml"))


@cache
def upstream_xml() -> Definitions:
    """Return the dialects of mavlink/mavlink that are beside this checkout."""
    return _definitions(sorted(UPSTREAM.glob("*.xml")))
