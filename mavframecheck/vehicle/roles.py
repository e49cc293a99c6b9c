"""Who is who: roles of senders, and what firmware says of its version."""

from __future__ import annotations

import functools
import re
from typing import get_args

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.names import Family

ROLES = ("unknown", "autopilot", "gcs", "companion", "camera", "gimbal", "adsb")
FAMILIES = ("unknown", *get_args(Family))

_BY_TYPE = {
    "GCS": "gcs",
    "ONBOARD_CONTROLLER": "companion",
    "CAMERA": "camera",
    "GIMBAL": "gimbal",
    "ADSB": "adsb",
}
_GCS_SYSTEM = 255
_BY_COMPONENT = {
    1: "autopilot",
    **dict.fromkeys((190,), "gcs"),
    **dict.fromkeys(range(191, 195), "companion"),
    **dict.fromkeys((*range(100, 106),), "camera"),
    **dict.fromkeys((154, *range(171, 176)), "gimbal"),
    156: "adsb",
}
_VERSION = re.compile(
    rb"(?:Ardu\w+|APM:?\w+|Rover|Blimp|AntennaTracker|PX4)\s+V?(\d+)\.(\d+)\.?(\d+)?", re.IGNORECASE
)
_VERSION_BASE = 1000


def role_from_heartbeat(mav_type: int, autopilot: int) -> str:
    """Return the role that a HEARTBEAT announces."""
    if autopilot != constant("MAV_AUTOPILOT.INVALID") and mav_type != constant("MAV_TYPE.GCS"):
        return "autopilot"
    return _roles_by_type().get(mav_type, "unknown")


def role_from_ids(sysid: int, compid: int) -> str:
    """Return the role that ids suggest by convention, for a sender without a HEARTBEAT so far."""
    if sysid == _GCS_SYSTEM:
        return "gcs"
    return _BY_COMPONENT.get(compid, "unknown")


@functools.cache
def _roles_by_type() -> dict[int, str]:
    return {constant(f"MAV_TYPE.{name}"): role for name, role in _BY_TYPE.items()}


@functools.cache
def role_table() -> npt.NDArray[np.int64]:
    """(65536,) role by convention of each sender (``sysid * 256 + compid``), as a place in ROLES."""
    by_component = np.array([ROLES.index(role_from_ids(0, compid)) for compid in range(256)])
    table = np.tile(by_component, 256)
    table[_GCS_SYSTEM << 8 :] = ROLES.index("gcs")
    return table


def version_number(major: int, minor: int, patch: int) -> int:
    """Return a version as one number that sorts: 4.5.7 is 4005007."""
    return (major * _VERSION_BASE + minor) * _VERSION_BASE + patch


def version_text(number: float) -> str | None:
    """Return ``4.5.7`` for 4005007, None for what is not known (NaN)."""
    if not number > 0:
        return None
    rest, patch = divmod(int(number), _VERSION_BASE)
    major, minor = divmod(rest, _VERSION_BASE)
    return f"{major}.{minor}.{patch}"


def version_from_banner(text: bytes) -> int | None:
    """Return the version in a boot banner (``ArduCopter V4.5.7 (abc)``), None in any other text."""
    match = _VERSION.search(text)
    if not match:
        return None
    major, minor, patch = (int(part or 0) for part in match.groups())
    return version_number(major, minor, patch)


def version_from_flight_sw(flight_sw_version: int) -> int | None:
    """Return the version in AUTOPILOT_VERSION.flight_sw_version (one byte each), None when unset."""
    if not flight_sw_version:
        return None
    return version_number(
        flight_sw_version >> 24, flight_sw_version >> 16 & 0xFF, flight_sw_version >> 8 & 0xFF
    )
