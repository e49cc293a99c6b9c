"""Message layouts: those of the release, those we add, and a user's own."""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from pymavlink.generator import mavgen

from mavframecheck.wire import DialectError, Layout, load_dialect
from mavframecheck.wire.definitions import read_definitions
from mavframecheck.wire.dialect import pymavlink_definitions
from mavframecheck.wire.generate import TARGET, generated
from tests.strategies import DIALECT, MESSAGES

SUPPLEMENT = TARGET.parent / "supplement.xml"
UPSTREAM = Path(__file__).parents[3] / "shared" / "research" / "upstream"


def test_the_generated_file_is_up_to_date() -> None:
    """`make generate` writes it."""
    assert TARGET.read_bytes() == generated()


def assert_like_pymavlink(layout: Layout, message: Any) -> None:
    """Assert that a layout is what pymavlink has generated, but for extension fields it lacks."""
    assert (layout.msgid, layout.name) == (message.id, message.msgname)
    assert layout.crc_extra == message.crc_extra, layout.name
    ours = [(f.name, f.type.removesuffix("_mavlink_version"), f.length) for f in layout.fields]
    theirs = [
        (name, message.fieldtypes[message.fieldnames.index(name)], length)
        for name, length in zip(message.ordered_fieldnames, message.array_lengths)
    ]
    added = layout.fields[len(theirs) :]
    assert ours[: len(theirs)] == theirs
    assert all(field.extension for field in added)
    size = sum(layout.dtype[field.name].itemsize for field in added)
    assert layout.length == message.unpacker.size + size
    units = {n: unit.strip("[]") for n, unit in message.fieldunits_by_name.items()}
    assert {f.name: f.unit for f in layout.fields if f.unit and f not in added} == units


@pytest.mark.parametrize(
    "name", ["minimal", "standard", "common", "ardupilotmega", "ASLUAV", "uAvionix", "cubepilot"]
)
def test_layouts_are_those_of_pymavlink(name: str) -> None:
    """Wire order, types, array lengths, units and checksum seed of every message."""
    module = importlib.import_module(f"pymavlink.dialects.v20.{name}")
    dialect = load_dialect(name)
    for message in module.mavlink_map.values():
        assert_like_pymavlink(dialect.layouts[message.id], message)
    if name not in {"ardupilotmega", "common"}:
        assert set(dialect.layouts) == set(module.mavlink_map)


@pytest.mark.parametrize(
    "file", sorted(pymavlink_definitions().glob("*.xml")), ids=lambda f: f.stem
)
def test_every_dialect_of_the_release_can_be_read(file: Path) -> None:
    """Its messages have types that numpy takes: some hold already what our supplement adds to others."""
    for layout in load_dialect(file.stem).layouts.values():
        assert layout.dtype.itemsize == layout.length


def test_offsets_follow_each_other() -> None:
    """No field overlaps another, none is left out, extensions come last."""
    for layout in DIALECT.layouts.values():
        end = 0
        for field in layout.fields:
            assert field.offset == end, (layout.name, field.name)
            end += layout.dtype[field.name].itemsize
        assert end == layout.length
        base = [field for field in layout.fields if not field.extension]
        assert layout.fields[: len(base)] == tuple(base)
        assert layout.base_length == sum(layout.dtype[f.name].itemsize for f in base)


def generate(xml: Path, folder: Path, name: str) -> ModuleType:
    """Let pymavlink generate Python from a definition, and import it."""
    target = folder / f"{name}.py"
    options = mavgen.Opts(str(target), wire_protocol="2.0", language="Python3", validate=False)
    mavgen.mavgen(options, [str(xml)])
    spec = importlib.util.spec_from_file_location(name, target)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.skipif(
    not UPSTREAM.is_dir(), reason="the XML of mavlink/mavlink is not beside the checkout"
)
def test_the_supplement_is_what_upstream_defines(tmp_path: Path) -> None:
    """Every message we add, or lengthen, as pymavlink's own generator reads the newer definition."""
    newer = generate(UPSTREAM / "common.xml", tmp_path, "newer_common").mavlink_map
    added = set(DIALECT.layouts) - set(MESSAGES)
    assert {8, 380, 410, 411, 436} <= added
    lengthened = {i for i, m in MESSAGES.items() if m.unpacker.size != DIALECT.layouts[i].length}
    for msgid in sorted((added | lengthened) & set(newer)):
        assert_like_pymavlink(DIALECT.layouts[msgid], newer[msgid])
        assert DIALECT.layouts[msgid].length == newer[msgid].unpacker.size


class TestSeeds:
    """The dense table that framing looks ids up in."""

    def test_known_and_unknown_ids(self) -> None:
        ids = np.array([0, 30, 2**24 - 1, 60_001, 1000], np.int32)
        assert DIALECT.seeds(ids).tolist() == [50, 39, -1, -1, -1]

    def test_a_dialect_without_messages(self, tmp_path: Path) -> None:
        empty = tmp_path / "empty.xml"
        empty.write_text("<mavlink><messages/></mavlink>")
        dialect = load_dialect(str(empty))
        assert dialect.seeds(np.array([0, 5], np.int32)).tolist() == [-1, -1]


OWN = """
<mavlink>
  <include>common.xml</include>
  <include>beside.xml</include>
  <messages>
    <message id="60001" name="MY_POSE">
      <description>Ours.</description>
      <field type="uint8_t" name="kind">first in the XML, last on the wire</field>
      <field type="float[3]" name="position" units="m">array</field>
      <field type="char[8]" name="label">text</field>
      <field type="uint64_t" name="time_usec" units="us">widest</field>
      <extensions/>
      <field type="int16_t" name="extra">extension</field>
    </message>
  </messages>
</mavlink>
"""
BESIDE = """
<mavlink><messages><message id="60002" name="BESIDE"><field type="int8_t" name="a"/></message></messages></mavlink>
"""


def test_a_users_own_dialect(tmp_path: Path) -> None:
    """It may include what pymavlink ships and what lies beside it; layouts are those of pymavlink's generator."""
    (tmp_path / "mine.xml").write_text(OWN)
    (tmp_path / "beside.xml").write_text(BESIDE)
    dialect = load_dialect(str(tmp_path / "mine.xml"))
    assert {"MY_POSE", "BESIDE", "HEARTBEAT"} <= set(dialect.by_name)
    for needed in ("common", "standard", "minimal"):
        shipped = pymavlink_definitions() / f"{needed}.xml"
        (tmp_path / shipped.name).write_bytes(shipped.read_bytes())
    module = generate(tmp_path / "mine.xml", tmp_path, "mine_dialect")
    assert set(module.mavlink_map) == set(dialect.layouts)
    assert_like_pymavlink(dialect.by_name["MY_POSE"], module.mavlink_map[60001])
    assert [f.name for f in dialect.by_name["MY_POSE"].fields] == [
        *("time_usec", "position", "kind", "label", "extra")
    ]


def test_dialects_that_include_each_other(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_text("<mavlink><include>b.xml</include><messages/></mavlink>")
    (tmp_path / "b.xml").write_text(
        BESIDE.replace("<mavlink>", "<mavlink><include>a.xml</include>").strip()
    )
    assert list(load_dialect(str(tmp_path / "a.xml")).by_name) == ["BESIDE"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ardupilotmegs", "did you mean ardupilotmega"),
        ("zzz", "choose one of .*common.*, or give an XML file"),
        ("nowhere/mine.xml", "nowhere/mine.xml: no such dialect file"),
    ],
)
def test_a_dialect_that_does_not_exist(name: str, words: str) -> None:
    with pytest.raises(DialectError, match=words):
        load_dialect(name)


def message(*fields: str, head: str = 'id="5" name="M"') -> str:
    """Return a dialect of one message."""
    inside = "".join(f"<field {field}/>" for field in fields)
    return f"<mavlink><messages><message {head}>{inside}</message></messages></mavlink>"


@pytest.mark.parametrize(
    ("xml", "words"),
    [
        ("<mavlink", r"bad\.xml: cannot read the dialect"),
        ("<mavlink><include>gone.xml</include></mavlink>", r"gone\.xml: cannot read the dialect"),
        (message(head='id="5"'), "needs a name and a number"),
        (message(head='id="x" name="M"'), "a number of 24 bits as id"),
        (message(head='id="-5" name="M"'), "a number of 24 bits as id"),
        (message(head='id="99999999" name="M"'), "a number of 24 bits as id"),
        (message('type="complex" name="z"'), r"bad\.xml: M: field 'z' has the unknown type 'comp"),
        (message('type="float[x]" name="z"'), "field 'z' has the array length 'x'"),
        (message('type="float[70]" name="z"'), "its fields take 280 bytes"),
        (message(*['type="float" name="z"'] * 2), "it has the field 'z' twice"),
        (message(), "it has no field"),
    ],
)
def test_a_definition_that_cannot_be_used(tmp_path: Path, xml: str, words: str) -> None:
    """The text says which file, message and field to mend."""
    file = tmp_path / "bad.xml"
    file.write_text(xml)
    with pytest.raises(DialectError, match=words):
        load_dialect(str(file))


def test_the_supplement_completes_only_what_pymavlink_ships(tmp_path: Path) -> None:
    """A user's own file called common.xml means what it says."""
    own = tmp_path / "common.xml"
    own.write_text(BESIDE.strip())
    assert [layout.name for layout in read_definitions(own)] == ["BESIDE"]
    assert "LINK_NODE_STATUS" in load_dialect("common").by_name
    assert SUPPLEMENT.is_file()
