"""A mission file as the batch that sending it would be, so that every rule judges it as it judges a log.

The batch holds what a ground station and the vehicle would say: HEARTBEAT (which autopilot), HOME_POSITION,
then MISSION_COUNT and MISSION_ITEM_INT for mission, fence and rally points. Nothing was rounded by sending it:
columns are 64-bit, and `Said` follows in columns of its own, which no log has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from mavframecheck.missions.planned import SAID, Item, Planned
from mavframecheck.model import MissionLocation
from mavframecheck.semantics.constants import constant, entry_name
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES, METRIC_FRAMES
from mavframecheck.semantics.names import family as family_of
from mavframecheck.wire import Batch, Dialect, Field, Frames, Layout, Table

VEHICLE, GROUND_STATION = (1, 1), (255, 190)
"""System and component of who would speak."""
UNSET = 2**31 - 1
"""x and y of an item whose latitude or longitude is NaN: INT32_MAX is the standard's "not set"."""
_LIMIT = 2.0**62
"""Beyond this a number that is no place anyway is cut, so that it fits 64 bits."""
_FROM_FAMILY = {
    "px4": ("PX4", ""),
    "arducopter": ("ARDUPILOTMEGA", "QUADROTOR"),
    "arduplane": ("ARDUPILOTMEGA", "FIXED_WING"),
    "ardurover": ("ARDUPILOTMEGA", "GROUND_ROVER"),
    "ardusub": ("ARDUPILOTMEGA", "SUBMARINE"),
}
"""Autopilot family, as `--autopilot` names it -> MAV_AUTOPILOT and MAV_TYPE of such a vehicle."""

_FLOATS = {"HOME_POSITION": frozenset({"latitude", "longitude", "altitude"})}
"""Integers on the wire that are not integers here, because NaN says "not known"."""

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Columns: TypeAlias = dict[str, npt.NDArray[Any]]


class Upload:
    """The batch of a mission file, and where in the file each of its frames came from."""

    def __init__(self, planned: Planned, dialect: Dialect, family: str | None = None) -> None:
        """Send `planned` to the autopilot that it names, or to one of `family` whatever it names."""
        self._text = planned.text
        self._items = sorted(planned.items, key=lambda item: item.mission_type)
        rows = {
            "HEARTBEAT": _heartbeat(planned, family),
            "HOME_POSITION": _home(planned),
            "MISSION_COUNT": _counts(self._items),
            "MISSION_ITEM_INT": _columns(self._items),
        }
        order = _order(rows, self._items)
        frames = _frames(order, dialect)
        tables = {
            name: Table(
                layout := _wide(dialect.by_name[name]),
                frames,
                np.flatnonzero(order == name),
                _structured(layout, columns),
            )
            for name, columns in rows.items()
            if (order == name).any()
        }
        self._item_of = dict(
            zip(np.flatnonzero(order == "MISSION_ITEM_INT").tolist(), self._items, strict=True)
        )
        self.batch = Batch(frames, dialect, tables=tables)

    def locate(self, number: int, field: str | None = None) -> MissionLocation:
        """Return where frame `number` stands in the file: its `field`, if that is written, else the item."""
        item = self._item_of.get(number)
        if item is None:
            return MissionLocation(None, None, None, None)
        at = getattr(item.places, field or "", -1)
        line, column = self._text.place(at if at >= 0 else item.places.item)
        return MissionLocation(line, column, item.seq, entry_name("MAV_CMD", item.command))


def _order(rows: Mapping[str, Columns], items: Sequence[Item]) -> npt.NDArray[np.str_]:
    """Return (n,) the message of each frame: who and where, then every count with its items behind it."""
    order = [name for name in ("HEARTBEAT", "HOME_POSITION") if rows[name]]
    for _, group in groupby(items, key=lambda item: item.mission_type):
        order += ["MISSION_COUNT", *("MISSION_ITEM_INT" for _ in group)]
    return np.array(order, np.str_)


def _heartbeat(planned: Planned, family: str | None) -> Columns:
    """Return the HEARTBEAT of the autopilot that `family`, else the file, names; nothing if none does."""
    autopilot, vehicle_type = planned.autopilot, planned.vehicle_type
    if family is not None:
        name, default = _FROM_FAMILY[family]
        autopilot = constant(f"MAV_AUTOPILOT.{name}")
        if default and family_of(autopilot, vehicle_type or 0) != family:
            vehicle_type = constant(f"MAV_TYPE.{default}")
    if autopilot is None:
        return {}
    return {"autopilot": np.array([autopilot]), "type": np.array([vehicle_type or 0])}


def _home(planned: Planned) -> Columns:
    home = planned.home
    if home is None:
        return {}
    scaled = {
        "latitude": home.lat * 1e7,
        "longitude": home.lon * 1e7,
        "altitude": home.alt_msl * 1e3,
    }
    return {name: np.array([value]) for name, value in scaled.items()}


def _counts(items: Sequence[Item]) -> Columns:
    kinds, counts = np.unique([item.mission_type for item in items], return_counts=True)
    target = np.full(len(kinds), VEHICLE[0])
    return {"mission_type": kinds, "count": counts, "target_system": target}


def _columns(items: Sequence[Item]) -> Columns:
    """Return the columns of MISSION_ITEM_INT, and those of `Said`."""
    frame = np.array([item.frame for item in items], np.int64)
    scale = np.where(np.isin(frame, GLOBAL_FRAMES), 1e7, 1.0)
    scale = np.where(np.isin(frame, METRIC_FRAMES), 1e4, scale)
    columns: Columns = {
        name: np.array([getattr(item, name) for item in items])
        for name in ("seq", "command", "frame", "current", "autocontinue", "mission_type", "z")
    }
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
    extra = SAID if layout.name == "MISSION_ITEM_INT" else ()
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
