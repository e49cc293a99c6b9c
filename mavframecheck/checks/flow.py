"""Optical flow beside the gyroscope in the same message: a turn moves the picture along known axes."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Scalar, Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place, Table

Floats = npt.NDArray[np.float64]

MESSAGES = ("OPTICAL_FLOW_RAD", "HIL_OPTICAL_FLOW")
MAX_SENSORS = 64
_AXES = ("x", "y")


def _readings() -> list[tuple[Floats, str]]:
    """Return how the flow may lie against the gyroscope: the eight signed permutations, in words."""
    found = []
    for order in itertools.permutations(range(2)):
        for signs in itertools.product((1.0, -1.0), repeat=2):
            matrix = np.zeros((2, 2))
            matrix[range(2), order] = signs
            says = [
                f"integrated_{_AXES[i]} goes with {'minus ' if signs[i] < 0 else ''}{_AXES[order[i]]}gyro"
                for i in range(2)
                if order[i] != i or signs[i] < 0
            ]
            found.append((matrix, " and ".join(says)))
    return found


_READINGS = _readings()


@dataclass(slots=True)
class _Sensor:
    """What the rows of one sensor add up to, while it turns."""

    rows: int = 0
    turning: int = 0
    first: Place | None = None
    last: Place | None = None
    gyro: Floats = field(default_factory=lambda: np.zeros((2, 2)))
    both: Floats = field(default_factory=lambda: np.zeros((2, 2)))
    """Sums of gyro by gyro, and of flow by gyro."""
    flow: float = 0.0
    """Sum of the flow squared."""

    def left(self, matrix: Floats) -> float:
        """Return the share of the flow that a reading leaves."""
        off = self.flow - 2 * float(np.sum(matrix * self.both))
        off += float(np.trace(matrix @ self.gyro @ matrix.T))
        return off / self.flow if self.flow > 0 else np.inf


class Axes(Check):
    """Flows whose axes or signs are not those of the gyroscope beside them."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no sensor yet."""
        super().__init__(params, dialect)
        self._sensors: dict[tuple[str, int, int], _Sensor] = {}

    def update(self, batch: Batch, _context: Context) -> None:
        """Add the rows of a batch in which the sensor turns."""
        for message in MESSAGES:
            table = batch.tables.get(message)
            if table is None:
                continue
            key = table.frames.sender.astype(np.int64) << 8 | table["sensor_id"]
            for each in np.unique(key).tolist():
                which = message, each >> 8, each & 0xFF
                if which in self._sensors or len(self._sensors) < MAX_SENSORS:
                    self._add(self._sensors.setdefault(which, _Sensor()), table.take(key == each))

    def _add(self, sensor: _Sensor, table: Table) -> None:
        sensor.rows += len(table)
        sensor.first = sensor.first or table.frames.place(0)
        sensor.last = table.frames.place(len(table) - 1)
        gyro = np.column_stack((table["integrated_xgyro"], table["integrated_ygyro"])).astype(float)
        flow = np.column_stack((table["integrated_x"], table["integrated_y"])).astype(float)
        seconds = table["integration_time_us"] * 1e-6
        rate = np.linalg.norm(gyro, axis=1) / np.maximum(seconds, 1e-6)
        turns = np.isfinite(gyro + flow).all(axis=1) & (seconds > 0) & (table["quality"] > 0)
        turns &= (rate > self.params["min_rate_radps"]) & (rate < self.params["max_rate_radps"])
        g, f = gyro[turns] / seconds[turns, None], flow[turns] / seconds[turns, None]
        sensor.turning += len(g)
        sensor.gyro = sensor.gyro + g.T @ g
        sensor.both = sensor.both + f.T @ g
        sensor.flow += float(np.square(f).sum())

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every sensor whose axes are others."""
        for (message, sender, _), sensor in sorted(self._sensors.items()):
            if not self._turned(sensor) or sensor.first is None or sensor.last is None:
                continue
            best = min(_READINGS, key=lambda each: sensor.left(each[0]))
            left, labelled = sensor.left(best[0]), sensor.left(np.eye(2))
            if left <= self.params["max_left"] and labelled >= self.params["min_labelled"]:
                values: dict[str, Scalar] = {
                    "message": message,
                    "says": best[1],
                    "left": round(100 * left, 3),
                    "labelled": round(100 * labelled, 3),
                    "turning": sensor.turning,
                }
                whom = Subject(sender >> 8, sender & 0xFF, message, "integrated_x")
                yield Observation(whom, sensor.first, sensor.last, sensor.rows, values)

    def _turned(self, sensor: _Sensor) -> bool:
        least = self.params["min_rows"] * self.params["min_rate_radps"] ** 2
        return bool(np.diag(sensor.gyro).min() >= least)

    def verdict(self) -> Verdict:
        """Return the rows of sensors that turned about both axes."""
        mine = [s for (_, sender, _), s in self._sensors.items() if self.concerns_sender(sender)]
        told = sum(sensor.rows for sensor in mine if self._turned(sensor))
        if mine and not told:
            return Verdict(0, "the sensor hardly turns about both of its axes")
        return Verdict(told)
