"""Where vehicles were and were sent, on the map: the positions of some messages, thinned out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.positions import Extract, extracts
from mavframecheck.model.trace import Point, Trace
from mavframecheck.semantics.positions import GeodeticPosition, LocalPosition
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.established import Home, Launch, Origin
from mavframecheck.vehicle.flight import Key, SeriesBook, line
from mavframecheck.vehicle.origins import Registry
from mavframecheck.vehicle.pairs import moved
from mavframecheck.wire import Batch, Frames

Floats = npt.NDArray[np.float64]

ROLES = {
    "GLOBAL_POSITION_INT": "vehicle",
    "LOCAL_POSITION_NED": "vehicle",
    "GPS_RAW_INT": "gnss",
    "SIMSTATE": "truth",
    "POSITION_TARGET_GLOBAL_INT": "target",
    "POSITION_TARGET_LOCAL_NED": "target",
    "SET_POSITION_TARGET_GLOBAL_INT": "sent",
    "SET_POSITION_TARGET_LOCAL_NED": "sent",
    "COMMAND_INT": "sent",
    "COMMAND_LONG": "sent",
    "MISSION_ITEM": "plan",
    "MISSION_ITEM_INT": "plan",
}
"""Messages that are drawn, and what they tell: where the vehicle is by itself, by GNSS, in truth; the
target that it holds; where others send it, one position at a time or as a plan."""


class TrackBook:
    """Gathers positions, batch by batch."""

    def __init__(self, *, timed: bool) -> None:
        """Start with none; `timed`: whether the recording has receive times."""
        self._book = SeriesBook(2, timed=timed)

    def update(self, batch: Batch, context: Context) -> None:
        """Take in the positions of a batch."""
        found: dict[Key, list[tuple[Extract, Floats]]] = {}
        for extract in extracts(batch, context, ROLES):
            place = _place(extract)
            if place is not None and not extract.subject:
                sender = extract.sysid * 256 + extract.compid
                found.setdefault((sender, extract.message), []).append((extract, place))
        self._book.add((key, *_in_order(batch, parts)) for key, parts in found.items())

    def traces(self, context: Context) -> Iterator[Trace]:
        """Yield every track as latitude and longitude, deg."""
        for (sender, message), t, values in self._book.traces():
            role = ROLES[str(message)]
            own = context.role(int(sender)) == "autopilot"
            if own or role in ("sent", "plan"):
                label = f"{int(sender) >> 8}/{int(sender) & 0xFF} {message}"
                yield line(label, t, values[:, 0], role, values[:, 1])


def _in_order(batch: Batch, parts: list[tuple[Extract, Floats]]) -> tuple[Frames, Floats]:
    """Return the frames of all parts, in order, and (n, 2) places."""
    number = np.concatenate([extract.number for extract, _ in parts])
    order = np.argsort(number, kind="stable")
    frames = batch.frames.take(number[order] - batch.frames.number[0])
    return frames, np.concatenate([place for _, place in parts])[order]


def _place(extract: Extract) -> Floats | None:
    """Return (n, 2) latitude and longitude, deg, NaN where there is none; None where it has no such place."""
    position, origin, valid = extract.position, extract.origin, extract.measured.valid
    if isinstance(position, GeodeticPosition):
        lat, lon = position.lat_deg, position.lon_deg
    elif isinstance(position, LocalPosition) and position.origin is not None and origin is not None:
        north, east = position.xyz[:, :2].T
        if position.axes == "ENU":
            north, east = east, north
        lat, lon = moved(
            np.asarray(origin.lat_deg), np.asarray(origin.lon_deg), np.asarray(north), east
        )
    else:
        return None
    place = np.column_stack((lat, lon))
    return place if valid is None else np.where(valid[:, np.newaxis], place, np.nan)


def points(registry: Registry) -> Iterator[Point]:
    """Yield homes, origins and launch points of all vehicles."""
    yield from (_point("home", each) for each in registry.homes)
    yield from (_point("origin", each) for each in registry.origins)
    yield from (_point("launch", each) for each in registry.launches if each.at is not None)


def _point(kind: Literal["home", "origin", "launch"], entry: Home | Origin | Launch) -> Point:
    at, t_us = entry.at, entry.seen.t_us
    return Point(
        kind=kind,
        label=f"{kind} of {entry.system}",
        system=entry.system,
        lat=np.nan if at is None else at.lat,
        lon=np.nan if at is None else at.lon,
        alt_msl=np.nan if at is None else at.alt_msl,
        time=None if t_us is None else t_us * 1e-6,
    )
