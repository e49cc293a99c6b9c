"""Names for people: vehicle types, autopilots, components, flight modes; and the autopilot family."""

from __future__ import annotations

from functools import cache
from typing import Literal

from mavframecheck.semantics import _tables
from mavframecheck.semantics.constants import constant, entry_name

Family = Literal["px4", "arducopter", "arduplane", "ardurover", "ardusub", "ardupilot", "other"]
"""Autopilot families that behave alike; `ardupilot` is ArduPilot on any other type of vehicle."""

FAMILY_NAMES = {
    "px4": "PX4",
    "ardupilot": "ArduPilot",
    "arducopter": "ArduCopter",
    "arduplane": "ArduPlane",
    "ardurover": "ArduRover",
    "ardusub": "ArduSub",
}
"""How people call the families."""

_ARDUPILOT_TYPES: dict[Family, tuple[str, ...]] = {
    "arducopter": (
        *("QUADROTOR", "COAXIAL", "HELICOPTER", "HEXAROTOR", "OCTOROTOR"),
        *("TRICOPTER", "DODECAROTOR", "DECAROTOR"),
    ),
    "arduplane": (
        *("FIXED_WING", "VTOL_TAILSITTER_DUOROTOR", "VTOL_TAILSITTER_QUADROTOR", "VTOL_TILTROTOR"),
        *("VTOL_FIXEDROTOR", "VTOL_TAILSITTER", "VTOL_TILTWING", "VTOL_RESERVED5"),
    ),
    "ardurover": ("GROUND_ROVER", "SURFACE_BOAT"),
    "ardusub": ("SUBMARINE",),
}
"""MAV_TYPE entries that each ArduPilot vehicle firmware reports."""


@cache
def _ardupilot_families() -> dict[int, Family]:
    """Return MAV_TYPE -> ArduPilot family."""
    return {
        constant(f"MAV_TYPE.{name}"): family
        for family, types in _ARDUPILOT_TYPES.items()
        for name in types
    }


def family(autopilot: int, mav_type: int) -> Family:
    """Return the autopilot family behind a HEARTBEAT's `autopilot` and `type`."""
    if autopilot == constant("MAV_AUTOPILOT.PX4"):
        return "px4"
    if autopilot == constant("MAV_AUTOPILOT.ARDUPILOTMEGA"):
        return _ardupilot_families().get(mav_type, "ardupilot")
    return "other"


def usual_vehicle(family: str) -> tuple[int, int]:
    """Return the MAV_AUTOPILOT, and the most usual MAV_TYPE, that a HEARTBEAT of a family announces."""
    if family == "px4":
        return constant("MAV_AUTOPILOT.PX4"), constant("MAV_TYPE.QUADROTOR")
    usual = {str(name): types[0] for name, types in _ARDUPILOT_TYPES.items()}[family]
    return constant("MAV_AUTOPILOT.ARDUPILOTMEGA"), constant(f"MAV_TYPE.{usual}")


def type_name(mav_type: int) -> str:
    """Return `QUADROTOR` for 2."""
    return entry_name("MAV_TYPE", mav_type)


def autopilot_name(autopilot: int) -> str:
    """Return `PX4` for 12."""
    return entry_name("MAV_AUTOPILOT", autopilot)


def component_name(component: int) -> str:
    """Return `AUTOPILOT1` for 1."""
    return entry_name("MAV_COMPONENT", component)


@cache
def _modes() -> dict[tuple[str, int], str]:
    """Return (family, custom_mode) -> mode name."""
    return {(row["family"], int(row["custom_mode"])): row["name"] for row in _tables.read("modes")}


def mode_name(family: str, custom_mode: int) -> str:
    """Return the flight mode behind HEARTBEAT.custom_mode, `mode 77` when it has no name.

    PX4 packs its main mode in bits 16-23 and its sub mode in bits 24-31; for a sub mode without a
    name the main mode's name is given.
    """
    modes = _modes()
    known = modes.get((family, custom_mode))
    if known is None and family == "px4":
        known = modes.get((family, custom_mode & 0x00FF0000))
    return known or f"mode {custom_mode}"
