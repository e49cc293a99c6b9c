"""Headings of a vehicle against its attitude: a heading in another unit turns too little, or too much."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.geo.rotations import wrapped
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Batch, Dialect, Place

Floats = npt.NDArray[np.float64]

MEASURED = (
    ("GLOBAL_POSITION_INT", "hdg"),
    ("GPS_RAW_INT", "yaw"),
    ("GPS2_RAW", "yaw"),
    ("GPS_INPUT", "yaw"),
    ("HIL_GPS", "yaw"),
    ("VFR_HUD", "heading"),
)
"""Fields that say where the nose of the vehicle points, measured or estimated."""

READINGS = {
    "as labelled": 1.0,
    "whole degrees in a field of centidegrees": 100.0,
    "centidegrees in a field of whole degrees": 0.01,
    "radians": 180 / np.pi,
}
"""What the numbers may be, and the factor that makes them right."""
SECTORS = 12
MAX_STREAMS = 256


class _Stream:
    """One heading field of one sender, against the attitude of its vehicle."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.rows = 0
        self.off = np.zeros(len(READINGS))
        """Sum of the absolute differences under each reading, rad."""
        self.seen = np.zeros(SECTORS, np.bool_)
        """Sectors that the nose of the vehicle pointed into."""
        self.first: Place | None = None
        self.last: Place | None = None
        self.example = (0.0, 0.0)
        """Heading as said and yaw of the vehicle, deg, where they were furthest apart."""
        self.worst = -1.0

    def add(self, said: Floats, yaw: Floats, where: tuple[Place, Place]) -> None:
        """Add headings as said (rad, by their label) and the yaw of the vehicle (rad)."""
        factors = np.array(list(READINGS.values()))[:, None]
        off = np.abs(wrapped(said * factors - yaw))
        self.rows += len(said)
        self.off += off.sum(axis=1)
        self.seen[(np.degrees(yaw) % 360 // (360 / SECTORS)).astype(np.int64) % SECTORS] = True
        self.first, self.last = self.first or where[0], where[1]
        worst = int(np.argmax(off[0]))
        if off[0, worst] > self.worst:
            self.worst = float(off[0, worst])
            self.example = (float(np.degrees(said[worst])), float(np.degrees(yaw[worst]) % 360))


class Scale(Check):
    """Headings that agree with the attitude only in another unit."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._streams: dict[tuple[str, int], _Stream] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Add the headings of a batch."""
        for message, field in MEASURED:
            table = batch.tables.get(message)
            if table is not None:
                rows = Rows(table, context)
                (tag,) = catalogue.tags_of(message, field)
                self._add(rows, tag)

    def _add(self, rows: Rows, tag: FieldTag) -> None:
        said, yaw = rows.si(tag), rows.context("vehicle.yaw")
        frames = rows.table.frames
        usable = ~np.isnan(said) & yaw.known & (rows.raw(tag.field) != 0)
        for sender in np.flatnonzero(np.bincount(frames.sender[usable])).tolist():
            mine = np.flatnonzero(usable & (frames.sender == sender))
            key = (f"{tag.message}.{tag.field}", sender)
            if key not in self._streams and len(self._streams) < MAX_STREAMS:
                subject = Subject(sender >> 8, sender & 0xFF, tag.message, tag.field)
                self._streams[key] = _Stream(subject)
            if key in self._streams:
                where = frames.place(int(mine[0])), frames.place(int(mine[-1]))
                self._streams[key].add(said[mine], yaw.values[mine], where)

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that fits only under another reading."""
        for _, stream in sorted(self._streams.items()):
            if not self._moved(stream) or stream.first is None or stream.last is None:
                continue
            off = np.degrees(stream.off / stream.rows)
            best = int(np.argmin(off))
            if off[0] >= self.params["min_off_deg"] and off[best] <= self.params["max_fit_deg"]:
                values: dict[str, Scalar] = {
                    "said": stream.example[0],
                    "yaw": stream.example[1],
                    "off_deg": float(off[0]),
                    "fit_deg": float(off[best]),
                    "reading": list(READINGS)[best],
                    "rows": stream.rows,
                }
                yield Observation(stream.subject, stream.first, stream.last, stream.rows, values)

    def _moved(self, stream: _Stream) -> bool:
        turned = np.count_nonzero(stream.seen) >= self.params["min_sectors"]
        return bool(turned and stream.rows >= self.params["min_rows"])

    def verdict(self) -> Verdict:
        """Return the headings of vehicles that turned enough to tell."""
        mine = [s for (_, sender), s in self._streams.items() if self.concerns_sender(sender)]
        judged = sum(stream.rows for stream in mine if self._moved(stream))
        if mine and not judged:
            return Verdict(0, "insufficient motion: the vehicle hardly turned")
        return Verdict(judged)
