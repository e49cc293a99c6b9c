"""What the registry of origins enters: origins and their moves, homes, launch points, and who asked for them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mavframecheck.vehicle.pairs import metres
from mavframecheck.wire import Place

SAID, ASKED, INFERRED = "GPS_GLOBAL_ORIGIN", "SET_GPS_GLOBAL_ORIGIN", "positions"
"""How an origin is known."""
MSL = "msl"


class Geodetic(NamedTuple):
    """A position on WGS 84."""

    lat: float
    """deg"""
    lon: float
    """deg"""
    alt_msl: float
    """m above mean sea level."""

    def shift_to(self, other: Geodetic) -> tuple[float, float, float]:
        """Return where `other` lies from here, m, NED, as autopilots project."""
        north, east = metres(*(np.asarray(v) for v in (other.lat, other.lon, self.lat, self.lon)))
        return float(north), float(east), self.alt_msl - other.alt_msl


class Origin(NamedTuple):
    """A point that local positions of a vehicle are counted from."""

    origin_id: int
    """Running number among the origins of the vehicle, from 1."""
    system: int
    component: int
    """Of the autopilot."""
    boot: int
    """Restarts of the vehicle before it."""
    at: Geodetic
    height_reference: str
    """What the height is above: ``msl``, as MAVLink defines it."""
    seen: Place
    """The frame that established it."""
    boot_ms: int | None
    """The vehicle's own clock then, ms since its start."""
    source: str
    """GPS_GLOBAL_ORIGIN, SET_GPS_GLOBAL_ORIGIN, or ``positions``: inferred from local and global ones."""
    asked_by: int | None = None
    """Sender (``sysid * 256 + compid``) that asked for it."""


class Move(NamedTuple):
    """An origin that replaced another one within a boot."""

    before: Origin
    after: Origin
    shift: tuple[float, float, float]
    """m, NED: where the new one lies from the old one."""
    seen: Place
    """The first frame that shows it."""
    armed_s: float | None
    """Time since arming then, s of the recording; None: not armed."""
    said: bool
    """Whether a GPS_GLOBAL_ORIGIN says so."""
    local_m: float | None = None
    """How far the local position leapt beyond its velocity, m; None where none was seen right before."""
    global_m: float | None = None
    """The same of the global position."""


class Home(NamedTuple):
    """The place that a vehicle returns to, and that heights above home are counted from."""

    system: int
    component: int
    boot: int
    at: Geodetic
    seen: Place
    armed_s: float | None
    """Time since arming then, s of the recording; None: not armed."""
    asked_by: int | None
    """Sender (``sysid * 256 + compid``) that asked for it; None: the vehicle itself."""


class Launch(NamedTuple):
    """Where a vehicle was when it was armed."""

    system: int
    component: int
    boot: int
    at: Geodetic | None
    """None: not known, or armed before the recording began."""
    seen: Place


class Request(NamedTuple):
    """Somebody asks for an origin or a home."""

    kind: str
    """``origin`` or ``home``."""
    target: int
    """System that is asked; 0: all."""
    at: Geodetic | None
    """None: the current position."""
    sender: int
    """``sysid * 256 + compid``."""
    clock_us: int = 0
    """Time of the recording."""


class Event(NamedTuple):
    """Something, in frame order, that changes what holds."""

    seen: Place
    kind: str
    what: Any
    boot_ms: int | None = None
