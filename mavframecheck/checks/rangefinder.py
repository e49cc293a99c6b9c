"""Range finders beside the height of their vehicle: which way they really look."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant, entry_name
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place, Table

Floats = npt.NDArray[np.float64]

MESSAGE = "DISTANCE_SENSOR"
DOWN = constant("MAV_SENSOR_ORIENTATION.PITCH_270")
CUSTOM = constant("MAV_SENSOR_ORIENTATION.CUSTOM")
MAX_STREAMS = 64


@dataclass(slots=True)
class _Sensor:
    """What the ranges of one sensor and the heights add up to."""

    rows: int = 0
    first: Place | None = None
    last: Place | None = None
    sums: Floats = field(default_factory=lambda: np.zeros(6))
    """How many, and sums of height, range, height squared, range squared, and their product."""
    low: float = np.inf
    high: float = -np.inf
    """Heights at which it was heard, m."""

    def add(self, height: Floats, range_m: Floats) -> None:
        """Add pairs."""
        more = (height.sum(), range_m.sum(), height @ height, range_m @ range_m, height @ range_m)
        self.sums = self.sums + np.array([len(height), *more])
        self.low, self.high = min(self.low, height.min()), max(self.high, height.max())

    def fit(self) -> tuple[float, float]:
        """Return metres of range per metre of height, and the correlation."""
        n, h, r, hh, rr, hr = self.sums.tolist()
        heights, ranges, both = hh - h * h / n, rr - r * r / n, hr - h * r / n
        if heights <= 0 or ranges <= 0:
            return 0.0, 0.0
        return both / heights, both / float(np.sqrt(heights * ranges))


class Orientation(Check):
    """Sensors that look down and say otherwise, or look up and say that they look down."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no sensor yet."""
        super().__init__(params, dialect)
        self._sensors: dict[tuple[int, int, int], _Sensor] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Add the ranges of a batch."""
        table = batch.tables.get(MESSAGE)
        if table is None:
            return
        height = context.lookup("vehicle.relative_alt", table, late=False)
        inside = table["current_distance"] > table["min_distance"]
        inside &= (table["current_distance"] < table["max_distance"]) & height.known
        inside &= table["orientation"] != CUSTOM
        heights = np.asarray(height.values, np.float64)
        sensor = table.frames.sender.astype(np.int64) << 16
        sensor |= table["id"].astype(np.int64) << 8 | table["orientation"]
        for each in np.unique(sensor[inside]).tolist():
            key = each >> 16, each >> 8 & 0xFF, each & 0xFF
            if key in self._sensors or len(self._sensors) < MAX_STREAMS:
                mine = np.flatnonzero(inside & (sensor == each))
                self._add(self._sensors.setdefault(key, _Sensor()), table, mine, heights[mine])

    def _add(
        self, sensor: _Sensor, table: Table, rows: npt.NDArray[np.int64], height: Floats
    ) -> None:
        sensor.rows += len(rows)
        sensor.first = sensor.first or table.frames.place(int(rows[0]))
        sensor.last = table.frames.place(int(rows[-1]))
        sensor.add(height, table["current_distance"][rows] * 1e-2)

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every sensor that looks elsewhere."""
        for (sender, instance, orientation), sensor in sorted(self._sensors.items()):
            slope, alike = sensor.fit()
            fits = abs(alike) >= self.params["min_alike"]
            fits &= abs(np.log(max(abs(slope), 1e-9))) < self.params["tolerance"]
            wrong = slope < 0 if orientation == DOWN else slope > 0
            if not (self._climbed(sensor) and fits and wrong):
                continue
            values: dict[str, Scalar] = {
                "sensor": instance,
                "orientation": orientation,
                "called": entry_name("MAV_SENSOR_ORIENTATION", orientation),
                "looks": "up" if slope < 0 else "down",
                "slope": round(slope, 6),
                "alike": round(alike, 6),
                "span_m": sensor.high - sensor.low,
            }
            whom = Subject(sender >> 8, sender & 0xFF, MESSAGE, "orientation")
            if sensor.first is not None and sensor.last is not None:
                yield Observation(whom, sensor.first, sensor.last, sensor.rows, values)

    def _climbed(self, sensor: _Sensor) -> bool:
        span = sensor.high - sensor.low
        return bool(sensor.rows >= self.params["min_rows"] and span >= self.params["min_climb_m"])

    def verdict(self) -> Verdict:
        """Return the ranges of vehicles that climbed enough to tell."""
        mine = [s for (sender, *_), s in self._sensors.items() if self.concerns_sender(sender)]
        told = sum(sensor.rows for sensor in mine if self._climbed(sensor))
        if mine and not told:
            return Verdict(0, "the vehicle hardly climbs while its sensor has a range")
        return Verdict(told)
