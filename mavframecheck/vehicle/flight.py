"""What the vehicles of a recording did: armed, mode, heights, boot clock, gathered to be drawn.

Fed beside the rules in the same pass, and only when a report draws: nothing else pays for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import msgspec
import numpy as np
import numpy.typing as npt

from mavframecheck.geo.geodesy import bearing_deg, distance_m
from mavframecheck.model.trace import Band, Trace
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle.context import Context
from mavframecheck.vehicle.facts import SOURCES as SAID
from mavframecheck.vehicle.rows import Rows
from mavframecheck.vehicle.thinning import MAX_BINS, Series, thinned
from mavframecheck.vehicle.tracks import source_of
from mavframecheck.wire import Batch, Frames, Table

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

MAX_BANDS = 400
"""Changes of mode, or arming, that are kept of one vehicle; what comes after belongs to the last."""
MAX_SERIES = 128
"""Series that are kept, in the order in which they are first heard."""
HEIGHTS = {
    "GLOBAL_POSITION_INT": ("alt", "relative_alt"),
    "GPS_RAW_INT": ("alt", "alt_ellipsoid"),
    "LOCAL_POSITION_NED": ("z",),
    "ALTITUDE": ("altitude_terrain",),
    "TERRAIN_REPORT": ("terrain_height", "current_height"),
}
"""Heights of a vehicle (terrain_height: of the ground below it); what they are above is in the catalogue."""
GROUND = ("TERRAIN_REPORT", "terrain_height")
_BOOT = ("ATTITUDE", "GLOBAL_POSITION_INT", "SYSTEM_TIME")
_STATE = next(each for each in SAID if each.history == "state")


def times(frames: Frames, *, timed: bool) -> Ints:
    """Return (n,) time of the recording, us since 1970 (0: not known yet); else the number of the frame."""
    return frames.clock_us if timed else frames.number


def seconds(t: Ints, *, timed: bool) -> Floats:
    """Return (n,) what `times` gives as `Trace.t`."""
    return np.asarray(t * 1e-6 if timed else t, np.float64)


Key: TypeAlias = tuple[str | int, ...]
Heard: TypeAlias = tuple[Key, Frames, Floats]
"""Rows of a series: its key, the frames, (n, columns) values."""


class SeriesBook:
    """Series by key, no more than `most`."""

    def __init__(self, columns: int, *, timed: bool, most: int = MAX_SERIES) -> None:
        """Keep series of `columns` values."""
        self._columns, self.timed, self._most = columns, timed, most
        self.series: dict[Key, Series] = {}

    def add(self, heard: Iterable[Heard]) -> None:
        """Add the rows of a batch; those before the first believable time are left out."""
        given = [each for each in heard if len(each[1])]
        for key, frames, rows in sorted(given, key=lambda each: (int(each[1].number[0]), each[0])):
            self._add(key, frames, rows)

    def _add(self, key: Key, frames: Frames, rows: Floats) -> None:
        if key not in self.series:
            if len(self.series) >= self._most:
                return
            self.series[key] = Series(self._columns)
        t = times(frames, timed=self.timed)
        known = t > 0 if self.timed else np.ones(len(t), np.bool_)
        self.series[key].add(t[known], rows[known])

    def traces(self) -> Iterator[tuple[Key, Floats, Floats]]:
        """Yield key, times as in `Trace.t` and (n, columns) values of each series that has any."""
        for key, series in sorted(self.series.items()):
            if len(series):
                yield key, seconds(series.times, timed=self.timed), series.values


@dataclass(slots=True)
class _Bands:
    """The bands of one kind of one vehicle, the open one last."""

    labels: list[str] = field(default_factory=list)
    starts: list[float] = field(default_factory=list)
    end: float = 0.0
    """Time of the last row."""

    def add(self, t: Floats, labels: npt.NDArray[np.str_]) -> None:
        before = np.concatenate((self.labels[-1:] or [""], labels[:-1]))
        for row in np.flatnonzero(labels != before)[: MAX_BANDS - len(self.labels)].tolist():
            self.labels.append(str(labels[row]))
            self.starts.append(float(t[row]))
        self.end = float(t[-1])


class FlightBook:
    """Gathers what vehicles did, batch by batch."""

    def __init__(self, *, timed: bool) -> None:
        """Start with nothing heard; `timed`: whether the recording has receive times."""
        self._heights = SeriesBook(1, timed=timed)
        self._boots = SeriesBook(1, timed=timed)
        self._bands: dict[tuple[int, Literal["armed", "mode"]], _Bands] = {}
        self._timed = timed

    def update(self, batch: Batch, context: Context) -> None:
        """Take in what autopilots say in a batch."""
        told = [
            (sender, own)
            for name in {"HEARTBEAT": 0, **HEIGHTS, **dict.fromkeys(_BOOT)}
            if name in batch.tables
            for sender, own in _autopilots(batch.tables[name], context)
        ]
        for sender, own in told:
            if own.name == "HEARTBEAT":
                self._state(sender >> 8, own)
        self._boots.add(
            ((sender >> 8, own.name), own.frames, own["time_boot_ms"][:, np.newaxis] * 1e-3)
            for sender, own in told
            if own.name in _BOOT
        )
        self._heights.add(
            ((sender, own.name, tag.field), own.frames, _height(Rows(own, context), tag))
            for sender, own in told
            for tag in _heights(own)
        )

    def _state(self, system: int, beats: Table) -> None:
        t = times(beats.frames, timed=self._timed)
        if _STATE.valid is not None:
            beats, t = beats.take(told := _STATE.valid(beats) & (t > 0)), t[told]
        if not len(t):
            return
        at = seconds(t, timed=self._timed)
        armed = np.where(_STATE.reads["armed"](beats) > 0, "armed", "disarmed")
        modes = np.asarray(_STATE.reads["mode"](beats), np.str_)
        self._bands.setdefault((system, "armed"), _Bands()).add(at, armed)
        self._bands.setdefault((system, "mode"), _Bands()).add(at, modes)

    def bands(self) -> Iterator[Band]:
        """Yield when each vehicle was armed, and in which mode."""
        for (system, kind), bands in sorted(self._bands.items()):
            ends = [*bands.starts[1:], bands.end]
            for label, start, end in zip(bands.labels, bands.starts, ends, strict=True):
                yield Band(system=system, kind=kind, label=label, start=start, end=end)

    def heights(self) -> Iterator[Trace]:
        """Yield every height of a vehicle, by what it is above."""
        for (sender, message, name), t, values in self._heights.traces():
            tag = catalogue.tags_of(str(message), str(name))[0]
            role = "ground" if (message, name) == GROUND else str(tag.alt_ref)
            label = f"{int(sender) >> 8}/{int(sender) & 0xFF} {message}.{name}"
            yield msgspec.structs.replace(
                line(label, t, values[:, 0], role), system=int(sender) >> 8
            )

    def boots(self) -> Iterator[Trace]:
        """Yield the clock of each vehicle, by the message that tells it most often."""
        best: dict[int, Trace] = {}
        for (system, message), t, values in self._boots.traces():
            trace = line(f"{system} {message}", t, values[:, 0])
            if len(trace.t) > len(best[int(system)].t if int(system) in best else ()):
                best[int(system)] = trace
        yield from best.values()


def line(
    label: str,
    t: Floats,
    y: Floats,
    role: str = "",
    x: Floats | None = None,
    most: int = MAX_BINS,
) -> Trace:
    """Return (n,) values over (n,) times, ascending, as a trace: thinned out where there are many."""
    columns = [y] if x is None else [y, x]
    t, rows = thinned(t, np.column_stack(columns), most)
    east = None if x is None else tuple(rows[:, 1].tolist())
    return Trace(label=label, role=role, t=tuple(t.tolist()), y=tuple(rows[:, 0].tolist()), x=east)


def on_plane(lat: Floats, lon: Floats, lat0: float, lon0: float) -> tuple[Floats, Floats]:
    """Return (n,) metres north and east of a place, deg: distance and bearing along the ellipsoid are true."""
    away = distance_m(lat0, lon0, lat, lon)
    bearing = np.radians(np.nan_to_num(bearing_deg(lat0, lon0, lat, lon)))
    return away * np.cos(bearing), away * np.sin(bearing)


def _autopilots(table: Table, context: Context) -> Iterator[tuple[int, Table]]:
    """Yield the rows of each autopilot (``sysid * 256 + compid``)."""
    speaks = context.lookup("sender.role", table).among(lambda role: role == "autopilot")
    sender = table.frames.sender
    for each in np.unique(sender[speaks]).tolist():
        yield each, table.take(speaks & (sender == each))


def _heights(table: Table) -> Iterator[FieldTag]:
    for name in HEIGHTS.get(table.name, ()):
        if name in table.layout.by_name:
            yield catalogue.tags_of(table.name, name)[0]


def _height(rows: Rows, tag: FieldTag) -> Floats:
    """Return (n, 1) heights, m, upwards; NaN where there is none (0 above the ellipsoid: not given)."""
    height = np.asarray(rows.si(tag), np.float64) * (-1.0 if tag.positive == "down" else 1.0)
    tracked = source_of(tag.message)
    if tracked is not None and tracked.valid is not None:
        height = np.where(tracked.valid(rows.table), height, np.nan)
    if tag.alt_ref == "ellipsoid":
        height = np.where(height == 0, np.nan, height)
    if tag.message == "TERRAIN_REPORT":
        given = (rows.raw("spacing") != 0) & (rows.raw("lat") != 0) & (rows.raw("lon") != 0)
        height = np.where(given, height, np.nan)
    return height[:, np.newaxis]
