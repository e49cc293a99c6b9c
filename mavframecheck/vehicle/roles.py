"""Who is who: roles of senders, and what firmware says of its version."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle.history import LATE_FRAMES, LATE_US
from mavframecheck.wire import Frames, Table

Ints = npt.NDArray[np.int64]
_NUMBER_BITS = 38
_NUMBER = (1 << _NUMBER_BITS) - 1
_NEVER = np.int64(1 << 62)

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
def role_table() -> npt.NDArray[np.int8]:
    """(65536,) role by convention of each sender (``sysid * 256 + compid``), as a place in ROLES."""
    by_component = np.array(
        [ROLES.index(role_from_ids(0, compid)) for compid in range(256)], np.int8
    )
    table = np.tile(by_component, 256)
    table[_GCS_SYSTEM << 8 :] = ROLES.index("gcs")
    return table


class Meant(NamedTuple):
    """Whom rows are about; all (n,)."""

    system: Ints
    """Negative where it is not known."""
    since: Ints
    """Running number of the frame from which on that could be known: the row, or the first heartbeat behind it."""


class RoleBook:
    """The role of every sender over time, and which systems have an autopilot."""

    def __init__(self) -> None:
        """Start with the convention of ids."""
        self._before = role_table().copy()
        """(65536,) role of each sender before the changes that are kept."""
        self._now = self._before.copy()
        """(65536,) the latest."""
        self._order: Ints = np.zeros(0, np.int64)
        """Sender and frame number of the heartbeats of late, as one number, ascending."""
        self._role: Ints = np.zeros(0, np.int64)
        self._first_number = np.full(256, _NEVER)
        self._first_clock_us = np.full(256, _NEVER)
        """(256,) number and time of the first heartbeat of each system's autopilot."""

    def update(self, heartbeats: Table) -> None:
        """Take in the heartbeats of a batch."""
        frames, role = heartbeats.frames, _roles_of(heartbeats)
        order = np.concatenate((self._order, frames.sender << _NUMBER_BITS | frames.number))
        by = np.argsort(order)
        self._order, self._role = order[by], np.concatenate((self._role, role))[by]
        self._now[frames.sender] = role
        speaks = np.flatnonzero(role == ROLES.index("autopilot"))
        for row in speaks[np.unique(frames.sysid[speaks], return_index=True)[1]].tolist():
            system = int(frames.sysid[row])
            if self._first_number[system] == _NEVER:
                self._first_number[system] = frames.number[row]
                self._first_clock_us[system] = frames.clock_us[row]

    def settle(self, number: int) -> None:
        """Forget, when frame `number` was the last one, what no waiting row can ask for."""
        if not len(self._order):
            return
        old = (self._order & _NUMBER) < number - LATE_FRAMES
        self._before[self._order[old] >> _NUMBER_BITS] = self._role[old]
        self._order, self._role = self._order[~old], self._role[~old]

    def last(self, sender: int) -> int:
        """Return the latest role of a sender, as a place in ROLES."""
        return int(self._now[sender])

    def of(self, table: Table) -> Ints:
        """Return (n,) the role of each sender before each row, as a place in ROLES."""
        sender = table.frames.sender
        role = self._before[sender].astype(np.int64)
        if (self._role == self._before[self._order >> _NUMBER_BITS]).all():
            return role
        place = np.searchsorted(self._order, sender << _NUMBER_BITS | table.frames.number) - 1
        at = np.maximum(place, 0)
        said = (place >= 0) & (self._order[at] >> _NUMBER_BITS == sender)
        return np.where(said, self._role[at], role)

    def autopilot_for(self, frames: Frames) -> Meant:
        """Return the sender's own system where its autopilot was heard, else the only one heard.

        Where none was heard yet it is the one that is heard first, and soon.
        """
        number, sysid = frames.number, frames.sysid
        first = int(np.argmin(self._first_number))
        heard = np.searchsorted(np.sort(self._first_number), number, side="right")
        soon = self._first_number[first] - number <= LATE_FRAMES
        soon &= self._first_clock_us[first] - frames.clock_us <= LATE_US
        only = np.where((heard == 1) | ((heard == 0) & soon), first, -1)
        own = self._first_number[sysid] <= number
        since = np.where((heard == 0) & soon, self._first_number[first], number)
        return Meant(np.where(own, sysid, only), np.where(own, number, since))


def _roles_of(heartbeats: Table) -> Ints:
    """Return (n,) the role that each HEARTBEAT announces, as a place in ROLES."""
    kinds = heartbeats["type"].astype(np.int64) << 8 | heartbeats["autopilot"]
    return of_each_kind(kinds, lambda k: ROLES.index(role_from_heartbeat(k >> 8, k & 0xFF)))


def of_each_kind(kinds: Ints, says: Callable[[int], Any]) -> npt.NDArray[Any]:
    """Return (n,) what a function says of each of the numbers (n,); asked once for each that occurs."""
    occurring = np.unique(kinds)
    return np.array([says(kind) for kind in occurring.tolist()])[np.searchsorted(occurring, kinds)]


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


@functools.lru_cache(maxsize=4096)
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
