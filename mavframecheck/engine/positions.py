"""Every position of a recording as a typed column: which fields are positions is in the catalogue.

A *place* is what the catalogue says about one position of one message: the fields that hold it and those
that say when, in which frame and how well. From each batch every place yields extracts: rows of one
sender that share frame, origin, height reference and clock, so that one type fits them all.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import AltRef, Clock, CovLayout, Frame, Quantity, RefPoint
from mavframecheck.semantics.mavframe import frame_facts, frame_name
from mavframecheck.semantics.positions import (
    NO_TIME,
    BodyVector,
    GeodeticPosition,
    LocalPosition,
    Measured,
    Origin,
    Position,
)
from mavframecheck.semantics.references import selected_height
from mavframecheck.semantics.tags import Condition, FieldTag
from mavframecheck.vehicle.context import Context
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Batch, Layout

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

UNIX_NS = 10**18
"""What the standard says of ambiguous stamps: from here on (2001) they count from 1970."""
_EPOCH_2019_NS = 1_546_300_800 * 10**9

PROBLEMS = (
    "",
    "not known",
    "no fix",
    "0 N 0 E stands for no position",
    "latitude beyond 90 degrees",
    "the mask leaves out a part of it",
)
"""Why a row is no position, the worst last."""
_FINE, _UNKNOWN, _NO_FIX, _ZERO, _BEYOND, _PARTIAL = range(len(PROBLEMS))


@dataclass(frozen=True, kw_only=True, eq=False)
class Extract:
    """Positions of one sender and message that share a type; columns are (n,)."""

    position: Position | None
    """None: they could not be converted."""
    frame: str | None
    """``local_ned``, ``body_frd``...; None for what needs none beside its type."""
    sysid: int
    compid: int
    message: str
    subject: str
    """Whose position, where a message tells several: ``next``, ``operator``; else empty."""
    number: Ints
    """Running number of the frame in the recording."""
    offset: Ints
    """Of the frame, bytes."""
    element: Ints
    """Place in an array of positions, else 0."""
    instance: Ints | None
    """Which of several sensors."""
    problem: npt.NDArray[np.object_]
    """Why it is no position; empty where it is one."""
    measured: Measured
    origin: Origin | None
    """Local origin in force of the vehicle that it is about."""
    level_msl_m: Floats | None = None
    """Height above the sea of what a height above home or the origin is counted from."""

    def __len__(self) -> int:
        return len(self.number)

    def take(self, rows: Ints | Bools) -> Self:
        """Return some of the rows."""
        changes: dict[str, Any] = {
            name: value[rows] if isinstance(value, np.ndarray) else value.take(rows)
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray | Measured) or name == "position"
            if value is not None
        }
        return replace(self, **changes)


class Place(NamedTuple):
    """The fields that hold one position of a message, as the catalogue has them."""

    subject: str
    axes: tuple[FieldTag, ...]
    """Latitude and longitude, or x, y, z."""
    heights: tuple[FieldTag, ...]
    """Altitudes that go with a latitude, the main one first."""
    accuracies: tuple[FieldTag, ...]
    covariance: FieldTag | None
    fix: FieldTag | None
    stamp: FieldTag | None

    @property
    def main(self) -> FieldTag:
        """The first axis: frame, conditions and point are the same for all."""
        return self.axes[0]

    @property
    def is_geodetic(self) -> bool:
        """Whether it is latitude and longitude."""
        return self.main.quantity is Quantity.LATITUDE


@cache
def places(message: str) -> tuple[Place, ...]:
    """Return the positions that a message carries."""
    tags = catalogue.tags(message)
    groups = dict.fromkeys(
        (tag.group, tag.when)
        for tag in tags
        if tag.quantity in (Quantity.LATITUDE, Quantity.POSITION) and _first_axis(tag)
    )
    found = (_place(tags, group, when, q) for group, when in groups for q in _KINDS)
    return tuple(place for place in found if place is not None)


_KINDS = ((Quantity.LATITUDE, Quantity.LONGITUDE), (Quantity.POSITION,) * 3)
_AXIS_NAMES = ({"north", "x", "forward"}, {"east", "y", "right"}, {"down", "z"})


def _first_axis(tag: FieldTag) -> bool:
    return tag.quantity is Quantity.LATITUDE or str(tag.axis) in _AXIS_NAMES[0]


def _place(
    tags: Sequence[FieldTag],
    group: str,
    when: tuple[Condition, ...],
    quantities: Sequence[Quantity],
) -> Place | None:
    """Return the position in one group and view, None when an axis of it is missing."""
    near = [t for t in tags if t.group == group and _goes_with(t, when, strictly=not group)]
    axes = []
    for number, quantity in enumerate(quantities):
        mine = [t for t in near if t.quantity is quantity and _is_axis(t, number, quantity)]
        exact = [t for t in mine if t.when == when]
        if not (exact or (mine and number)):
            return None
        axes.append((exact or mine)[0])
    subject = axes[0].subject
    beside = [tag for tag in tags if tag.group and tag.subject == subject]
    return Place(
        subject,
        tuple(axes),
        tuple(t for t in near if t.quantity is Quantity.ALTITUDE and t.positive == "up"),
        tuple(t for t in beside if t.quantity is Quantity.ACCURACY and t.group.endswith(_ACCURACY)),
        next((t for t in beside if t.group.endswith(_COVARIANCE)), None),
        None if subject else next((t for t in tags if t.enum == "GPS_FIX_TYPE"), None),
        next((t for t in tags if axes[0].time_field and t.field == axes[0].time_field), None),
    )


_ACCURACY, _COVARIANCE = "position_accuracy", "position_covariance"


def _is_axis(tag: FieldTag, number: int, quantity: Quantity) -> bool:
    return quantity is not Quantity.POSITION or str(tag.axis) in _AXIS_NAMES[number]


def _goes_with(tag: FieldTag, when: tuple[Condition, ...], *, strictly: bool) -> bool:
    """Return whether a field can belong to the view `when`; without a group the views must be one."""
    if strictly:
        return tag.when == when
    theirs = {condition.field: set(condition.values) for condition in when}
    return all(set(c.values) & theirs.get(c.field, set(c.values)) for c in tag.when)


def extracts(batch: Batch, context: Context, wanted: Collection[str] = ()) -> Iterator[Extract]:
    """Yield the positions in a batch that `context` has taken in; `wanted`: messages, empty for all."""
    for name in batch.tables:
        if (not wanted or name in wanted) and places(name):
            table = batch.tables[name]
            rows = Rows(table, context)
            for place in places(name):
                if _has(table.layout, place):
                    yield from _Cells.of(place, rows)


def positions(
    reading: Reading, wanted: Collection[str] = (), progress: Progress | None = None
) -> Iterator[list[Extract]]:
    """Yield the positions of a recording, one list for each batch."""
    for batch in reading.understood(progress):
        yield list(extracts(batch, reading.context, wanted))


def _has(layout: Layout, place: Place) -> bool:
    """Return whether the dialect has the fields of a place."""
    return all(tag.field in layout.by_name for tag in place.axes)


class _Cells:
    """The rows of a message that hold one place, an array of positions laid out as rows of its own."""

    def __init__(self, place: Place, rows: Rows) -> None:
        self.place, self.rows = place, rows
        self.layout = rows.table.layout
        shape = rows.raw(place.main.field).shape
        self.count = shape[1] if len(shape) > 1 else 1
        self.row = np.repeat(np.arange(len(rows)), self.count)
        """(n,) row of the message that each cell is from."""

    @classmethod
    def of(cls, place: Place, rows: Rows) -> Iterator[Extract]:
        """Yield what the rows say of a place."""
        holds = np.ones(len(rows), np.bool_)
        for condition in place.main.when:
            holds &= np.isin(rows.raw(condition.field), condition.values)
        used = np.any([rows.used(tag) for tag in place.axes], axis=0)
        chosen = holds & used
        if chosen.any():
            yield from cls(place, rows if chosen.all() else rows.take(chosen)).split()

    def split(self) -> Iterator[Extract]:
        """Yield an extract for each combination of sender, frame, height reference, origin and clock."""
        frames, main = self.rows.table.frames, self.place.main
        frame = self.selector(main)
        height = self.selector(self.place.heights[0]) if self.place.heights else frame * 0
        self.clock, self.time_ns = self._times()
        self.origins, which = self._origins()
        keys = np.stack([frames.sender, frame, height, which, self.clock], axis=1)
        found, groups = np.unique(keys, axis=0, return_inverse=True)
        self.values = [self.column(tag) for tag in self.place.axes]
        self.problems = self._problems()
        for number, key in enumerate(found.tolist()):
            yield self._extract(key, groups.reshape(-1) == number)

    def selector(self, tag: FieldTag) -> Ints:
        """Return (rows,) the values of the field that selects frame or height, 0 without one."""
        if not tag.frame_field:
            return np.zeros(len(self.rows), np.int64)
        raw = self.rows.raw(tag.frame_field)
        whole = np.isfinite(raw) & (np.abs(raw) < 2**31)
        return np.where(whole, raw, -1).astype(np.int64)

    def column(self, tag: FieldTag) -> Floats:
        """Return (cells,) a field in SI, NaN where it is unknown or left out by its mask."""
        si: Floats = np.asarray(self.rows.si(tag), np.float64)
        si = np.where(_beside(self.rows.used(tag), si), si, np.nan)
        if si.ndim == 1:
            return si[self.row]
        return si.reshape(-1) if si.shape[1] == self.count else np.full(len(self.row), np.nan)

    def height(self, tag: FieldTag) -> Floats:
        """Return (cells,) an altitude, NaN in rows of a view that has none."""
        holds = np.ones(len(self.rows), np.bool_)
        for condition in tag.when:
            holds &= np.isin(self.rows.raw(condition.field), condition.values)
        return np.where(holds[self.row], self.column(tag), np.nan)

    def _times(self) -> tuple[Ints, Ints]:
        """Return (rows,) the clock of each stamp as a place in `_CLOCKS`, and the stamps, ns."""
        tag, size = self.place.stamp, len(self.rows)
        if tag is None or tag.field not in self.layout.by_name:
            return np.zeros(size, np.int64), np.full(size, NO_TIME)
        raw, step = self.rows.raw(tag.field), round(tag.scale * 1e9)
        known = ~self.rows.unknown(tag) & self.rows.present(tag.field)
        known &= np.isfinite(raw) & (np.abs(raw) <= (2**63 - 1) // step)
        whole = np.rint(np.where(known, raw, 0) * (tag.scale * 1e9)) if raw.dtype.kind == "f" else (
            np.where(known, raw, 0) * step
        )  # fmt: skip
        stamps = np.where(known, whole.astype(np.int64), NO_TIME)
        clock = np.full(size, _CLOCKS.index(tag.clock))
        if tag.clock in _BY_SIZE:
            small = _CLOCKS.index(_BY_SIZE[tag.clock])
            clock = np.where(stamps >= UNIX_NS, _CLOCKS.index(Clock.UNIX), small)
        return np.where(known, clock, 0), stamps

    def _utc(self, clock: Clock, rows: Bools) -> Ints:
        """Return (k,) the stamps of `rows` as UTC, ns since 1970."""
        stamps = self.time_ns[rows]
        known = stamps != NO_TIME
        if clock is Clock.UNIX:
            return stamps
        if clock is Clock.UNIX_2019:
            return np.where(known, stamps + np.where(known, _EPOCH_2019_NS, 0), NO_TIME)
        if clock not in (Clock.BOOT, Clock.BOOT_EVENT) or not self._is_autopilot(rows):
            return np.full(len(stamps), NO_TIME)
        zero = self.rows.source.lookup("vehicle.boot_utc", self.rows.table, late=False)
        known &= zero.known[rows]
        start_us = np.rint(np.where(known, zero.values[rows], 0.0) * 1e6).astype(np.int64)
        return np.where(known, np.where(known, stamps, 0) + start_us * 1000, NO_TIME)

    def _is_autopilot(self, rows: Bools) -> bool:
        role = self.rows.source.lookup("sender.role", self.rows.table)
        return bool(role.among(lambda word: word == "autopilot")[rows].all())

    def _origins(self) -> tuple[list[Origin | None], Ints]:
        """Return the local origins in force, and (rows,) which one holds for each row."""
        source, table = self.rows.source, self.rows.table
        names = ("origin.id", "origin.lat", "origin.lon", "origin.alt_msl")
        known = [source.lookup(name, table, late=False) for name in names]
        columns = [np.where(each.known, each.values, np.inf) for each in known]
        said = np.stack([np.where(known[1].known, self.rows.about, -1), *columns], axis=1)
        found, which = np.unique(said, axis=0, return_inverse=True)
        return [_origin(*row) for row in found.tolist()], which.reshape(-1)

    def _problems(self) -> Ints:
        """Return (cells,) why each is no position, as a place in `PROBLEMS`."""
        problem = np.full(len(self.row), _FINE)
        problem[np.any(~np.isfinite(self.values), axis=0)] = _UNKNOWN
        fix = self.place.fix
        if fix is not None and fix.field in self.layout.by_name:
            poor = self.rows.raw(fix.field) < constant("GPS_FIX_TYPE.2D_FIX")
            problem[poor[self.row]] = _NO_FIX
        if self.place.is_geodetic:
            lat, lon = self.values
            problem[(lat == 0) & (lon == 0)] = _ZERO
            problem[np.abs(lat) > 90] = _BEYOND
        part = np.any([~self.rows.used(tag) for tag in self.place.axes], axis=0)
        problem[part[self.row]] = _PARTIAL
        return problem

    def _extract(self, key: Sequence[int], rows: Bools) -> Extract:
        """Return the rows that share `key`: sender, frame, height reference, origin, clock."""
        sender, frame, height, which, clock = key
        cells = rows[self.row]
        index = self.row[cells]
        frames, tag, origin = self.rows.table.frames, self.place.main, self.origins[which]
        message = self.layout.name
        system, component = divmod(sender, 256)
        measured = self._measured(f"{system}/{component} {message}", _CLOCKS[clock], rows, cells)
        instance = self._instance(tag)
        extract = Extract(
            position=None,
            frame=None,
            sysid=system,
            compid=component,
            message=message,
            subject=self.place.subject,
            number=frames.number[index],
            offset=frames.offset[index],
            element=np.flatnonzero(cells) % self.count,
            instance=None if instance is None else instance[index],
            problem=_WORDS[self.problems[cells]],
            measured=measured,
            origin=origin,
        )
        if self.place.is_geodetic:
            return self._geodetic(extract, height, cells)
        return self._cartesian(extract, frame, cells)

    def _instance(self, tag: FieldTag) -> Ints | None:
        given = tag.instance_field and tag.instance_field in self.layout.by_name
        raw = self.rows.raw(tag.instance_field) if given else None
        return raw if raw is not None and raw.dtype.kind == "i" and raw.ndim == 1 else None

    def _geodetic(self, extract: Extract, selected: int, cells: Bools) -> Extract:
        """Return the extract with latitude, longitude and the main height."""
        lat, lon = (column[cells] for column in self.values)
        heights = [t for t in self.place.heights if t.field in self.layout.by_name]
        height, reference = np.full(len(lat), np.nan), AltRef.UNSPECIFIED
        if heights:
            main = heights[0]
            height = self._fixed(self.height(main))[cells]
            reference = self._reference(main, selected)
        position = GeodeticPosition(lat, lon, height, reference, extract.measured)
        level = self._level(reference, extract.origin, cells)
        return replace(extract, position=position, level_msl_m=level)

    def _reference(self, tag: FieldTag, selected: int) -> AltRef:
        if not tag.frame_field:
            return tag.alt_ref
        selectors = catalogue.tags_of(tag.message, tag.frame_field)
        enums = [each.enum for each in selectors if each.enum and set(each.when) <= set(tag.when)]
        return AltRef(selected_height(enums[0] if enums else "MAV_FRAME", selected))

    def _fixed(self, height: Floats) -> Floats:
        """Return heights, NaN where a receiver has a fix in the plane only."""
        fix = self.place.fix
        if fix is None or fix.field not in self.layout.by_name:
            return height
        flat = self.rows.raw(fix.field) == constant("GPS_FIX_TYPE.2D_FIX")
        return np.where(flat[self.row], np.nan, height)

    def _level(self, reference: AltRef, origin: Origin | None, cells: Bools) -> Floats | None:
        """Return (k,) m above the sea, of the level that heights are counted from; None: not needed."""
        if reference is AltRef.ORIGIN and origin is not None:
            return np.full(np.count_nonzero(cells), origin.height_m)
        if reference is not AltRef.HOME:
            return None
        home = self.rows.source.lookup("home.alt_msl", self.rows.table, late=False)
        return np.where(home.known, home.values, np.nan)[self.row][cells]

    def _cartesian(self, extract: Extract, selected: int, cells: Bools) -> Extract:
        """Return the extract with x, y, z in the frame that the catalogue or the row names."""
        tag = self.place.main
        xyz = np.stack([column[cells] for column in self.values], axis=-1)
        name, axes, at_origin, in_body = _frame(tag, selected)
        measured = extract.measured
        if measured.covariance_m2 is not None:
            words = name if name in ("local_ned", "local_enu") else "own"
            measured = replace(measured, covariance_frame=words)
        if in_body:
            position: Position = BodyVector(xyz, axes, "m", measured)
        else:
            position = LocalPosition(xyz, axes, extract.origin if at_origin else None, measured)
        return replace(extract, position=position, frame=name, measured=measured)

    def _measured(self, source: str, clock: Clock, rows: Bools, cells: Bools) -> Measured:
        """Return what is said of some cells beside their numbers."""
        frames, index = self.rows.table.frames, self.row[cells]
        inside = np.cumsum(rows) - 1
        utc = self._utc(clock, rows)[inside[index]] if clock else None
        received = np.where(frames.t_valid, frames.t_us * 1000, NO_TIME)[index]
        return Measured(
            source=source,
            point=self.place.main.ref_point or RefPoint.NONE,
            clock=clock,
            time_ns=self.time_ns[index] if clock else None,
            utc_ns=utc,
            received_ns=received,
            valid=self.problems[cells] == _FINE,
            covariance_m2=self._covariance(cells),
            horizontal_accuracy_m=self._accuracy("horizontal", cells),
            vertical_accuracy_m=self._accuracy("vertical", cells),
        )

    def _accuracy(self, axis: str, cells: Bools) -> Floats | None:
        for tag in self.place.accuracies:
            if tag.axis == axis and tag.field in self.layout.by_name:
                return self.column(tag)[cells]
        return None

    def _covariance(self, cells: Bools) -> Floats | None:
        """Return (k, 3, 3) m^2, None where none is known or its unit is not stated (degrees or metres)."""
        tag = self.place.covariance
        if tag is None or tag.field not in self.layout.by_name or tag.frame is Frame.WGS84:
            return None
        index = _block(tag.cov_layout)
        if index is None or self.count > 1:
            return None
        flat = np.asarray(self.rows.si(tag), np.float64)
        flat = np.where((flat == 0).all(axis=1)[:, None], np.nan, flat)
        padded = np.concatenate((flat, np.full((len(flat), 1), np.nan)), axis=1)
        matrices: Floats = padded[:, index][cells]
        return None if np.isnan(matrices).all() else matrices


_CLOCKS = tuple(Clock)
_BY_SIZE = {Clock.AMBIGUOUS: Clock.BOOT, Clock.BOOT_EVENT: Clock.BOOT_EVENT}
"""Clocks whose stamps may count from 1970 instead, as their size tells."""
_WORDS = np.array(PROBLEMS, object)


def _beside(rows: Bools, column: Floats) -> Bools:
    return rows[:, None] if column.ndim > 1 else rows


def _origin(system: float, number: float, lat: float, lon: float, alt: float) -> Origin | None:
    """Return an origin by what the registry says, to the mm; None where none is in force."""
    if not np.isfinite([lat, lon, alt]).all():
        return None
    name = f"{int(system)}:{int(number)}" if np.isfinite(number) else None
    return Origin(name, round(lat, 9), round(lon, 9), round(alt, 3), AltRef.MSL)


_FRAMES: dict[Frame, tuple[str, bool, bool]] = {
    Frame.LOCAL_NED: ("NED", True, False),
    Frame.NED: ("NED", False, False),
    Frame.LOCAL: ("NED", False, False),
    Frame.MOCAP: ("NED", False, False),
    Frame.BODY_FRD: ("FRD", False, True),
    Frame.HEADING_FRD: ("FRD", False, True),
}
"""Axes; whether zero is the vehicle's local origin; whether they turn with the vehicle."""


def _frame(tag: FieldTag, selected: int) -> tuple[str, str, bool, bool]:
    """Return the frame's name, its axes, whether it begins at the origin, whether it is the body's."""
    if not tag.frame_field:
        return (str(tag.frame), *_FRAMES.get(tag.frame, ("XYZ", False, False)))
    facts = frame_facts(selected) if selected >= 0 else None
    if facts is None or facts.axes not in ("NED", "ENU", "FRD", "FLU"):
        return frame_name(selected).lower(), "XYZ", False, False
    in_body = facts.origin == "vehicle" and facts.axes in ("FRD", "FLU")
    at_origin = facts.origin == "local origin" and facts.axes in ("NED", "ENU")
    return facts.name.lower(), facts.axes, at_origin, in_body


@cache
def _block(layout: CovLayout) -> Ints | None:
    """Return (3, 3) where the covariance of x, y, z lies in a flat layout; -1: not given."""
    full = {CovLayout.FULL_6: 6, CovLayout.FULL_3: 3}
    upper = {CovLayout.UPPER_6: 6, CovLayout.UPPER_9: 9}
    i, j = np.minimum(*np.indices((3, 3))), np.maximum(*np.indices((3, 3)))
    if layout in full:
        rows, columns = np.indices((3, 3))
        return np.asarray(rows * full[layout] + columns)
    if layout in upper:
        return np.asarray(i * upper[layout] - i * (i - 1) // 2 + j - i)
    if layout is CovLayout.DIAGONAL_3:
        return np.where(i == j, i, -1)
    return None
