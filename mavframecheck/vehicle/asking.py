"""Who asks a vehicle for another origin or home."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle.established import ASKED, Event, Geodetic, Request
from mavframecheck.wire import Batch, Table

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

REPEATED_US = 5_000_000
"""A request that says the same again is taken in once in each such stretch."""


class Asking:
    """Who asks for an origin or a home; some say it every second for the whole flight."""

    def __init__(self) -> None:
        self._last: dict[str, Floats] = {}
        """Of each message, what the last request said, and when."""

    def requests(self, batch: Batch) -> Iterator[Event]:
        """Yield the requests of a batch that say something new, or the same again after some time."""
        for message, kind, commands in _REQUESTS:
            table = batch.tables.get(message)
            if table is not None and commands:
                table = table.only(np.isin(table["command"], commands))
            if table is not None and len(table):
                for row in self._new(table).tolist():
                    frames, target = table.frames, int(table["target_system"][row])
                    sender = int(frames.sender[row])
                    request = Request(kind, target, _asked_for(table, row), sender)
                    yield Event(frames.place(row), "request", request)

    def _new(self, table: Table) -> Ints:
        """Return the rows that differ from the one before in who asks whom for what, or come later."""
        frames, names = table.frames, [name for name, _ in _place_fields(table.name)]
        names += ["target_system", *(["param1"] if table.name in _PARAMS else [])]
        said = [table[name].astype(np.float64) for name in names]
        key = np.column_stack((*said, frames.sender, frames.clock_us // REPEATED_US))
        last = self._last.get(table.name, np.full(key.shape[1], -np.inf))
        self._last[table.name] = key[-1]
        before = np.concatenate((last[np.newaxis], key[:-1]))
        return np.flatnonzero(((key != before) & ~(np.isnan(key) & np.isnan(before))).any(axis=1))


def _asked_for(table: Table, row: int) -> Geodetic | None:
    """Return the position that a request names, None for the current one."""
    places = _place_fields(table.name)
    lat, lon, alt = (float(table[name][row]) / scale for name, scale in places)
    given = np.isfinite([lat, lon, alt]).all() and abs(lat) <= 90 and (lat, lon) != (0, 0)
    current = table.name in _PARAMS and table["param1"][row] == 1
    return Geodetic(lat, lon, alt) if given and not current else None


def _place_fields(message: str) -> tuple[tuple[str, float], ...]:
    """Return the fields of a request that name a position, and what they are divided by (deg, m)."""
    return _PARAMS.get(message, _INTS)


_INTS = (("latitude", 1e7), ("longitude", 1e7), ("altitude", 1e3))
_PARAMS = {
    "COMMAND_INT": (("x", 1e7), ("y", 1e7), ("z", 1.0)),
    "COMMAND_LONG": (("param5", 1.0), ("param6", 1.0), ("param7", 1.0)),
}
_SET_HOME = (constant("MAV_CMD.DO_SET_HOME"),)
_REQUESTS: tuple[tuple[str, str, tuple[int, ...]], ...] = (
    (ASKED, "origin", ()),
    ("SET_HOME_POSITION", "home", ()),
    ("COMMAND_INT", "home", _SET_HOME),
    ("COMMAND_LONG", "home", _SET_HOME),
)
