"""Places that a vehicle reached, or was told to go to, in the order of their frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mavframecheck.checks.missions.plans import Bools, Floats, Ints, with_place
from mavframecheck.missions.items import items_of
from mavframecheck.model import Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.pairs import moved
from mavframecheck.wire import Batch, Place, Table

MAX_ROUTES = 64
MAX_PLACES = 4000
"""Routes, and places kept of one."""
APART_DEG = 1e-5
"""A target nearer to the one before than this, about 1 m, is the same."""
_IGNORED = 0b11
"""Bits of the type mask that leave x and y out."""
LAT, LON, HOME_LAT, HOME_LON, NUMBER, SEQ = range(6)
"""Columns of a route: degrees, home as it was then, the frame, the item (-1: none)."""


@dataclass
class Route:
    """Places that one sender named for one vehicle."""

    subject: Subject
    vehicle: int
    first: Place
    last: Place
    parts: list[Floats] = field(default_factory=list)
    kept: int = 0

    @property
    def places(self) -> Floats:
        """(n, 6) the places."""
        return np.concatenate(self.parts)


class Routes:
    """Every route of a recording."""

    def __init__(self) -> None:
        """Know none yet."""
        self.routes: dict[tuple[str, int], Route] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Follow what a batch says."""
        for name, read in _READERS.items():
            table = batch.tables.get(name)
            if table is None:
                continue
            about = context.about_then(table)
            home = _lookup(context, table, "home.lat", "home.lon")
            at, seq, used = read(table, context)
            used &= (about >= 0) & np.isfinite(at).all(axis=1)
            columns: Floats = np.column_stack((at, home, table.frames.number, seq)).astype(float)
            streams = table.frames.sender << 8 | np.maximum(about, 0)
            for stream in np.unique(streams[used]).tolist():
                rows = np.flatnonzero(used & (streams == stream))
                self._add(name, stream, table, rows, columns[rows])

    def _add(self, name: str, stream: int, table: Table, rows: Ints, columns: Floats) -> None:
        """Keep what is new: a place that is named again and again is one."""
        route = self.routes.get((name, stream))
        if route is None:
            if len(self.routes) >= MAX_ROUTES:
                return
            subject = Subject(stream >> 16, stream >> 8 & 0xFF, name)
            begun = table.frames.place(int(rows[0]))
            route = self.routes[name, stream] = Route(subject, stream & 0xFF, begun, begun)
        before = route.parts[-1][-1:] if route.parts else columns[:1] + 1
        told = np.concatenate((before, columns))[:, [LAT, LON, SEQ]]
        step = np.abs(np.diff(told, axis=0))
        target = columns[:, SEQ] < 0
        changed = np.where(target, step[:, :2].max(axis=1) > APART_DEG, step[:, 2] > 0)
        new = np.flatnonzero(changed)[: MAX_PLACES - route.kept]
        if len(new):
            route.parts.append(columns[new])
            route.kept += len(new)
            route.last = table.frames.place(int(rows[new[-1]]))


def _lookup(context: Context, table: Table, *names: str) -> Floats:
    """Return (n, k) what was said before each row, NaN where nothing was."""
    columns = [context.lookup(name, table, late=False) for name in names]
    return np.column_stack([np.where(c.known, c.values, np.nan) for c in columns])


def _reached(table: Table, context: Context) -> tuple[Floats, Ints, Bools]:
    """Return where the vehicle was when it reached items."""
    at = _lookup(context, table, "vehicle.lat", "vehicle.lon")
    return at, table["seq"].astype(np.int64), np.ones(len(table), np.bool_)


def _sent(table: Table, context: Context) -> tuple[Floats, Ints, Bools]:
    """Return the places in mission items that are sent to a vehicle."""
    items = items_of(table)
    mission = table["mission_type"] == constant("MAV_MISSION_TYPE.MISSION")
    given = context.lookup("sender.role", table).among(lambda role: role != "autopilot")
    used = with_place(items) & mission & given & (table["current"] < 2)
    return np.column_stack((items.x, items.y)), items.seq, np.asarray(used)


def _global(table: Table, _context: Context) -> tuple[Floats, Ints, Bools]:
    """Return global targets."""
    used = (table["type_mask"] & _IGNORED == 0) & np.isin(table["coordinate_frame"], GLOBAL_FRAMES)
    at = np.column_stack((table["lat_int"], table["lon_int"])) * 1e-7
    return at, np.full(len(table), -1), np.asarray(used)


def _local(table: Table, context: Context) -> tuple[Floats, Ints, Bools]:
    """Return targets north and east of the local origin."""
    local = table["coordinate_frame"] == constant("MAV_FRAME.LOCAL_NED")
    used = (table["type_mask"] & _IGNORED == 0) & local
    origin = _lookup(context, table, "origin.lat", "origin.lon")
    at = moved(origin[:, 0], origin[:, 1], table["x"].astype(float), table["y"].astype(float))
    return np.column_stack(at), np.full(len(table), -1), np.asarray(used)


_Reader = Callable[[Table, Context], tuple[Floats, Ints, Bools]]
REACHED, SENT = "MISSION_ITEM_REACHED", ("MISSION_ITEM", "MISSION_ITEM_INT")
_READERS: dict[str, _Reader] = {
    REACHED: _reached,
    **dict.fromkeys(SENT, _sent),
    "SET_POSITION_TARGET_GLOBAL_INT": _global,
    "SET_POSITION_TARGET_LOCAL_NED": _local,
}
