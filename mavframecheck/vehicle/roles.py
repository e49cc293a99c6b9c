"""Who is who: roles of senders, and what firmware says of its version."""

from __future__ import annotations

import functools
import re

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics.constants import constant
from mavframecheck.wire import Table

Ints = npt.NDArray[np.int64]

ROLES = ("unknown", "autopilot", "gcs", "companion", "camera", "gimbal", "adsb")

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


class RoleBook:
    """The role of every sender over time, and which systems have an autopilot."""

    def __init__(self) -> None:
        """Start with the convention of ids."""
        self._now = role_table().copy()
        """(65536,) role of each sender before the current batch."""
        self._later = self._now
        """The same after it."""
        self._changes: Table | None = None
        self._autopilots: dict[int, int] = {}
        """System -> running number of the first heartbeat of its autopilot."""

    def update(self, heartbeats: Table) -> None:
        """Take in the heartbeats of a batch."""
        role, sender = _roles_of(heartbeats), heartbeats.frames.sender
        self._later = self._now.copy()
        self._later[sender] = role
        if (self._now[sender] != role).any():
            self._changes = heartbeats
        speaks = np.flatnonzero(role == ROLES.index("autopilot"))
        for row in speaks[np.unique(sender[speaks], return_index=True)[1]].tolist():
            system = int(heartbeats.frames.sysid[row])
            self._autopilots.setdefault(system, int(heartbeats.frames.number[row]))

    def settle(self) -> None:
        """Take the batch as past."""
        self._now, self._changes = self._later, None

    def last(self, sender: int) -> int:
        """Return the latest role of a sender, as a place in ROLES."""
        return int(self._later[sender])

    def of(self, table: Table) -> Ints:
        """Return (n,) the role of each sender before each row, as a place in ROLES."""
        sender = table.frames.sender
        role: Ints = self._now[sender]
        if self._changes is None:
            return role
        said, by = _roles_of(self._changes), self._changes.frames
        for changed in np.unique(by.sender[said != self._now[by.sender]]).tolist():
            rows = np.flatnonzero(sender == changed)
            own = by.sender == changed
            before = np.searchsorted(by.number[own], table.frames.number[rows]) - 1
            role[rows] = np.where(before >= 0, said[own][np.maximum(before, 0)], role[rows])
        return role

    def autopilot_for(self, sysid: Ints, number: Ints) -> Ints:
        """Return the sender's own system where its autopilot was heard, else the only one heard.

        Where none was heard yet it is the one that is heard first; negative where it is not known.
        """
        if not self._autopilots:
            return np.full(len(sysid), -1, np.int64)
        heard_from = np.full(256, np.iinfo(np.int64).max)
        heard_from[list(self._autopilots)] = list(self._autopilots.values())
        heard = np.searchsorted(np.sort(list(self._autopilots.values())), number, side="right")
        only = np.where(heard <= 1, np.argmin(heard_from), -1)
        return np.where(heard_from[sysid] <= number, sysid, only)


def _roles_of(heartbeats: Table) -> Ints:
    """Return (n,) the role that each HEARTBEAT announces, as a place in ROLES."""
    kind = heartbeats["type"].astype(np.int64) << 8 | heartbeats["autopilot"]
    kinds, which = np.unique(kind, return_inverse=True)
    names = [role_from_heartbeat(k >> 8, k & 0xFF) for k in kinds.tolist()]
    return np.array([ROLES.index(name) for name in names], np.int64)[which]


def version_number(major: int, minor: int, patch: int) -> int:
    """Return a version as one number that sorts: 4.5.7 is 4005007."""
    return (major * _VERSION_BASE + minor) * _VERSION_BASE + patch


def version_text(number: float | None) -> str | None:
    """Return ``4.5.7`` for 4005007, None for what is not known."""
    if number is None:
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
