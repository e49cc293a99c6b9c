"""Frames, masks, constants, commands and modes against the XML and against pymavlink."""

from __future__ import annotations

import re
from enum import Enum, EnumType
from pathlib import Path

import pytest
from pymavlink import mavutil

from mavframecheck.semantics import (
    FRAMES,
    _tables,
    all_tags,
    constant,
    enums,
    family,
    frame_facts,
    frame_name,
    mode_name,
)
from mavframecheck.semantics.commands import all_commands
from mavframecheck.semantics.constants import entry_name
from mavframecheck.semantics.enums import FrameKind, FrameStatus, MaskSense
from mavframecheck.semantics.masks import (
    bits,
    governed_fields,
    mask_enums,
    mask_fields,
    mask_of,
    undefined_bits,
    words,
)
from mavframecheck.semantics.names import autopilot_name, component_name, type_name
from tests.semantics.mavxml import needs_upstream, pymavlink_xml, upstream_xml

CONVENTIONS = Path(__file__).parents[2] / "docs" / "conventions.md"


def test_frames_agree_with_the_xml() -> None:
    """The table has every MAV_FRAME value, by number, with the XML's name."""
    named = {f"MAV_FRAME_{frame.name}": frame.id for frame in FRAMES}
    assert named == pymavlink_xml().enums["MAV_FRAME"]
    assert [frame.id for frame in FRAMES] == list(range(22))


def test_frames_that_are_replaced_name_a_current_one() -> None:
    """Following `superseded_by` once leads to a current frame of the same kind and level."""
    for frame in FRAMES:
        assert (frame.superseded_by is None) == (frame.status is FrameStatus.CURRENT)
        if frame.superseded_by is not None:
            newer = FRAMES[frame.superseded_by]
            assert newer.status is FrameStatus.CURRENT
            assert (newer.kind, newer.alt_ref) == (frame.kind, frame.alt_ref)


def test_levels_of_global_frames() -> None:
    """What the third coordinate of each global frame is measured from."""
    levels = {f.id: f.alt_ref.value for f in FRAMES if f.kind is FrameKind.GLOBAL}
    assert levels == {0: "msl", 5: "msl", 3: "home", 6: "home", 10: "terrain", 11: "terrain"}


def test_an_undefined_frame_has_no_facts() -> None:
    """Values outside the enumeration are printable and unknown."""
    assert frame_facts(22) is None
    assert frame_facts(-1) is None
    assert frame_name(99) == "frame 99"


def test_masks_agree_with_the_xml() -> None:
    """Every bit of every mask enumeration has the XML's value."""
    for enum in mask_enums():
        ours = [b for b in bits(enum) if b.dialect == ""]
        if ours:
            assert sorted(b.bit for b in ours) == sorted(pymavlink_xml().enums[enum].values())
            xml = pymavlink_xml().enums[enum]
            assert all(xml[_xml_name(xml, b.name)] == b.bit for b in ours)


def _xml_name(entries: dict[str, int], short: str) -> str:
    """Return the entry that ends in a short name; the longest prefix wins over a longer name."""
    return min((name for name in entries if name.endswith(short)), key=len)


@needs_upstream
def test_bits_marked_upstream_are_upstream() -> None:
    """A bit that pymavlink lacks exists in mavlink/mavlink."""
    for enum in mask_enums():
        for bit in bits(enum):
            if bit.dialect == "upstream":
                assert bit.bit in upstream_xml().enums[enum].values()


def test_ignore_bits_are_bits_of_the_mask() -> None:
    """A field is governed by a bit that its mask defines, in the sense that the mask states."""
    for tag in all_tags():
        enum = mask_of(tag.message, tag.ignore_field) if tag.ignore_field else None
        if enum is not None:
            (bit,) = [b for b in bits(enum) if b.bit == tag.ignore_bit]
            assert bit.sense is (MaskSense.IGNORE if tag.ignore_when_set else MaskSense.USE)


@pytest.mark.parametrize(
    ("enum", "value", "expected"),
    [
        (
            "POSITION_TARGET_TYPEMASK",
            0x0DF8,
            ["uses x, y, z", "ignores vx, vy, vz, ax, ay, az, yaw, yaw rate"],
        ),
        (
            "POSITION_TARGET_TYPEMASK",
            0xF000 | 0x0FC7,
            [
                "uses vx, vy, vz",
                "ignores x, y, z, ax, ay, az, yaw, yaw rate",
                "FORCE_SET set",
                "undefined bits 0xF000",
            ],
        ),
        (
            "ATTITUDE_TARGET_TYPEMASK",
            0b0000_0111,
            ["uses thrust, attitude", "ignores roll rate, pitch rate, yaw rate, 3D thrust"],
        ),
        (
            "ADSB_FLAGS",
            0x0043,
            [
                "uses position, altitude",
                "ignores heading, horizontal velocity, vertical velocity",
                "SIMULATED set",
            ],
        ),
    ],
)
def test_masks_in_words(enum: str, value: int, expected: list[str]) -> None:
    """A mask reads as what it uses, what it ignores and what else is set."""
    assert words(enum, value) == expected


def test_masks_know_their_carriers() -> None:
    """A mask enumeration leads to the fields that carry it and back."""
    assert ("SET_POSITION_TARGET_LOCAL_NED", "type_mask") in mask_fields("POSITION_TARGET_TYPEMASK")
    assert mask_of("GPS_INPUT", "ignore_flags") == "GPS_INPUT_IGNORE_FLAGS"
    assert mask_of("GPS_INPUT", "lat") is None
    assert governed_fields("LANDING_TARGET", "position_valid") == ("x", "y", "z", "q")
    assert undefined_bits("POSITION_TARGET_TYPEMASK", 0x1DF8) == 0x1000


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("MAV_FRAME.LOCAL_NED", 1),
        ("POSITION_TARGET_TYPEMASK.FORCE_SET", 512),
        ("MAV_CMD.NAV_TAKEOFF", 22),
        ("MAV_TYPE.GCS", 6),
        ("MAV_COMPONENT.AUTOPILOT1", 1),
        ("GPS_FIX_TYPE.3D_FIX", 3),
    ],
)
def test_constants_by_name(name: str, value: int) -> None:
    """A rule writes names, never numbers."""
    assert constant(name) == value


def test_an_unknown_constant_names_the_near_ones() -> None:
    """The error helps to spell."""
    with pytest.raises(KeyError, match="LOCAL_NED"):
        constant("MAV_FRAME.LOCAL_NDE")
    with pytest.raises(KeyError, match="MAV_FRAME"):
        constant("MAV_FRAMES.LOCAL_NED")


def test_enumerations_agree_with_pymavlink() -> None:
    """Every entry not marked upstream has the XML's value."""
    for row in _tables.read("enumerations"):
        if not row["dialect"]:
            assert pymavlink_xml().enums[row["enum"]][row["xml_name"]] == int(row["value"])


@needs_upstream
def test_enumerations_agree_with_upstream() -> None:
    """Every entry marked upstream has the value of mavlink/mavlink."""
    for row in _tables.read("enumerations"):
        if row["dialect"] == "upstream":
            assert upstream_xml().enums[row["enum"]][row["xml_name"]] == int(row["value"])


def test_enumerations_are_complete() -> None:
    """No entry of a listed enumeration is missing."""
    rows = _tables.read("enumerations")
    for enum in {row["enum"] for row in rows}:
        ours = {row["xml_name"] for row in rows if row["enum"] == enum}
        assert set(pymavlink_xml().enums.get(enum, {})) <= ours


def test_location_commands_are_all_tagged() -> None:
    """Every command whose XML says hasLocation is in the table with that flag, and no other."""
    flagged = {
        name.removeprefix("MAV_CMD_")
        for name, entry in pymavlink_xml().commands.items()
        if entry.get("hasLocation") == "true"
    }
    assert {fact.name for fact in all_commands().values() if fact.location} == flagged


COMMAND_UNITS_THAT_DIFFER = {
    ("GUIDED_CHANGE_HEADING", "3"): "the XML unit contradicts its text",
    ("EXTERNAL_POSITION_ESTIMATE", "3"): "the XML names metres in the text only",
    ("DO_MOUNT_CONTROL", "1"): "the unit depends on the mount's input mode",
    ("DO_MOUNT_CONTROL", "2"): "the unit depends on the mount's input mode",
    ("DO_MOUNT_CONTROL", "3"): "the unit depends on the mount's input mode",
    ("DO_MOUNT_CONTROL", "4"): "the XML has no unit",
    ("DO_MOUNT_CONTROL", "5"): "the XML has no unit",
    ("DO_MOUNT_CONTROL", "6"): "the XML has no unit",
    ("EXTERNAL_POSITION_ESTIMATE", "7"): "the parameter is not used",
}


def _xml_unit(command: str, row: dict[str, str]) -> str:
    """Return the unit of a parameter in the XML; the row's own where the XML lacks the command."""
    entry = pymavlink_xml().commands.get(f"MAV_CMD_{command}")
    params = () if entry is None else entry.iter("param")
    found = [param.get("units", "") for param in params if param.get("index") == row["param"]]
    return found[0] if found else row["unit"]


def test_command_units_agree_with_the_xml() -> None:
    """Parameters have the XML's unit unless the carrier decides it or a reason is listed."""
    differ = {
        (fact.name, row["param"])
        for fact in all_commands().values()
        for row in fact.rows
        if not row["dialect"] and row["unit"] not in {"by_carrier", _xml_unit(fact.name, row)}
    }
    assert differ == set(COMMAND_UNITS_THAT_DIFFER)


def test_command_numbers_agree_with_their_names() -> None:
    """The number beside a command's name is its own."""
    for fact in all_commands().values():
        assert constant(f"MAV_CMD.{fact.name}") == fact.id


@pytest.mark.parametrize(
    ("autopilot", "mav_type", "expected"),
    [
        (12, 2, "px4"),
        (3, 2, "arducopter"),
        (3, 4, "arducopter"),
        (3, 1, "arduplane"),
        (3, 21, "arduplane"),
        (3, 10, "ardurover"),
        (3, 11, "ardurover"),
        (3, 12, "ardusub"),
        (3, 5, "ardupilot"),
        (8, 6, "other"),
        (0, 2, "other"),
    ],
)
def test_families(autopilot: int, mav_type: int, expected: str) -> None:
    """Autopilot and type of a HEARTBEAT say which firmware it is."""
    assert family(autopilot, mav_type) == expected


@pytest.mark.parametrize(
    ("stack", "modes"),
    [
        ("arducopter", mavutil.mode_mapping_acm),
        ("arduplane", mavutil.mode_mapping_apm),
        ("ardurover", mavutil.mode_mapping_rover),
        ("ardusub", mavutil.mode_mapping_sub),
    ],
)
def test_ardupilot_modes_agree_with_pymavlink(stack: str, modes: dict[int, str]) -> None:
    """Mode numbers of ArduPilot vehicles have pymavlink's names."""
    assert {number: mode_name(stack, number) for number in modes} == modes


def test_px4_modes_unpack_main_and_sub_mode() -> None:
    """PX4 packs two numbers into custom_mode; an unnamed sub mode falls back to the main one."""
    assert mode_name("px4", 6 << 16) == "OFFBOARD"
    assert mode_name("px4", 4 << 16 | 5 << 24) == "AUTO_RTL"
    assert mode_name("px4", 4 << 16 | 99 << 24) == "AUTO"
    assert mode_name("px4", 99 << 16) == "mode 6488064"


def test_names_for_people() -> None:
    """Types, autopilots and components have names; unknown ones stay numbers."""
    assert (type_name(2), autopilot_name(12), component_name(191)) == (
        ("QUADROTOR", "PX4", "ONBOARD_COMPUTER")
    )
    assert type_name(250) == "250"


def test_every_tagged_value_can_be_said() -> None:
    """A field may be tagged with an enumeration whose names are not shipped: its numbers stay numbers."""
    for tag in all_tags():
        if tag.enum:
            assert entry_name(tag.enum, 250)
    assert entry_name("MAV_ODID_HOR_ACC", 3) == "3"


def test_conventions_explain_every_word() -> None:
    """Each word of each closed vocabulary is on the conventions page."""
    page = set(re.findall(r"`([a-z0-9_]+)`", CONVENTIONS.read_text(encoding="utf-8")))
    vocabularies = [v for v in vars(enums).values() if isinstance(v, EnumType)]
    words_used = {word for vocabulary in vocabularies for word in _words_of(vocabulary)}
    assert sorted(words_used - page) == []


def _words_of(vocabulary: EnumType) -> list[str]:
    members: dict[str, Enum] = dict(vocabulary.__members__)
    return [str(word.value) for word in members.values() if word.value]
