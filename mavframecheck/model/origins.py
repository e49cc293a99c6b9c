"""What `inspect --origins` found: where local frames begin, where home is, where vehicles set out."""

from __future__ import annotations

import msgspec

from mavframecheck.model.finding import FileSummary


class Fix(msgspec.Struct, frozen=True, kw_only=True):
    """A place on WGS 84, and the frame that gave it."""

    lat: float
    """deg"""
    lon: float
    """deg"""
    height_m: float
    height_reference: str
    """What the height is above: ``msl``."""
    time: float | None
    """Receive time, s since 1970; None where it cannot be believed."""
    offset: int
    """Of the frame in the recording, bytes."""
    boot: int
    """Restarts of the vehicle before it."""


class OriginEntry(Fix, frozen=True, kw_only=True):
    """A point that local positions of a vehicle are counted from."""

    origin_id: int
    """Running number among the origins of the vehicle."""
    boot_s: float | None
    """The vehicle's own clock when it was established, s since its start."""
    source: str
    """GPS_GLOBAL_ORIGIN, SET_GPS_GLOBAL_ORIGIN, or ``positions``: inferred from local and global ones."""
    asked_by: str | None
    """Sender (system/component) that asked for it."""
    north_m: float | None
    """Where it lies from the origin before it in the same boot, m; None for the first one."""
    east_m: float | None
    up_m: float | None


class HomeEntry(Fix, frozen=True, kw_only=True):
    """Where home was put."""

    asked_by: str | None
    """Sender (system/component) that asked for it; None: the vehicle itself."""
    armed: bool
    """Whether the vehicle was armed."""
    north_m: float | None
    """Where it lies from the origin in force, m; None where none is known."""
    east_m: float | None
    up_m: float | None


class LaunchEntry(Fix, frozen=True, kw_only=True):
    """Where the vehicle was when it was armed."""


class VehicleOrigins(msgspec.Struct, frozen=True, kw_only=True):
    """The three histories of one vehicle."""

    system: int
    boots: int
    """Restarts seen."""
    origins: tuple[OriginEntry, ...]
    homes: tuple[HomeEntry, ...]
    launches: tuple[LaunchEntry, ...]


class FileOrigins(FileSummary, frozen=True, kw_only=True):
    """The registry of one recording."""

    vehicles: tuple[VehicleOrigins, ...]
