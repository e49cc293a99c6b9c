"""Moving a recording: the same flight at another place, consistent in every field that has a tag."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from benchmarks.injection.log import AUTOPILOT, Change, Columns, Log, put
from benchmarks.injection.words import flying
from mavframecheck.geo.geoid import undulation
from mavframecheck.semantics import FieldTag, catalogue
from mavframecheck.semantics.enums import AltRef, Quantity
from mavframecheck.wire import Table

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

ABSOLUTE_FRAMES = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)
HIGH_M, UNSET_M = 50.0, 5.0
"""Where the ground is higher than the first, a height above sea level below the second is not known yet."""
LOWEST_PASCAL = 30_000.0
"""Less is a difference of pressures."""
MOVED = (Quantity.LATITUDE, Quantity.LONGITUDE, Quantity.ALTITUDE, Quantity.PRESSURE)


class Place(NamedTuple):
    """A point that a flight begins at: degrees, and metres above mean sea level."""

    lat: float
    lon: float
    alt: float


class _Move(NamedTuple):
    """From where to where, and what that does to the geoid."""

    log: Log
    old: Place
    new: Place
    old_undulation: float
    """As the receiver says: simulators give 0."""

    @property
    def up(self) -> float:
        return self.new.alt - self.old.alt

    @property
    def up_ellipsoid(self) -> float:
        new = float(undulation(self.new.lat, self.new.lon))
        return self.up + new - self.old_undulation


def moved(log: Log, place: Place) -> bytes:
    """Return the recording as if it had been flown at `place`.

    Distances from home are kept (longitudes stretch with the parallel), heights above sea level and ellipsoid
    and pressures follow; what says that nothing is known stays: 0 N 0 E, sentinels, heights before the first fix.
    """
    home = log.own("HOME_POSITION")
    if home is None:
        raise ValueError("a recording without HOME_POSITION cannot be moved")
    last = home.columns[-1]  # the first one may say 0 for "not known yet"
    old = Place(last["latitude"] * 1e-7, last["longitude"] * 1e-7, last["altitude"] * 1e-3)
    move = _Move(log, old, place, _receiver_undulation(log))
    changes = {}
    for name, table in log.tables.items():
        columns = _columns(move, table)
        if columns is not None:
            changes[name] = Change(np.arange(len(table)), columns)
    return log.written(changes)


def _receiver_undulation(log: Log) -> float:
    """Return how far the receiver says that the geoid lies above the ellipsoid, m."""
    gnss = log.own("GPS_RAW_INT")
    if gnss is None or not gnss["alt_ellipsoid"].any():
        return 0.0
    return float(np.median(gnss["alt_ellipsoid"] - gnss["alt"])) * 1e-3


def _columns(move: _Move, table: Table) -> Columns | None:
    """Return the payloads of a table at the new place, None where nothing in them has one."""
    tags = [tag for tag in catalogue.tags(table.name) if tag.quantity in MOVED]
    tags = [tag for tag in tags if tag.field in table.layout.by_name]
    if not tags:
        return None
    columns = table.columns.copy()
    for tag in tags:
        rows = _viewed(tag, table) & _is_told(move, tag, table)
        raw = table[tag.field]
        given = _given(tag, raw) & (rows if raw.ndim == 1 else rows[:, None])
        put(columns, tag.field, np.where(given, _shift(move, tag, table), columns[tag.field]))
    return columns


def _viewed(tag: FieldTag, table: Table) -> Bools:
    """Return (n,) rows in which the tag holds."""
    holds = np.ones(len(table), np.bool_)
    for condition in tag.when:
        holds &= np.isin(table[condition.field], condition.values)
    return holds


def _is_told(move: _Move, tag: FieldTag, table: Table) -> Bools:
    """Return (n,) rows in which a field is known: 0 N 0 E is no place, and far above the sea no height is 0."""
    if tag.quantity is Quantity.ALTITUDE and abs(move.old.alt) > HIGH_M:
        told = np.abs(table[tag.field] * tag.scale) > UNSET_M
        return np.asarray(told if told.ndim == 1 else told.any(axis=1))
    beside = catalogue.partners(tag)
    if tag.quantity not in (Quantity.LATITUDE, Quantity.LONGITUDE) or len(beside) < 2:
        return np.ones(len(table), np.bool_)
    lat, lon = (table[beside[name].field] for name in ("lat", "lon"))
    return np.asarray((lat != 0) | (lon != 0))


def _given(tag: FieldTag, raw: Any) -> Bools:
    """Return which values are measurements, not codes."""
    given = np.isfinite(raw.astype(np.float64))
    for sentinel in tag.sentinels:
        if sentinel.kind == "value":
            given &= raw != sentinel.value
        elif sentinel.kind == "below":
            given &= raw >= sentinel.value
    return np.asarray(given)


def _shift(move: _Move, tag: FieldTag, table: Table) -> Floats:
    """Return the raw values of a field at the new place."""
    raw = table[tag.field].astype(np.float64)
    if tag.quantity is Quantity.LATITUDE:
        return np.asarray(raw + (move.new.lat - move.old.lat) / tag.scale)
    if tag.quantity is Quantity.LONGITUDE:
        stretch = np.cos(np.radians(move.old.lat)) / np.cos(np.radians(move.new.lat))
        east = (raw * tag.scale - move.old.lon + 180) % 360 - 180
        return np.asarray(((move.new.lon + east * stretch + 180) % 360 - 180) / tag.scale)
    if tag.quantity is Quantity.PRESSURE:
        thinner = _pressure(move.new.alt) / _pressure(move.old.alt)
        return np.where(raw * tag.scale > LOWEST_PASCAL, raw * thinner, raw)
    up = _rise(move, tag, table)
    return np.asarray(raw + (up if raw.ndim == 1 else up[:, None]) / tag.scale)


def _pressure(alt: float) -> float:
    """Return the pressure of the ICAO standard atmosphere, in units of that at sea level."""
    return float((1 - 2.25577e-5 * alt) ** 5.25588)


def _rise(move: _Move, tag: FieldTag, table: Table) -> Floats:
    """Return (n,) metres that the heights of a field rise by: none where they count from the flight's own places."""
    if tag.alt_ref is AltRef.ELLIPSOID:
        return np.full(len(table), move.up_ellipsoid)
    if tag.alt_ref in (AltRef.MSL, AltRef.PRESSURE):
        return np.full(len(table), move.up)
    absolute = np.zeros(len(table), np.bool_)
    if tag.alt_ref is AltRef.BY_FRAME:
        absolute = np.isin(table[tag.frame_field], ABSOLUTE_FRAMES)
    elif table.name == "ADSB_VEHICLE":
        absolute[:] = True
    elif (
        table.name == "COMMAND_LONG" and tag.field == "param7"
    ):  # no frame: as the autopilot takes it
        sets_home = table["command"] == mavlink.MAV_CMD_DO_SET_HOME
        absolute = sets_home | (flying(move.log) == "px4") | (table.frames.compid == AUTOPILOT)
    return np.where(absolute, move.up, 0.0)
