"""Looking meaning up: by message, by criteria, by command, by partner."""

from __future__ import annotations

import subprocess
import sys

import pytest

from mavframecheck import semantics
from mavframecheck.semantics import Condition, FieldTag
from mavframecheck.semantics.catalogue import group
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES, METRIC_FRAMES


def _only(message: str, field: str) -> FieldTag:
    (tag,) = semantics.tags_of(message, field)
    return tag


def _fields(partners: dict[str, FieldTag]) -> dict[str, str]:
    return {alias: tag.field for alias, tag in partners.items()}


def test_an_unknown_message_has_no_tags() -> None:
    """Messages without a row are silent, not errors."""
    assert semantics.tags("HEARTBEAT_OF_SOMEBODY") == ()


def test_partners_of_a_latitude() -> None:
    """A latitude leads to its longitude, altitudes and velocity by short names."""
    assert _fields(semantics.partners(_only("GLOBAL_POSITION_INT", "lat"))) == {
        "lat": "lat",
        "lon": "lon",
        "alt": "alt",
        "relative_alt": "relative_alt",
        "vx": "vx",
        "vy": "vy",
        "vz": "vz",
        "yaw": "hdg",
    }


def test_partners_stay_with_their_subject() -> None:
    """The next waypoint of a UTM report is not mixed with the vehicle."""
    expected = {"lat": "next_lat", "lon": "next_lon", "alt": "next_alt"}
    assert _fields(semantics.partners(_only("UTM_GLOBAL_POSITION", "next_lat"))) == expected


def test_partners_stay_in_their_view() -> None:
    """In a global frame x, y, z of an item are lat, lon, alt; in a local one x, y, z."""
    in_global, in_local = [t for t in semantics.tags_of("MISSION_ITEM_INT", "x") if t.group]
    assert _fields(semantics.partners(in_global)) == {"lat": "x", "lon": "y", "alt": "z"}
    assert _fields(semantics.partners(in_local)) == {"x": "x", "y": "y", "z": "z"}


def test_a_setpoint_has_three_triples() -> None:
    """Groups name the triple; aliases are those of the rules."""
    message = "SET_POSITION_TARGET_LOCAL_NED"
    assert _fields(group(message, "acceleration")) == {"ax": "afx", "ay": "afy", "az": "afz"}
    assert _fields(group(message, "velocity")) == {"vx": "vx", "vy": "vy", "vz": "vz"}


def test_scale_of_an_item_depends_on_frame_and_carrier() -> None:
    """degE7 or 1e-4 m in the integer messages, degrees or metres in the float ones."""
    units = {
        (message, tag.when[0].values == GLOBAL_FRAMES): tag.unit
        for message in ("MISSION_ITEM", "MISSION_ITEM_INT")
        for tag in semantics.tags_of(message, "x")
        if tag.group
    }
    assert units == {
        ("MISSION_ITEM", True): "deg",
        ("MISSION_ITEM", False): "m",
        ("MISSION_ITEM_INT", True): "degE7",
        ("MISSION_ITEM_INT", False): "m*1e4",
    }


def test_every_frame_but_mission_has_a_scale() -> None:
    """Frame 2 means no coordinates."""
    assert sorted(GLOBAL_FRAMES + METRIC_FRAMES) == [f.id for f in semantics.FRAMES if f.id != 2]


def test_find_selects_by_value_and_by_collection() -> None:
    """Criteria are ANDed; a collection means any of them."""
    degrees = semantics.find(quantity="latitude", unit=("deg", "degE7"))
    assert {tag.unit for tag in degrees} == {"deg", "degE7"}
    assert {tag.quantity for tag in degrees} == {"latitude"}
    assert semantics.find(message="ATTITUDE", field="yaw") == semantics.tags_of("ATTITUDE", "yaw")


def test_find_refuses_an_unknown_criterion() -> None:
    """A misspelt key of a rule is an error, not an empty answer."""
    with pytest.raises(TypeError, match="quantiti"):
        semantics.find(quantiti="latitude")


def test_find_refuses_a_word_that_no_row_may_hold() -> None:
    """Neither is a misspelt value."""
    with pytest.raises(ValueError, match="quantity is never latitud"):
        semantics.find(quantity=["latitud", "longitude"])


def test_sentinels_of_a_receiver_yaw() -> None:
    """0 and 65535 say nothing, 36000 says north."""
    codes = {s.value: (s.meaning, s.known) for s in _only("GPS_RAW_INT", "yaw").sentinels}
    assert codes == {
        0: ("not provided", False),
        65535: ("not available now", False),
        36000: ("north", True),
    }


def test_senses_of_ignore_bits() -> None:
    """A set bit ignores a set-point field and gives an updated sensor field."""
    setpoint = _only("SET_POSITION_TARGET_LOCAL_NED", "yaw")
    assert (setpoint.ignore_field, setpoint.ignore_bit, setpoint.ignore_when_set) == (
        ("type_mask", 1024, True)
    )
    sensor = _only("HIGHRES_IMU", "zmag")
    assert (sensor.ignore_field, sensor.ignore_bit, sensor.ignore_when_set) == (
        ("fields_updated", 256, False)
    )


def test_a_mask_knows_the_fields_it_governs() -> None:
    """`selects` of a selector lists what depends on it."""
    assert _only("GPS_INPUT", "ignore_flags").selects == (
        *("alt", "hdop", "vdop", "vn", "ve", "vd"),
        *("speed_accuracy", "horiz_accuracy", "vert_accuracy"),
    )
    assert _only("ODOMETRY", "child_frame_id").selects[:3] == ("vx", "vy", "vz")


def test_a_waypoint_in_its_carriers() -> None:
    """NAV_WAYPOINT: own parameters, and the location that all location commands share."""
    waypoint = semantics.command(semantics.constant("MAV_CMD.NAV_WAYPOINT"), "COMMAND_LONG")
    assert waypoint is not None
    assert (waypoint.name, waypoint.location) == ("NAV_WAYPOINT", True)
    assert {tag.field: tag.quantity for tag in waypoint.params} == {
        "param2": "distance",
        "param3": "distance",
        "param4": "heading",
        "param5": "latitude",
        "param6": "longitude",
        "param7": "altitude",
    }


def test_an_altitude_without_a_location() -> None:
    """CONDITION_CHANGE_ALT has a height in its frame but no latitude."""
    number = semantics.constant("MAV_CMD.CONDITION_CHANGE_ALT")
    assert number in semantics.altitude_commands()
    assert number not in semantics.location_commands()


def test_local_landing_has_its_axes_swapped() -> None:
    """NAV_LAND_LOCAL puts y into param5, and in COMMAND_INT.x it counts 1e-4 m."""
    view = semantics.command(semantics.constant("MAV_CMD.NAV_LAND_LOCAL"))
    assert view is not None
    (tag,) = [tag for tag in view.params if tag.field == "x"]
    assert (tag.axis, tag.unit, tag.scale) == ("y", "m*1e4", 1e-4)


def test_a_parameter_selects_within_its_own_command() -> None:
    """CONDITION_YAW.param4 decides between an absolute and a relative angle."""
    view = semantics.command(semantics.constant("MAV_CMD.CONDITION_YAW"))
    assert view is not None
    angles = {tag.when[1]: tag.quantity for tag in view.params if tag.field == "param1"}
    assert angles == {Condition("param4", (0,)): "heading", Condition("param4", (1,)): "angle"}
    (selector,) = [tag for tag in view.params if tag.field == "param4"]
    assert selector.selects == ("param1",)


def test_an_untagged_command_is_unknown() -> None:
    """Commands without a positional parameter have no view."""
    assert semantics.command(semantics.constant("MAV_CMD.COMPONENT_ARM_DISARM")) is None


def test_reading_meaning_needs_no_arrays() -> None:
    """Importing the catalogue loads neither numpy nor pymavlink."""
    code = (
        "import sys, mavframecheck.semantics as s; s.all_tags();"
        "print([m for m in ('numpy', 'pymavlink', 'rich', 'click') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
