"""What `inspect --missions` found: transfers of missions, fences and rally points, and what vehicles hold."""

from __future__ import annotations

import msgspec

from mavframecheck.model.finding import FileSummary


class ItemEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One item of a mission, as it was sent."""

    seq: int
    command: int
    command_name: str
    """Without the prefix: ``NAV_WAYPOINT``; the number where it has no name."""
    frame: int
    frame_name: str
    params: tuple[float | None, float | None, float | None, float | None]
    """param1 to param4; None for NaN."""
    x: float | None
    """Latitude in degrees in a global frame, metres in a local one, else the bare number."""
    y: float | None
    z: float | None
    """Metres; `frame` says above what."""


class Transfer(msgspec.Struct, frozen=True, kw_only=True):
    """One upload, download or removal."""

    what: str
    """``upload``, ``partial upload``, ``download``, ``clear``."""
    sender: str
    """Who sent the items, or asked to remove them: system/component."""
    system: int
    """The vehicle."""
    mission_type: int
    """MAV_MISSION_TYPE: 0 mission, 1 fence, 2 rally points, 255 all."""
    count: int | None
    """Items announced; None where the recording has lost the announcement."""
    items: int
    """Items seen, each once."""
    answer: str | None
    """MAV_MISSION_RESULT of the acknowledgement, None where there was none."""
    time: float | None
    """Receive time of its beginning, s since 1970; None where it cannot be believed."""
    offset: int
    """Of its first frame in the recording, bytes."""


class HeldMission(msgspec.Struct, frozen=True, kw_only=True):
    """What a vehicle holds at the end of the recording."""

    system: int
    autopilot: str | None
    vehicle_type: int | None
    """MAV_TYPE."""
    mission_type: int
    known: str
    """``uploaded``, ``read back``, ``cleared``, or ``not known`` after an upload that was not accepted."""
    count: int
    items: tuple[ItemEntry, ...]
    """In order of `seq`; fewer than `count` where frames were lost."""


class FileMissions(FileSummary, frozen=True, kw_only=True):
    """The missions of one recording."""

    transfers: tuple[Transfer, ...]
    held: tuple[HeldMission, ...]
