"""Every frame and height of the catalogue can be taken apart into its notions."""

from __future__ import annotations

import pytest

from mavframecheck.semantics import FRAMES, _tables, catalogue
from mavframecheck.semantics.enums import AltRef, Frame
from mavframecheck.semantics.references import (
    height_reference,
    reference,
    selected_height,
    selected_reference,
)


def test_every_frame_of_the_catalogue_has_a_reference() -> None:
    words = set(Frame) - {Frame.NONE, Frame.BY_FIELD, Frame.GIMBAL_BY_FLAGS}
    for name in (*words, *(facts.name for facts in FRAMES)):
        found = reference(name)
        assert all([found.label, found.system, found.axes, found.origin, found.datum])
        assert found.projection != "undefined"


def test_every_height_has_a_surface() -> None:
    for word in set(AltRef) - {AltRef.NONE, AltRef.BY_FRAME, AltRef.BY_FIELD}:
        assert height_reference(word).surface


def test_datum_only_where_something_ties_it_to_the_earth() -> None:
    assert reference("GLOBAL_RELATIVE_ALT").datum == "WGS 84"
    assert reference("LOCAL_NED").datum == "none"
    assert reference("frame 99").system == "undefined"


@pytest.mark.parametrize(
    ("enum", "value", "name"),
    [
        ("MAV_FRAME", 8, "BODY_NED"),
        ("GIMBAL_DEVICE_FLAGS", 64, "gimbal_north"),
        ("GIMBAL_DEVICE_FLAGS", 32 | 16, "gimbal_heading"),
        ("GIMBAL_MANAGER_FLAGS", 16, "gimbal_north"),
        ("GIMBAL_MANAGER_FLAGS", 0, "gimbal_heading"),
        ("GIMBAL_MANAGER_FLAGS", 96, "unspecified"),
        ("RTK_BASELINE_COORDINATE_SYSTEM", 0, "ecef"),
        ("RTK_BASELINE_COORDINATE_SYSTEM", 9, "unspecified"),
    ],
)
def test_frames_by_selector(enum: str, value: int, name: str) -> None:
    assert selected_reference(enum, value) == name


@pytest.mark.parametrize(
    ("enum", "value", "name"),
    [
        ("MAV_FRAME", 3, "home"),
        ("MAV_FRAME", 2, "unspecified"),
        ("MAV_FRAME", 99, "unspecified"),
        ("RALLY_FLAGS", 0, "home"),
        ("RALLY_FLAGS", 4, "msl"),
        ("RALLY_FLAGS", 4 | 3 << 3, "terrain"),
        ("RANGING_BEACON_ALT_TYPE", 0, "ellipsoid"),
    ],
)
def test_heights_by_selector(enum: str, value: int, name: str) -> None:
    assert selected_height(enum, value) == name


def test_selected_references_exist() -> None:
    enums = {tag.enum for tag in catalogue.all_tags()}
    for row in _tables.read("selected"):
        assert row["enum"] in enums
        assert reference(row["frame"] or "unspecified").system != "undefined"
        assert height_reference(row["height"] or "unspecified").surface
