"""Checks of delay: values that belong to an earlier time than their stamp."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.clocks import ClockCheck, alike, ends, subject, words
from mavframecheck.model import Scalar
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.timing import Timing
from mavframecheck.wire import Batch, Dialect, Table

Floats = npt.NDArray[np.float64]

REFERENCE = "LOCAL_POSITION_NED"
MAX_SAMPLES = 12_000
"""Rows of a stream that are compared: eight minutes at 25 Hz."""
MAX_TRACKS = 32
"""Streams that are compared."""
WINDOW_S = 0.4
"""Speed is taken over this time, of both alike (s)."""
_FASTEST_MPS = 30.0
"""Faster (m/s) is a leap of the origin, not a flight."""
_EARLIEST_S, _LATEST_S, _FINE_S = -0.6, 1.5, 0.02
"""Delays that are tried, s."""
_SHORT_S = 0.2
_TORN_S = 1.0


class Fit(NamedTuple):
    """How a track goes along with another one, some time ago."""

    delay_s: float
    correlation: float
    undelayed: float
    """Correlation without delay."""
    spread_mps: float
    """Standard deviation of the speed, m/s."""
    inert: float
    """Correlation of the reference with itself `_SHORT_S` earlier: near 1 a delay does not show."""


@dataclass(slots=True)
class _Track:
    """The first positions of a stream: (n, 4) stamp in s, x, y, z in m."""

    parts: list[Floats] = field(default_factory=list)
    rows: int = 0

    def add(self, rows: Floats) -> None:
        kept = rows[: MAX_SAMPLES - self.rows]
        if len(kept):
            self.parts.append(kept)
            self.rows += len(kept)

    def speed(self) -> tuple[Floats, Floats]:
        """Return (n,) times in s and speeds in m/s over its longest piece without a restart."""
        rows = np.concatenate(self.parts) if self.parts else np.zeros((0, 4))
        torn = np.flatnonzero(np.diff(rows[:, 0]) < -_TORN_S) + 1
        piece = max(np.split(rows, torn), key=len)
        return speeds(piece[np.unique(piece[:, 0], return_index=True)[1]])


def speeds(rows: Floats) -> tuple[Floats, Floats]:
    """Return times in s and speeds in m/s of a track (n, 4) of stamps and positions.

    Speed does not depend on where a frame has its origin or which way its axes point.
    """
    t, at = rows[:, 0], rows[:, 1:]
    later = np.searchsorted(t, t + WINDOW_S)
    first = np.flatnonzero(later < len(t))
    last = later[first]
    went = t[last] - t[first]
    speed = np.linalg.norm(at[last] - at[first], axis=1) / np.maximum(went, 1e-9)
    good = (went < 1.6 * WINDOW_S) & (speed < _FASTEST_MPS)
    return ((t[first] + t[last]) / 2)[good], speed[good]


def fit_delay(track: tuple[Floats, Floats], reference: tuple[Floats, Floats]) -> Fit | None:
    """Return the delay by which the speed of `track` follows `reference` best; None if they hardly meet."""
    (t, speed), (at, known) = track, reference
    if len(t) < 2 or len(at) < 2:
        return None
    inside = (t - _LATEST_S > at[0]) & (t - _EARLIEST_S < at[-1])
    t, speed = t[inside], speed[inside]
    if len(t) < 100 or not np.ptp(speed) or not np.ptp(known):
        return None
    delays = np.arange(_EARLIEST_S, _LATEST_S, _FINE_S)
    matches = [_correlation(speed, np.interp(t - delay, at, known)) for delay in delays]
    best, none = int(np.argmax(matches)), int(np.argmin(np.abs(delays)))
    spread = float(np.std(np.interp(t, at, known)))
    inert = _correlation(np.interp(t, at, known), np.interp(t - _SHORT_S, at, known))
    return Fit(float(delays[best]), matches[best], matches[none], spread, inert)


def _correlation(a: Floats, b: Floats) -> float:
    a, b = a - a.mean(), b - b.mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale else 0.0


class StreamDelay(ClockCheck):
    """Positions that lag behind their own stamp, as the vehicle's movement shows."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no track yet."""
        super().__init__(params, dialect)
        self._tracks: dict[tuple[int, str], _Track] = {}
        self._fields = dict.fromkeys(words(self.params["messages"]))

    def update(self, batch: Batch, context: Context) -> None:
        """Add to the tracks."""
        super().update(batch, context)
        for message in (REFERENCE, *self._fields):
            table = batch.tables.get(message)
            if table is not None:
                self._collect(table)

    def _collect(self, table: Table) -> None:
        names = [n for n in ("time_boot_ms", "time_usec", "usec") if n in table.layout.by_name]
        unit_s = 1e-3 if names[0] == "time_boot_ms" else 1e-6
        rows = np.column_stack([table[names[0]] * unit_s, table["x"], table["y"], table["z"]])
        usable = np.isfinite(rows).all(axis=1) & (rows[:, 0] > 0)
        sender = table.frames.sender
        for each in np.unique(sender[usable]).tolist():
            key = (each, table.name)
            if key in self._tracks or len(self._tracks) < MAX_TRACKS:
                mine = rows[usable & (sender == each)]
                self._tracks.setdefault(key, _Track()).add(mine)

    def judged(self) -> Sequence[Timing]:
        """Return the streams of others that are stamped by the vehicle's clock."""
        return [
            timing
            for timing in self.clocks.timings
            if timing.stream.key.message in self._fields
            and (timing.sender, timing.stream.key.message) in self._tracks
            and not self.autopilot(timing.sender)
            and self._by_vehicle_clock(timing)
        ]

    def _by_vehicle_clock(self, timing: Timing) -> bool:
        pool = self.clocks.pool(self.clocks.autopilot_of(timing))
        if pool is None or not timing.runs or not alike(timing, pool):
            return False
        apart = timing.lag("low", pool.rate) - pool.at(timing.stream.knots["stretch"])
        known = apart[np.isfinite(apart)]
        return len(known) > 0 and abs(float(np.median(known))) <= self.params["same_clock_s"]

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stream that is late."""
        for timing in self.judged():
            fit = self._fit(timing)
            if fit is not None and self._late(fit):
                values: dict[str, Scalar] = {
                    "delay_s": fit.delay_s,
                    "correlation": fit.correlation,
                    "undelayed": fit.undelayed,
                    "spread_mps": fit.spread_mps,
                }
                yield Observation(subject(timing), *ends(timing), timing.stream.stamped, values)

    def _fit(self, timing: Timing) -> Fit | None:
        pilot = self.clocks.autopilot_of(timing)
        track = self._tracks[timing.sender, timing.stream.key.message]
        reference = self._tracks.get((pilot, REFERENCE)) if pilot is not None else None
        return None if reference is None else fit_delay(track.speed(), reference.speed())

    def _late(self, fit: Fit) -> bool:
        clear = fit.correlation - fit.undelayed >= self.params["min_gain"]
        moving = fit.spread_mps >= self.params["min_spread_mps"]
        alike_enough = fit.correlation >= self.params["min_correlation"]
        inside = fit.delay_s < _LATEST_S - 2 * _FINE_S
        late = fit.delay_s >= self.params["min_delay_s"]
        return bool(clear and moving and alike_enough and inside and late)

    def _prompt(self, fit: Fit) -> bool:
        """Return whether a track surely has no delay: one would cost more than what does not follow anyway."""
        follows = 1 - fit.inert >= 2 * (1 - fit.correlation)
        return bool(follows and fit.delay_s < self.params["min_delay_s"])

    def verdict(self) -> Verdict:
        """Return the rows compared, or why they could not be."""
        streams = [
            timing
            for timing in self.clocks.timings
            if timing.stream.key.message in self._fields
            and not self.autopilot(timing.sender)
            and self.concerns_sender(timing.sender)
        ]
        if not streams:
            return Verdict(0)
        judged = [timing for timing in self.judged() if self.concerns_sender(timing.sender)]
        if not judged:
            return Verdict(0, "the estimates are not stamped by the vehicle's clock")
        fits = [fit for timing in judged if (fit := self._fit(timing)) is not None]
        if all(fit.spread_mps < self.params["min_spread_mps"] for fit in fits):
            return Verdict(0, "the vehicle hardly moved, or its position is not in the recording")
        alike_enough = [fit for fit in fits if self._prompt(fit) or self._late(fit)]
        if not alike_enough:
            return Verdict(0, f"its speed follows the vehicle's too roughly to tell {_SHORT_S} s")
        if all(1 - fit.inert < self.params["min_gain"] for fit in alike_enough):
            return Verdict(
                0, f"the vehicle's speed changes too slowly to show a delay of {_SHORT_S} s"
            )
        return Verdict(sum(timing.stream.stamped for timing in judged))
