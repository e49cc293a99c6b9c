"""What every stream says of where a vehicle is, how it lies and how it moves: samples kept for comparison.

A track keeps at most 20 samples a second, in windows of 10 s of receive time. When a recording grows, every
second window is dropped, so that what is kept is spread evenly, memory stays flat, and nothing depends on
where batches are cut. Samples with receive times that cannot be believed, or that go back, are left out.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics import catalogue
from mavframecheck.semantics.enums import Axis, Quantity
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.wire import Batch, Place, Table

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

BIN_US = 50_000
"""One sample of a stream is kept in each of these, us."""
WINDOW_BINS = 200
MAX_WINDOWS = 128
MAX_TRACKS = 64
"""Streams that are followed, in the order in which they are first heard."""
LATE_US = 100_000
"""A receive time may lie this far behind the latest one, us."""
_DEG = 1e-7

COLUMNS = 15
TIME, STAMP = 0, 1
PLACE, ATTITUDE, VELOCITY, RATES = slice(2, 5), slice(5, 9), slice(9, 12), slice(12, 15)
"""Columns of a sample: receive time (s since the first of the recording), stamp (s), position (m, or
degrees and m), attitude (a quaternion, or roll, pitch, yaw and NaN), velocity (m/s), rates (rad/s)."""

Reader = Callable[[Table], Floats]


class Source(NamedTuple):
    """How a message says it; readers return (n, k) columns, and NaN where it does not say."""

    place: Reader | None = None
    attitude: Reader | None = None
    velocity: Reader | None = None
    rates: Reader | None = None
    stamp: Reader | None = None
    geodetic: bool = False
    """Whether the position is latitude, longitude and altitude."""
    euler: bool = False
    """Whether the attitude is roll, pitch and yaw."""
    valid: Callable[[Table], Bools] | None = None
    variant: tuple[str, ...] = ()
    """Fields that choose the frame, or the instance."""

    def kept(self) -> Iterator[tuple[slice, Reader]]:
        """Yield the columns of a sample that the message gives, besides the time, and what reads them."""
        attitude = slice(ATTITUDE.start, ATTITUDE.stop - self.euler)
        stamp = slice(STAMP, STAMP + 1)
        readers = (self.stamp, self.place, self.attitude, self.velocity, self.rates)
        for columns, reader in zip((stamp, PLACE, attitude, VELOCITY, RATES), readers, strict=True):
            if reader is not None:
                yield columns, reader


def _fields(*names: str, scale: float = 1.0) -> Reader:
    return lambda table: np.column_stack([table[name] * scale for name in names])


def _array(name: str) -> Reader:
    def read(table: Table) -> Floats:
        q = table[name].astype(np.float64)
        return np.where(np.any(q != 0, axis=1, keepdims=True), q, np.nan)

    return read


def _geodetic(lat: str, lon: str, alt: str = "", scale: float = 1e-3) -> Reader:
    def read(table: Table) -> Floats:
        height = table[alt] * scale if alt else np.full(len(table), np.nan)
        return np.column_stack((table[lat] * _DEG, table[lon] * _DEG, height))

    return read


def _unless(reader: Reader, ignored: Callable[[Table], Bools]) -> Reader:
    return lambda table: np.where(ignored(table)[:, np.newaxis], np.nan, reader(table))


def _bit(field_name: str, bit: int) -> Callable[[Table], Bools]:
    return lambda table: np.asarray(table[field_name] & bit != 0)


def _placed(lat: str, lon: str) -> Callable[[Table], Bools]:
    return lambda table: np.asarray((table[lat] != 0) | (table[lon] != 0))


def _fixed(table: Table) -> Bools:
    return np.asarray((table["fix_type"] >= 3) & ((table["lat"] != 0) | (table["lon"] != 0)))


def _blowing(table: Table) -> Floats:
    """Return (n, 3) where WIND blows to, m/s NED: its direction is where it comes from."""
    towards = np.radians(table["direction"].astype(np.float64) + 180)
    towards = np.where(np.isfinite(towards), towards, np.nan)
    speed = table["speed"].astype(np.float64)
    return np.column_stack((speed * np.cos(towards), speed * np.sin(towards), table["speed_z"]))


def _mount_heading(table: Table) -> Floats:
    """Return (n, 3) what MOUNT_ORIENTATION makes of the heading of its vehicle: one yaw less the other, rad."""
    yaw, absolute = (table[name].astype(np.float64) for name in ("yaw", "yaw_absolute"))
    said = table.present("yaw_absolute") & np.isfinite(yaw) & np.isfinite(absolute)
    return _only_yaw(np.radians(np.where(said, absolute, np.nan) - np.where(said, yaw, 0.0)))


def _delta_heading(table: Table) -> Floats:
    """Return (n, 3) the heading of its vehicle that a gimbal says beside its pose, rad; 0 is not filled in."""
    heading = table["delta_yaw"].astype(np.float64)
    return _only_yaw(np.where(table.present("delta_yaw") & (heading != 0), heading, np.nan))


def _only_yaw(yaw: Floats) -> Floats:
    level = np.where(np.isfinite(yaw), 0.0, np.nan)
    return np.column_stack((level, level, yaw))


_XYZ = _fields("x", "y", "z")
_VXYZ = _fields("vx", "vy", "vz")
_RPY = _fields("roll", "pitch", "yaw")
_VELOCITY_IGNORED = 8 | 16
"""Bits of GPS_INPUT.ignore_flags: horizontal and vertical velocity."""
_ATTITUDE_IGNORED = 128
"""Bit of SET_ATTITUDE_TARGET.type_mask."""
_USEC = _fields("usec", scale=1e-6)
_TIME_USEC = _fields("time_usec", scale=1e-6)
_BOOT_MS = _fields("time_boot_ms", scale=1e-3)

NO_RATES = ("RAW_IMU", "SET_ATTITUDE_TARGET", "ATTITUDE_TARGET", "MANUAL_SETPOINT")
"""Rates without a unit, and rates that are asked for."""
ROLLING = (Quantity.ANGULAR_RATE, Axis.FORWARD)
_RATES = ("rollspeed", "pitchspeed", "yawspeed")

_SOURCES: dict[str, Source] = {
    "GLOBAL_POSITION_INT": Source(
        place=_geodetic("lat", "lon", "alt"),
        velocity=_fields("vx", "vy", "vz", scale=1e-2),
        stamp=_BOOT_MS,
        geodetic=True,
        valid=_placed("lat", "lon"),
    ),
    "LOCAL_POSITION_NED": Source(place=_XYZ, velocity=_VXYZ, stamp=_BOOT_MS),
    "GPS_RAW_INT": Source(place=_geodetic("lat", "lon", "alt"), geodetic=True, valid=_fixed),
    "SIMSTATE": Source(place=_geodetic("lat", "lng"), geodetic=True, valid=_placed("lat", "lng")),
    "ATTITUDE": Source(
        attitude=_RPY,
        rates=_fields("rollspeed", "pitchspeed", "yawspeed"),
        stamp=_BOOT_MS,
        euler=True,
    ),
    "ATTITUDE_QUATERNION": Source(attitude=_fields("q1", "q2", "q3", "q4"), stamp=_BOOT_MS),
    **{
        name: Source(place=_XYZ, attitude=_RPY, stamp=_USEC, euler=True)
        for name in (
            "VISION_POSITION_ESTIMATE",
            "GLOBAL_VISION_POSITION_ESTIMATE",
            "VICON_POSITION_ESTIMATE",
        )
    },
    "SET_ATTITUDE_TARGET": Source(
        attitude=_array("q"),
        valid=lambda table: np.asarray(table["type_mask"] & _ATTITUDE_IGNORED == 0),
        variant=("target_system", "type_mask"),
    ),
    "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": Source(
        attitude=_array("q"), stamp=_fields("time_boot_us", scale=1e-6)
    ),
    "GIMBAL_DEVICE_ATTITUDE_STATUS": Source(
        attitude=_delta_heading, stamp=_BOOT_MS, euler=True, variant=("gimbal_device_id",)
    ),
    "MOUNT_ORIENTATION": Source(attitude=_mount_heading, stamp=_BOOT_MS, euler=True),
    "VISION_SPEED_ESTIMATE": Source(velocity=_XYZ, stamp=_USEC),
    "ATT_POS_MOCAP": Source(place=_XYZ, attitude=_array("q"), stamp=_TIME_USEC),
    "ODOMETRY": Source(
        place=_XYZ,
        attitude=_array("q"),
        velocity=_VXYZ,
        rates=_fields("rollspeed", "pitchspeed", "yawspeed"),
        stamp=_TIME_USEC,
        variant=("frame_id", "child_frame_id"),
    ),
    "WIND": Source(velocity=_blowing),
    "WIND_COV": Source(velocity=_fields("wind_x", "wind_y", "wind_z")),
    "GPS_INPUT": Source(
        velocity=_unless(
            _fields("vn", "ve", "vd"),
            _bit("ignore_flags", _VELOCITY_IGNORED),
        ),
        stamp=_TIME_USEC,
        valid=lambda table: np.asarray(table["fix_type"] >= 3),
        variant=("gps_id",),
    ),
    "HIL_GPS": Source(
        velocity=_fields("vn", "ve", "vd", scale=1e-2),
        stamp=_TIME_USEC,
        valid=lambda table: np.asarray(table["fix_type"] >= 3),
        variant=("id",),
    ),
}


@functools.cache
def source_of(message: str) -> Source | None:
    """Return how a message is followed; None where it says nothing of motion."""
    known = _SOURCES.get(message)
    rates = [] if message in NO_RATES else _rates(message)
    if not rates:
        return known
    return (known or Source(variant=_instance(rates[0])))._replace(rates=_by_tags(rates))


def _rates(message: str) -> list[FieldTag]:
    """Return the tags by which a message measures the turning of a body, about three axes; none where it does not."""
    ahead = (t for t in catalogue.tags(message) if (t.quantity, t.axis) == ROLLING)
    for first in ahead:
        found = catalogue.partners(first)
        rates = [found[name] for name in _RATES if name in found]
        if len(rates) == len(_RATES) and rates[0] is first:
            return rates
    return []


def _instance(tag: FieldTag) -> tuple[str, ...]:
    return (tag.instance_field,) if tag.instance_field else ()


def _by_tags(tags: list[FieldTag]) -> Reader:
    """Return what reads (n, 3) the fields of three tags in SI, NaN where a mask says that they are not given."""

    def read(table: Table) -> Floats:
        values: Floats = np.column_stack(
            [table[t.field].astype(np.float64) * t.scale for t in tags]
        )
        for column, tag in enumerate(tags):
            if tag.ignore_field:
                is_set = table[tag.ignore_field].astype(np.int64) & tag.ignore_bit != 0
                values[is_set == tag.ignore_when_set, column] = np.nan
        return values

    return read


class TrackKey(NamedTuple):
    """One stream."""

    sender: int
    """``sysid * 256 + compid``."""
    message: str
    variant: tuple[int, ...] = ()
    """Values of the source's variant fields."""


def first_in_each(bins: Ints, last: int) -> Ints:
    """Return the rows that come into a later bin than any before, of (n,) `bins` that go on from `last`."""
    highest = np.maximum.accumulate(np.maximum(bins, last))
    return np.flatnonzero(np.diff(highest, prepend=last) > 0)


@dataclass(slots=True)
class Track:
    """The samples of one stream."""

    key: TrackKey
    source: Source
    first: Place
    last: Place
    rows: int = 0
    parts: list[Floats] = field(default_factory=list)
    kept: list[Ints] = field(default_factory=list)
    """Bins of the samples in each part."""
    last_bin: int = -1
    level: int = 0

    def add(self, table: Table, bins: Ints, t_s: Floats) -> None:
        """Take in further rows, in the `bins` they fall into."""
        self.rows += len(table)
        self.last = table.frames.place(-1)
        fresh = first_in_each(bins, self.last_bin)
        if not len(fresh):
            return
        self.last_bin = int(bins[fresh[-1]])
        self.parts.append(_samples(self.source, table.take(fresh), t_s[fresh]))
        self.kept.append(bins[fresh])

    def coarsen(self, level: int) -> None:
        """Keep every ``2 ** level``-th window."""
        if level > self.level or (level and self.parts):
            bins, samples = self._joined()
            stays = (bins // WINDOW_BINS) % (1 << level) == 0
            self.kept, self.parts, self.level = [bins[stays]], [samples[stays]], level

    def _joined(self) -> tuple[Ints, Floats]:
        if not self.parts:
            return np.zeros(0, np.int64), np.zeros((0, 1))
        return np.concatenate(self.kept), np.concatenate(self.parts)

    def samples(self) -> Floats:
        """Return (n, COLUMNS) all that is kept, in the order of time; NaN where the message gives nothing."""
        _, kept = self._joined()
        rows = np.full((len(kept), COLUMNS), np.nan)
        rows[:, TIME] = kept[:, 0]
        at = 1
        for columns, _ in self.source.kept():
            width = columns.stop - columns.start
            rows[:, columns], at = kept[:, at : at + width], at + width
        return rows


def _samples(source: Source, table: Table, t_s: Floats) -> Floats:
    """Return (n, k) the time, and the columns that the message gives: memory is for these alone."""
    return np.column_stack([t_s, *(read(table) for _, read in source.kept())])


class Tracks:
    """The tracks of all streams of a recording that say where something is."""

    def __init__(self) -> None:
        """Start with nothing heard."""
        self.tracks: dict[TrackKey, Track] = {}
        self.timed = False
        """Whether there were receive times that can be believed."""
        self.t0_us: int | None = None
        """The first receive time that can be believed: times count from it."""
        self._level = 0

    def update(self, batch: Batch) -> None:
        """Take in what a batch says."""
        for key, table in sorted(self._streams(batch), key=lambda each: _number(each[1])):
            self._add(key, table)
        for track in self.tracks.values():
            track.coarsen(self._level)

    def _streams(self, batch: Batch) -> Iterator[tuple[TrackKey, Table]]:
        frames = batch.frames
        if self.t0_us is None and frames.t_valid.any():
            self.t0_us = int(frames.t_us[np.argmax(frames.t_valid)])
            self.timed = True
        for name in batch.tables:
            source = source_of(name)
            if source is None:
                continue
            table = batch.tables[name]
            good = table.frames.t_valid & (table.frames.t_us >= table.frames.clock_us - LATE_US)
            if source.valid is not None:
                good &= source.valid(table)
            if good.any():
                yield from _split(source, table.only(good))

    def _add(self, key: TrackKey, table: Table) -> None:
        track = self.tracks.get(key)
        if track is None:
            if len(self.tracks) >= MAX_TRACKS:
                return
            source, at = source_of(key.message) or Source(), table.frames.place(0)
            track = self.tracks[key] = Track(key, source, at, at)
        since = table.frames.t_us - (self.t0_us or 0)
        bins = np.maximum(since // BIN_US, 0)
        while int(bins.max()) // WINDOW_BINS >> self._level >= MAX_WINDOWS:
            self._level += 1
        track.add(table, bins, np.asarray(since * 1e-6, np.float64))


def _number(table: Table) -> int:
    return int(table.frames.number[0])


def _split(source: Source, table: Table) -> Iterator[tuple[TrackKey, Table]]:
    """Yield the rows of each sender and variant."""
    columns = [table.frames.sender, *(table[name].astype(np.int64) for name in source.variant)]
    keys = np.column_stack(columns)
    if (keys == keys[0]).all():
        yield TrackKey(int(keys[0, 0]), table.name, tuple(keys[0, 1:].tolist())), table
        return
    for each in np.unique(keys, axis=0):
        sender, *variant = each.tolist()
        yield TrackKey(sender, table.name, tuple(variant)), table.take((keys == each).all(axis=1))
