"""What a stream says about its vehicles, as data: which field of which message feeds which context name.

Everything here is SI; latitude and longitude are degrees, other angles radians, heights metres.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from mavframecheck.semantics.names import family, mode_name
from mavframecheck.vehicle import roles
from mavframecheck.vehicle.history import Bools, Ints, Values
from mavframecheck.wire import Table

SECOND_US = 1_000_000
UNIX_US = 10**15
"""What the standard says of stamps: from here on (2001) they count from 1970."""
ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""

Reader = Callable[[Table], Values]


class Source(NamedTuple):
    """A message that feeds a history, row by row."""

    message: str
    history: str
    reads: Mapping[str, Reader]
    """Quantity of the history -> column of the message, in SI; words as text or bytes."""
    valid: Callable[[Table], Bools] | None = None
    """Rows that say something; None: all of them."""
    key: Literal["system", "command"] = "system"
    """What the rows are remembered by: the sender's system, or that and the command they answer."""


class Name(NamedTuple):
    """A context name that rules may use."""

    sources: tuple[tuple[str, str], ...]
    """(history, quantity), the best one first."""
    meaning: str
    missing: str
    """What the recording lacks when it is unknown."""
    max_age_us: int | None = None
    """Older than this it is unknown."""
    key: Literal["system", "sender", "command"] = "system"
    waits: bool = True
    """Whether a row waits for it; what most recordings never say is not worth waiting for."""
    after: bool = False
    """Whether it is said after the row (an answer) rather than before it."""


def at(field: str, scale: float = 1.0) -> Reader:
    """Return a reader of `field` times `scale`."""
    return lambda table: table[field] * scale


def _placed(lat: str, lon: str) -> Callable[[Table], Bools]:
    """Return a test for positions that are not 0, 0, which means "no position yet"."""
    return lambda table: np.asarray((table[lat] != 0) | (table[lon] != 0))


def _families(table: Table) -> Values:
    return roles.of_each_kind(_kind(table), lambda kind: family(kind & 0xFF, kind >> 8))


def _modes(table: Table) -> Values:
    def mode(said: int) -> str:
        return mode_name(family(said & 0xFF, said >> 8 & 0xFF), said >> 16)

    return roles.of_each_kind(table["custom_mode"].astype(np.int64) << 16 | _kind(table), mode)


def _kind(table: Table) -> Ints:
    return table["type"].astype(np.int64) << 8 | table["autopilot"]


def _is_autopilot(table: Table) -> Bools:
    def speaks(kind: int) -> bool:
        return roles.role_from_heartbeat(kind >> 8, kind & 0xFF) == "autopilot"

    return roles.of_each_kind(_kind(table), speaks)


def _banner_version(table: Table) -> Values:
    version = np.full(len(table), np.nan)
    with_point = np.flatnonzero(np.char.find(table["text"], b".") > 0)
    for row, text in zip(with_point.tolist(), table["text"][with_point].tolist(), strict=True):
        version[row] = roles.version_from_banner(text) or np.nan
    return version


def _flight_sw_version(table: Table) -> Values:
    raw = table["flight_sw_version"].tolist()
    return np.array([roles.version_from_flight_sw(value) or np.nan for value in raw], float)


def _home_height(table: Table) -> Values:
    return (table["alt"].astype(np.int64) - table["relative_alt"]) * 1e-3


def _yaw_of_heading(table: Table) -> Values:
    yaw = np.radians(table["hdg"] * 0.01)
    return np.where(table["hdg"] == 65535, np.nan, np.arctan2(np.sin(yaw), np.cos(yaw)))


def _boot_utc(table: Table) -> Values:
    return table["time_unix_usec"] * 1e-6 - table["time_boot_ms"] * 1e-3


def _param_name(table: Table) -> Values:
    return table["param_id"]


SOURCES: tuple[Source, ...] = (
    Source("HEARTBEAT", "identity", {"family": _families, "type": at("type")}, _is_autopilot),
    Source(
        "HEARTBEAT",
        "state",
        {"armed": lambda t: (t["base_mode"] & ARMED != 0) * 1.0, "mode": _modes},
        _is_autopilot,
    ),
    Source(
        "AUTOPILOT_VERSION",
        "versions",
        {"version": _flight_sw_version},
        lambda t: t["flight_sw_version"] != 0,
    ),
    Source(
        "STATUSTEXT",
        "versions",
        {"version": _banner_version},
        lambda t: ~np.isnan(_banner_version(t)),
    ),
    Source("AUTOPILOT_VERSION", "capabilities", {"mask": at("capabilities")}),
    Source(
        "GLOBAL_POSITION_INT",
        "position",
        {
            "lat": at("lat", 1e-7),
            "lon": at("lon", 1e-7),
            "alt_msl": at("alt", 1e-3),
            "relative_alt": at("relative_alt", 1e-3),
            "vx": at("vx", 1e-2),
            "vy": at("vy", 1e-2),
            "vz": at("vz", 1e-2),
        },
        _placed("lat", "lon"),
    ),
    Source(
        "GLOBAL_POSITION_INT",
        "heading",
        {"yaw": _yaw_of_heading},
        lambda t: t["hdg"] != 65535,
    ),
    Source(
        "GLOBAL_POSITION_INT",
        "home_height",
        {"alt_msl": _home_height},
        _placed("lat", "lon"),
    ),
    Source(
        "HOME_POSITION",
        "home",
        {
            "lat": at("latitude", 1e-7),
            "lon": at("longitude", 1e-7),
            "alt_msl": at("altitude", 1e-3),
        },
    ),
    Source(
        "LOCAL_POSITION_NED",
        "local",
        {name: at(name) for name in ("x", "y", "z", "vx", "vy", "vz")},
    ),
    Source(
        "ATTITUDE",
        "attitude",
        {name: at(name) for name in ("roll", "pitch", "yaw")},
    ),
    Source(
        "GPS_RAW_INT",
        "gnss",
        {
            "fix": at("fix_type"),
            "lat": at("lat", 1e-7),
            "lon": at("lon", 1e-7),
            "alt_msl": at("alt", 1e-3),
            "alt_ellipsoid": at("alt_ellipsoid", 1e-3),
        },
        lambda t: t["fix_type"] >= 3,
    ),
    Source(
        "TERRAIN_REPORT",
        "terrain",
        {
            "height": at("terrain_height"),
            "spacing": at("spacing"),
            "pending": at("pending"),
            "loaded": at("loaded"),
        },
    ),
    Source("SYSTEM_TIME", "boot_utc", {"utc": _boot_utc}, lambda t: t["time_unix_usec"] >= UNIX_US),
    Source("COMMAND_ACK", "command_answers", {"result": at("result")}, key="command"),
    Source("MISSION_ACK", "mission_answers", {"result": at("type")}),
    Source("STATUSTEXT", "texts", {"text": lambda t: t["text"]}, lambda t: t["severity"] <= 4),
)
"""What autopilots say; a source of HEARTBEAT comes before those that need to know who is one."""

REGISTERED = {
    "origin": ("id", "boot", "lat", "lon", "alt_msl"),
    "launch": ("boot", "lat", "lon", "alt_msl"),
}
"""Histories that the registry of origins feeds, and their quantities; what they say holds in its boot only."""

_POSITION = "no GLOBAL_POSITION_INT with a position"
_ORIGIN = "no GPS_GLOBAL_ORIGIN, and no local and global positions together"
_LAUNCH = "the vehicle is not armed in the recording"
_HEARTBEAT = "no HEARTBEAT of the autopilot says what it is"
_FRESH = 30 * SECOND_US


def _names(history: str, subject: str, missing: str, **meanings: str) -> dict[str, Name]:
    """Return names ``subject.quantity`` that are read from one history and go stale."""
    return {
        f"{subject}.{quantity}": Name(((history, quantity),), meaning, missing, _FRESH)
        for quantity, meaning in meanings.items()
    }


NAMES: dict[str, Name] = {
    "sender.role": Name(
        (), "autopilot, gcs, companion, camera, gimbal, adsb, unknown", "", key="sender"
    ),
    "vehicle.autopilot": Name(
        (("identity", "family"),),
        "px4, arducopter, arduplane, ardurover, ardusub, ardupilot, other",
        f"{_HEARTBEAT} (--autopilot tells)",
    ),
    "vehicle.type": Name((("identity", "type"),), "MAV_TYPE", _HEARTBEAT),
    "vehicle.version": Name(
        (("versions", "version"),),
        "version as one number: 4.5.7 is 4005007",
        "neither AUTOPILOT_VERSION nor a boot banner says the version",
        waits=False,
    ),
    "vehicle.capabilities": Name(
        (("capabilities", "mask"),), "MAV_PROTOCOL_CAPABILITY bits", "no AUTOPILOT_VERSION"
    ),
    "vehicle.armed": Name((("state", "armed"),), "1 armed, 0 not", _HEARTBEAT),
    "vehicle.mode": Name((("state", "mode"),), "flight mode by name", _HEARTBEAT),
    **_names(
        "position",
        "vehicle",
        _POSITION,
        lat="latitude, deg",
        lon="longitude, deg",
        alt_msl="height above mean sea level, m",
        relative_alt="height above home, m",
        vx="velocity north, m/s",
        vy="velocity east, m/s",
        vz="velocity down, m/s",
    ),
    **_names(
        "local",
        "local",
        "no LOCAL_POSITION_NED",
        x="north of the local origin, m",
        y="east of the local origin, m",
        z="below the local origin, m",
        vx="velocity north, m/s",
        vy="velocity east, m/s",
        vz="velocity down, m/s",
    ),
    **_names("attitude", "vehicle", "no ATTITUDE", roll="rad", pitch="rad"),
    "vehicle.yaw": Name(
        (("attitude", "yaw"), ("heading", "yaw")), "rad, from true north", "no ATTITUDE", _FRESH
    ),
    "vehicle.boot_utc": Name(
        (("boot_utc", "utc"),),
        "when its clock was zero, s since 1970 UTC",
        "no SYSTEM_TIME with UTC",
        waits=False,
    ),
    "home.lat": Name((("home", "lat"),), "latitude of home, deg", "no HOME_POSITION"),
    "home.lon": Name((("home", "lon"),), "longitude of home, deg", "no HOME_POSITION"),
    "home.alt_msl": Name(
        (("home", "alt_msl"), ("home_height", "alt_msl")),
        "height of home above mean sea level, m (else alt - relative_alt of the vehicle)",
        "neither HOME_POSITION nor GLOBAL_POSITION_INT",
    ),
    **{
        f"origin.{quantity}": Name((("origin", quantity),), meaning, _ORIGIN)
        for quantity, meaning in {
            "id": "running number among the origins of the vehicle",
            "lat": "latitude of the local origin, deg",
            "lon": "longitude of the local origin, deg",
            "alt_msl": "height of the local origin above mean sea level, m",
        }.items()
    },
    **{
        f"launch.{quantity}": Name((("launch", quantity),), meaning, _LAUNCH, waits=False)
        for quantity, meaning in {
            "boot": "restarts before the vehicle was armed last; unknown until it is armed in this boot",
            "lat": "latitude where the vehicle was armed last, deg",
            "lon": "longitude where it was armed last, deg",
            "alt_msl": "height where it was armed last, above mean sea level, m",
        }.items()
    },
    **_names(
        "gnss",
        "gnss",
        "no GPS_RAW_INT with a 3D fix",
        fix="GPS_FIX_TYPE",
        lat="latitude, deg",
        lon="longitude, deg",
        alt_msl="height above mean sea level, m",
        alt_ellipsoid="height above the ellipsoid, m (0: not given)",
    ),
    **_names(
        "terrain",
        "terrain",
        "no TERRAIN_REPORT",
        height="terrain above mean sea level, m",
        spacing="grid spacing, m (0: no data)",
        pending="terrain blocks still to come",
        loaded="terrain blocks loaded",
    ),
    "answer.result": Name(
        (("command_answers", "result"),),
        "MAV_RESULT of the COMMAND_ACK that follows the command",
        "no COMMAND_ACK",
        5 * SECOND_US,
        "command",
        after=True,
    ),
    "answer.mission": Name(
        (("mission_answers", "result"),),
        "MAV_MISSION_RESULT of the MISSION_ACK that follows the item",
        "no MISSION_ACK",
        20 * SECOND_US,
        after=True,
    ),
    "answer.text": Name(
        (("texts", "text"),),
        "the next warning text of the autopilot",
        "no STATUSTEXT",
        2 * SECOND_US,
        after=True,
    ),
}
"""Every context name, with what it means; `docs/rule-files.md` lists them from here."""

WORDS = {"family", "mode", "text"}
"""Quantities that are words: histories hold their places in a list of texts."""

Quantities = dict[str, Any]


def histories() -> dict[str, tuple[str, ...]]:
    """Return history -> its quantities."""
    found = {name: dict.fromkeys(quantities) for name, quantities in REGISTERED.items()}
    for source in SOURCES:
        found.setdefault(source.history, {}).update(dict.fromkeys(source.reads))
    return {history: tuple(quantities) for history, quantities in found.items()}


def ageless() -> frozenset[str]:
    """Return the histories of which only what was said last counts, however long ago."""
    aging = {h for n in NAMES.values() if n.max_age_us is not None or n.after for h, _ in n.sources}
    return frozenset(histories()) - aging
