"""A mission file as the batch that sending it would be, so that every rule judges it as it judges a log.

The batch holds what a ground station and the vehicle would say: HEARTBEAT (which autopilot), HOME_POSITION,
then MISSION_COUNT and MISSION_ITEM_INT for mission, fence and rally points. Nothing was rounded by sending it:
columns are 64-bit, and `Said` follows in columns of its own, which no log has.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from math import isnan
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from mavframecheck.missions.planned import (
    FENCE,
    MISSION,
    RALLY,
    SAID,
    Home,
    Item,
    Places,
    Planned,
)
from mavframecheck.model import MissionLocation
from mavframecheck.semantics.constants import constant, entry_name
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES, METRIC_FRAMES
from mavframecheck.semantics.names import family as family_of
from mavframecheck.semantics.names import usual_vehicle
from mavframecheck.wire import Batch, Dialect, Field, Frames, Layout, Table

ITEM = "MISSION_ITEM_INT"
"""The message that carries the items."""
VEHICLE, GROUND_STATION = (1, 1), (255, 190)
"""System and component of who would speak."""
UNSET = 2**31 - 1
"""x and y of an item whose latitude or longitude is NaN: INT32_MAX is the standard's "not set"."""
_ARDUPILOT = constant("MAV_AUTOPILOT.ARDUPILOTMEGA")
_WAYPOINT = constant("MAV_CMD.NAV_WAYPOINT")
_GLOBAL = constant("MAV_FRAME.GLOBAL")
_LIMIT = 2.0**62
"""Beyond this a number that is no place anyway is cut, so that it fits 64 bits."""
_FLOATS = {"HOME_POSITION": frozenset({"latitude", "longitude", "altitude"})}
"""Integers on the wire that are not integers here, because NaN says "not known"."""

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Columns: TypeAlias = dict[str, npt.NDArray[Any]]


class Upload:
    """The batch of a mission file, and where in the file each of its frames came from."""

    def __init__(self, planned: Planned, dialect: Dialect, family: str | None = None) -> None:
        """Send `planned` to the autopilot that it names, or to one of `family` whatever it names."""
        autopilot, vehicle_type = _told(planned, family)
        self.told = None if autopilot is None else (autopilot, vehicle_type)
        """MAV_AUTOPILOT and, where that is known, MAV_TYPE of the vehicle that it is for."""
        self._text = planned.text
        self._sent = list(_numbered(planned, autopilot))
        rows = {
            "HEARTBEAT": _heartbeat(autopilot, vehicle_type),
            "HOME_POSITION": _home(planned.home),
            "MISSION_COUNT": _counts(self._sent),
            ITEM: _columns(self._sent),
        }
        order = _order(rows, self._sent)
        frames = _frames(order, dialect)
        tables = {
            name: Table(
                layout := _wide(dialect.by_name[name]),
                frames.take(order == name),
                _structured(layout, columns),
            )
            for name, columns in rows.items()
            if (order == name).any()
        }
        self._rows = np.cumsum(order == ITEM) - 1
        self._is_item = order == ITEM
        self.batch = Batch(frames, dialect, tables=tables)

    def __len__(self) -> int:
        """Return the number of items."""
        return len(self._sent)

    def locate(self, number: int, field: str | None = None) -> MissionLocation:
        """Return where frame `number` stands in the file: its `field`, if that is written, else the item."""
        if not self._is_item[number]:
            return MissionLocation(None, None, None, None)
        seq, item = self._sent[self._rows[number]]
        at = getattr(item.places, field or "", -1)
        line, column = self._text.place(at if at >= 0 else item.places.item)
        return MissionLocation(line, column, seq, entry_name("MAV_CMD", item.command))


Sent: TypeAlias = tuple[int, Item]
"""An item with the number that it would be sent as."""


def _numbered(planned: Planned, autopilot: int | None) -> Iterator[Sent]:
    """Yield all items in the order in which they would be sent; ArduPilot gets home as item 0 of a plan."""
    home = planned.home
    first = int(planned.kind == "plan" and autopilot == _ARDUPILOT)
    if first and home is not None:
        at, alt = home.at, 0.0 if isnan(home.alt_msl) else home.alt_msl
        params, places = (0.0, 0.0, 0.0, 0.0), Places(at, at, at)
        yield 0, Item(MISSION, _WAYPOINT, _GLOBAL, params, home.lat, home.lon, alt, places)
    for kind in (MISSION, FENCE, RALLY):
        items = [item for item in planned.items if item.mission_type == kind]
        yield from enumerate(items, first if kind == MISSION else 0)


def _told(planned: Planned, family: str | None) -> tuple[int | None, int | None]:
    """Return MAV_AUTOPILOT and MAV_TYPE: what `family` says, else the file."""
    if family is None:
        return planned.autopilot, planned.vehicle_type
    autopilot, usual = usual_vehicle(family)
    vehicle_type = planned.vehicle_type
    if family != "px4" and family_of(autopilot, vehicle_type or 0) != family:
        vehicle_type = usual  # firmware of ArduPilot goes with the type, PX4 flies any
    return autopilot, vehicle_type


def _order(rows: Mapping[str, Columns], sent: Sequence[Sent]) -> npt.NDArray[np.str_]:
    """Return (n,) the message of each frame: who and where, then every count with its items behind it."""
    order = [name for name in ("HEARTBEAT", "HOME_POSITION") if rows[name]]
    for _, group in groupby(sent, key=lambda each: each[1].mission_type):
        order += ["MISSION_COUNT", *(ITEM for _ in group)]
    return np.array(order, np.str_)


def _heartbeat(autopilot: int | None, vehicle_type: int | None) -> Columns:
    if autopilot is None:
        return {}
    return {"autopilot": np.array([autopilot]), "type": np.array([vehicle_type or 0])}


def _home(home: Home | None) -> Columns:
    if home is None:
        return {}
    scaled = {
        "latitude": home.lat * 1e7,
        "longitude": home.lon * 1e7,
        "altitude": home.alt_msl * 1e3,
    }
    return {name: np.array([value]) for name, value in scaled.items()}


def _counts(sent: Sequence[Sent]) -> Columns:
    kinds, counts = np.unique([item.mission_type for _, item in sent], return_counts=True)
    target = np.full(len(kinds), VEHICLE[0])
    return {"mission_type": kinds, "count": counts, "target_system": target}


def _columns(sent: Sequence[Sent]) -> Columns:
    """Return the columns of MISSION_ITEM_INT, and those of `Said`."""
    items = [item for _, item in sent]
    frame = np.array([item.frame for item in items], np.int64)
    scale = np.where(np.isin(frame, GLOBAL_FRAMES), 1e7, 1.0)
    scale = np.where(np.isin(frame, METRIC_FRAMES), 1e4, scale)
    columns: Columns = {
        name: np.array([getattr(item, name) for item in items])
        for name in ("command", "frame", "current", "autocontinue", "mission_type", "z")
    }
    columns["seq"] = np.array([seq for seq, _ in sent])
    columns["x"] = _scaled(np.array([item.x for item in items]), scale)
    columns["y"] = _scaled(np.array([item.y for item in items]), scale)
    for k in range(4):
        columns[f"param{k + 1}"] = np.array([item.params[k] for item in items])
    columns["target_system"] = np.full(len(items), VEHICLE[0])
    said = np.array([item.said for item in items]).reshape(len(items), len(SAID))
    return {**columns, **dict(zip(SAID, said.T, strict=True))}


def _scaled(values: Floats, scale: Floats) -> Ints:
    """Return coordinates as the integers of MISSION_ITEM_INT, of which those beyond 32 bits stay what they are."""
    whole = np.round(np.clip(np.nan_to_num(values) * scale, -_LIMIT, _LIMIT))
    return np.where(np.isnan(values), UNSET, whole).astype(np.int64)


def _wide(layout: Layout) -> Layout:
    """Return a layout whose numbers have 64 bits, with columns for `Said` where it holds an item."""
    names = [f.name for f in layout.fields if not f.length]
    extra = SAID if layout.name == ITEM else ()
    integers = {f.name for f in layout.fields if f.type.startswith(("int", "uint"))}
    integers -= _FLOATS.get(layout.name, frozenset())
    fields = tuple(
        Field(name, "int64_t" if name in integers else "double", 0, 8 * k, extension=False)
        for k, name in enumerate((*names, *extra))
    )
    size = 8 * len(fields)
    return Layout(layout.msgid, layout.name, layout.crc_extra, size, size, fields)


def _structured(layout: Layout, columns: Columns) -> npt.NDArray[np.void]:
    """Return `columns` as the rows of a table, zero where none is given."""
    rows = np.zeros(max(len(column) for column in columns.values()), layout.dtype)
    for name, column in columns.items():
        rows[name] = column
    return rows


def _frames(order: npt.NDArray[np.str_], dialect: Dialect) -> Frames:
    """Return (n,) frames that carry the messages of `order`; nothing says when."""
    n = len(order)
    vehicle = np.isin(order, ("HEARTBEAT", "HOME_POSITION"))
    zeros, number = np.zeros(n, np.int64), np.arange(n)
    return Frames(
        start=zeros,
        payload=zeros,
        offset=zeros,
        t_us=zeros,
        t_valid=np.zeros(n, np.bool_),
        sysid=np.where(vehicle, VEHICLE[0], GROUND_STATION[0]).astype(np.uint8),
        compid=np.where(vehicle, VEHICLE[1], GROUND_STATION[1]).astype(np.uint8),
        seq=number.astype(np.uint8),
        msgid=np.array([dialect.by_name[name].msgid for name in order.tolist()], np.int32),
        length=np.full(n, 255, np.uint8),
        size=zeros,
        version=np.full(n, 2, np.uint8),
        signed=np.zeros(n, np.bool_),
        known=np.ones(n, np.bool_),
        crc_ok=np.ones(n, np.bool_),
        checksum=np.zeros(n, np.uint16),
        number=number,
        clock_us=zeros,
    )
