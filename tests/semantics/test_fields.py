"""The field table: closed words, real fields, honest units, nothing forgotten."""

from __future__ import annotations

import csv
import re
from fnmatch import fnmatch
from math import pi
from pathlib import Path

import pytest

from mavframecheck import semantics
from mavframecheck.semantics import FieldTag, _tables
from mavframecheck.semantics.enums import AltRef, CovLayout, Frame, Quantity
from mavframecheck.semantics.units import to_si
from tests.semantics.mavxml import (
    ardupilotmega_xml,
    needs_upstream,
    pymavlink_xml,
    upstream_xml,
)

NOT_AMONG_THE_XML_FILES = {
    "CONTROL_LOADING_AXIS",
    "MOTION_PLATFORM_STATE",
    "REXROTH_MOTION_PLATFORM",
    "MOTION_CUE_EXTRA",
    "EYE_TRACKING_DATA",
}
"""Messages of marsh.xml, which neither XML folder holds."""

POSITIONAL_UNITS = {
    *("degE7", "degE5", "deg", "cdeg", "deg/2", "rad", "rad/s", "mrad/s", "deg/s", "ddeg/s"),
    *("m", "dm", "cm", "mm", "dam", "m/s", "dm/s", "cm/s", "mm/s", "m/s*5", "m/s/s", "mG"),
    *("us", "ms", "ns", "s", "cs"),
}
POSITIONAL_NAMES = re.compile(
    r"(^|_)(lat|lon|lng|latitude|longitude|alt|altitude|roll|pitch|yaw|heading|hdg|cog|q|quaternion"
    r"|covariance|mask|frame|frame_id|time|timestamp|velocity|speed|position)(_|$)"
    r"|^(x|y|z|vx|vy|vz|flags|ignore_flags|fields_updated)$"
)


def _own_tags() -> list[FieldTag]:
    """Return the tags of the field table, without the parameters of single commands."""
    return [t for m in semantics.messages() for t in semantics.tags(m) if not _of_one_command(t)]


def _of_one_command(tag: FieldTag) -> bool:
    return any(c.field == "command" and len(c.values) == 1 for c in tag.when)


def test_every_row_is_made_of_closed_words() -> None:
    """Parsing every row succeeds, so no cell holds an unknown word, unit or sentinel."""
    assert len(semantics.messages()) == 218
    assert len(semantics.all_tags()) > 1800


def test_a_view_of_a_field_is_described_once() -> None:
    """No two rows speak of the same field under the same condition."""
    rows = _tables.read("fields")
    keys = [(row["message"], row["field"], row["when"]) for row in rows]
    assert sorted(keys) == sorted(set(keys))


def test_fields_exist_in_pymavlink_unless_marked_upstream() -> None:
    """The dialect column tells truthfully which XML has a field."""
    known = pymavlink_xml().fields
    wrong = [
        f"{tag.message}.{tag.field}"
        for tag in _own_tags()
        if ((tag.message, tag.field) in known) == (tag.dialect == "upstream")
    ]
    assert wrong == []


@needs_upstream
def test_upstream_fields_exist_upstream() -> None:
    """A field that pymavlink lacks is in the XML of mavlink/mavlink."""
    known = upstream_xml().fields
    missing = {
        tag.message
        for tag in semantics.find(dialect="upstream")
        if (tag.message, tag.field) not in known and not _of_one_command(tag)
    }
    assert missing == NOT_AMONG_THE_XML_FILES


def _unit_differences(xml: str) -> dict[tuple[str, str, str], str]:
    """Return (message, field, our unit) -> unit of one XML, from the list of known differences."""
    rows = _tables.read("unit_differences")
    assert all(row["reason"] for row in rows)
    return {(r["message"], r["field"], r["unit"]): r["xml_unit"] for r in rows if r["xml"] == xml}


def _found_differences(fields: dict[tuple[str, str], str]) -> dict[tuple[str, str, str], str]:
    return {
        (tag.message, tag.field, tag.unit): fields[tag.message, tag.field]
        for tag in _own_tags()
        if fields.get((tag.message, tag.field), tag.unit) != tag.unit
        and not any(c.field == "command" for c in tag.when)
    }


def test_units_agree_with_pymavlink() -> None:
    """Every unit is the XML's, or the difference is listed with its reason; no stale entry."""
    units = {key: field.get("units", "") for key, field in pymavlink_xml().fields.items()}
    assert _found_differences(units) == _unit_differences("pymavlink")


@needs_upstream
def test_units_agree_with_upstream() -> None:
    """As for pymavlink, against mavlink/mavlink."""
    units = {key: field.get("units", "") for key, field in upstream_xml().fields.items()}
    assert _found_differences(units) == _unit_differences("upstream")


def test_every_positional_field_is_tagged() -> None:
    """A unit or a name that speaks of position, attitude, motion or time has a row, or a reason."""
    tagged = {(tag.message, tag.field) for tag in semantics.all_tags()}
    missing = {
        key
        for key, field in ardupilotmega_xml().fields.items()
        if key not in tagged
        if field.get("units") in POSITIONAL_UNITS or POSITIONAL_NAMES.search(key[1])
    }
    unexplained = [key for key in sorted(missing) if not any(_excused(key, e) for e in EXCUSES)]
    assert unexplained == []
    idle = [e for e in EXCUSES if not any(_excused(key, e) for key in missing)]
    assert idle == []


with (Path(__file__).parent / "untagged.csv").open(newline="") as _lines:
    EXCUSES = [(row["message"], row["field"], row["reason"]) for row in csv.DictReader(_lines)]
"""Fields without a row: message, field pattern, reason."""


def _excused(key: tuple[str, str], excuse: tuple[str, str, str]) -> bool:
    return key[0] == excuse[0] and fnmatch(key[1], excuse[1])


def test_selectors_are_fields_of_the_same_message() -> None:
    """Every field that a tag leans on exists beside it, and the selector knows of it."""
    for tag in semantics.all_tags():
        beside = {other.field for other in semantics.tags(tag.message)}
        leans_on = {tag.frame_field, tag.ignore_field, tag.time_field, tag.instance_field}
        leans_on |= {condition.field for condition in tag.when}
        assert leans_on - {""} <= beside, f"{tag.message}.{tag.field}"
        if not _of_one_command(tag):
            for name in {tag.frame_field, tag.ignore_field} - {""}:
                assert tag.field in semantics.tags_of(tag.message, name)[0].selects


def test_instances_are_told_apart() -> None:
    """Where the XML marks an instance field, every other tag of the message names it."""
    for (message, field), element in pymavlink_xml().fields.items():
        if element.get("instance") == "true":
            for tag in semantics.tags(message):
                assert (tag.instance_field or tag.field) == field, f"{message}.{tag.field}"


def test_a_frame_from_a_field_names_that_field() -> None:
    """`by_field` and `by_frame` come with the field to look at, and nothing else does."""
    dependent = {Frame.BY_FIELD, Frame.GIMBAL_BY_FLAGS}
    for tag in semantics.all_tags():
        leans = tag.frame in dependent or tag.alt_ref in {AltRef.BY_FRAME, AltRef.BY_FIELD}
        assert leans == bool(tag.frame_field), f"{tag.message}.{tag.field}"


def test_an_altitude_by_frame_leans_on_a_mav_frame() -> None:
    """`by_frame` always means MAV_FRAME; other selectors are `by_field`."""
    for tag in semantics.find(alt_ref="by_frame"):
        selectors = semantics.tags_of(tag.message, tag.frame_field)
        assert "MAV_FRAME" in {selector.enum for selector in selectors}, tag.message


@pytest.mark.parametrize(
    ("quantity", "attribute"),
    [
        (Quantity.ALTITUDE, "alt_ref"),
        (Quantity.TIMESTAMP, "clock"),
        (Quantity.LATITUDE, "frame"),
        (Quantity.POSITION, "frame"),
        (Quantity.VELOCITY, "frame"),
        (Quantity.HEADING, "frame"),
        (Quantity.COVARIANCE, "cov_layout"),
        (Quantity.MASK, "enum"),
        (Quantity.FRAME_SELECTOR, "enum"),
    ],
)
def test_a_quantity_says_what_it_must(quantity: Quantity, attribute: str) -> None:
    """An altitude without a reference or a stamp without a clock is not a meaning."""
    silent = [
        f"{tag.message}.{tag.field}"
        for tag in semantics.find(quantity=quantity)
        if not getattr(tag, attribute)
    ]
    assert silent == []


def test_latitude_and_longitude_stay_in_degrees_and_other_angles_do_not() -> None:
    """The one exception to SI holds for these two quantities only."""
    for tag in semantics.all_tags():
        in_degrees = tag.si_unit == "deg"
        assert in_degrees == (tag.quantity in {Quantity.LATITUDE, Quantity.LONGITUDE})


def test_scales_follow_the_unit() -> None:
    """Scales that people get wrong."""
    assert to_si("degE7", Quantity.LATITUDE) == (1e-7, "deg")
    assert to_si("m/s*5", Quantity.SPEED) == (0.2, "m/s")
    assert to_si("cdeg", Quantity.HEADING) == (1e-2 * pi / 180, "rad")
    assert to_si("deg/2", Quantity.HEADING) == (2 * pi / 180, "rad")
    assert to_si("mG", Quantity.SPECIFIC_FORCE) == (9.80665e-3, "m/s^2")


@pytest.mark.parametrize(
    ("layout", "side", "length"),
    [
        (CovLayout.UPPER_6, 6, 21),
        (CovLayout.UPPER_9, 9, 45),
        (CovLayout.FULL_6, 6, 36),
        (CovLayout.FULL_3, 3, 9),
    ],
)
def test_layouts_fit_the_arrays_of_the_xml(layout: CovLayout, side: int, length: int) -> None:
    """The array length is the layout's, and the diagonal lies where rows of that side put it."""
    tags = semantics.find(cov_layout=layout)
    assert tags
    for tag in tags:
        assert pymavlink_xml().fields[tag.message, tag.field].get("type") == f"float[{length}]"
        steps = [side + 1] * side if layout.startswith("full") else list(range(side, 0, -1))
        assert tag.diagonal == tuple(sum(steps[:i]) for i in range(side))


def test_invalid_values_of_the_xml_are_sentinels() -> None:
    """Where pymavlink's XML declares an invalid value, the tag has a sentinel or a stated reason."""
    silent = [
        f"{tag.message}.{tag.field}"
        for tag in _own_tags()
        if pymavlink_xml().fields.get((tag.message, tag.field)) is not None
        and pymavlink_xml().fields[tag.message, tag.field].get("invalid")
        and not tag.sentinels
    ]
    assert silent == []
