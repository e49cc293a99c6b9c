"""The registry of origins, homes and launch points of a recording, as `inspect --origins` shows it."""

from __future__ import annotations

from typing import Any

import numpy as np

from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.model.origins import (
    FileOrigins,
    HomeEntry,
    LaunchEntry,
    OriginEntry,
    VehicleOrigins,
)
from mavframecheck.sources import open_recording
from mavframecheck.vehicle.established import MSL, Geodetic, Home, Launch, Origin
from mavframecheck.vehicle.origins import Registry
from mavframecheck.wire import load_dialect


def origins_of_file(path: str, settings: Settings, progress: Progress | None = None) -> FileOrigins:
    """Read the recording at `path` (``-``: standard input) for its origins.

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` when the dialect cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    with open_recording(path, settings.input_kind) as recording:
        reading = Reading(recording, settings, dialect)
        for _ in reading.understood(progress):
            pass
        registry = reading.context.registry
        vehicles = tuple(_vehicle(registry, system) for system in registry.systems)
        return FileOrigins(**reading.summary(), vehicles=vehicles)


def _vehicle(registry: Registry, system: int) -> VehicleOrigins:
    homes = [home for home in registry.homes if home.system == system]
    launches = [(e, e.at) for e in registry.launches if e.system == system and e.at is not None]
    return VehicleOrigins(
        system=system,
        boots=sum(lost == system for lost, _ in registry.lost),
        origins=_origins(registry.of(system)),
        homes=tuple(_home(registry, home) for home in homes),
        launches=tuple(LaunchEntry(**_fix(launch, at)) for launch, at in launches),
    )


def _origins(origins: list[Origin]) -> tuple[OriginEntry, ...]:
    entries = []
    for before, origin in zip([None, *origins], origins, strict=False):
        same = before is not None and before.boot == origin.boot
        entries.append(
            OriginEntry(
                **_fix(origin, origin.at),
                **_from(before.at if before is not None and same else None, origin.at),
                origin_id=origin.origin_id,
                boot_s=None if origin.boot_ms is None else origin.boot_ms * 1e-3,
                source=origin.source,
                asked_by=_name(origin.asked_by),
            )
        )
    return tuple(entries)


def _home(registry: Registry, home: Home) -> HomeEntry:
    place = int(registry.at(home.system, np.array([home.seen.number]))[0])
    origin = registry.origins[place].at if place >= 0 else None
    return HomeEntry(
        **_fix(home, home.at),
        **_from(origin, home.at),
        asked_by=_name(home.asked_by),
        armed=home.armed_s is not None,
    )


def _fix(entry: Origin | Home | Launch, at: Geodetic) -> dict[str, Any]:
    seen = entry.seen
    return {
        "lat": at.lat,
        "lon": at.lon,
        "height_m": at.alt_msl,
        "height_reference": MSL,
        "time": None if seen.t_us is None else seen.t_us * 1e-6,
        "offset": seen.offset,
        "boot": entry.boot,
    }


def _from(before: Geodetic | None, at: Geodetic) -> dict[str, Any]:
    if before is None:
        return dict.fromkeys(("north_m", "east_m", "up_m"))
    north, east, down = before.shift_to(at)
    return {"north_m": north, "east_m": east, "up_m": -down}


def _name(sender: int | None) -> str | None:
    return None if sender is None else f"{sender >> 8}/{sender & 0xFF}"
