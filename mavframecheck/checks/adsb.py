"""Traffic from ADS-B: what an aircraft says of its speed, beside the way it goes."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.geo.geodesy import bearing_deg, distance_m
from mavframecheck.geo.rotations import wrapped_deg
from mavframecheck.model import Scalar, Subject
from mavframecheck.semantics.constants import constant
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Place, Table
from mavframecheck.wire.table import join

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MESSAGE = "ADSB_VEHICLE"
MAX_AIRCRAFT = 1000
"""Aircraft that are followed, of all senders together."""
FACTORS = {
    10.0: "ten times too large",
    100.0: "a hundred times too large",
    1000.0: "a thousand times too large",
    0.1: "ten times too small",
    0.01: "a hundred times too small",
    0.001: "a thousand times too small",
    3.2808: "3.28 times too large, as feet for metres",
    0.3048: "3.28 times too small, as metres for feet",
    1.9438: "1.94 times too large, as knots for metres per second",
    0.5144: "1.94 times too small, as metres per second for knots",
}


def _flag(name: str) -> int:
    return constant(f"ADSB_FLAGS.{name}")


class Legs(NamedTuple):
    """Ways between two reports of one aircraft, (n,) each; NaN where it does not say."""

    seconds: Floats
    distance_m: Floats
    bearing_deg: Floats
    climbed_m: Floats
    speed_mps: Floats
    climb_mps: Floats
    heading_deg: Floats


@dataclass(slots=True)
class Sender:
    """What the reports of one sender add up to."""

    subject: Subject
    rows: int = 0
    first: Place | None = None
    last: Place | None = None
    sums: dict[str, Floats] = field(default_factory=dict)
    """By name: how many, and sums of said squared, seen squared, said times seen."""

    def add(self, name: str, said: Floats, seen: Floats, good: Bools) -> None:
        """Add pairs of what was said and seen."""
        x, y = said[good], seen[good]
        more = np.array([len(x), x @ x, y @ y, x @ y])
        self.sums[name] = self.sums.get(name, np.zeros(4)) + more


class _Traffic(Check):
    """Follows every aircraft from report to report."""

    field_name: str | None = None
    """The field that a finding is about."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no aircraft yet."""
        super().__init__(params, dialect)
        self._senders: dict[int, Sender] = {}
        self._last: dict[tuple[int, int], Table] = {}

    def update(self, batch: Batch, _context: Context) -> None:
        """Add the ways that a batch completes."""
        table = batch.tables.get(MESSAGE)
        if table is None:
            return
        table = table.take(table.frames.t_valid & (table["flags"] & _flag("VALID_COORDS") != 0))
        key = table.frames.sender.astype(np.int64) << 32 | table["ICAO_address"].astype(np.int64)
        for each in np.unique(key).tolist():
            aircraft = each >> 32, each & 0xFFFFFFFF
            if aircraft in self._last or len(self._last) < MAX_AIRCRAFT:
                self._follow(aircraft, table.take(key == each))

    def _follow(self, aircraft: tuple[int, int], table: Table) -> None:
        sender = aircraft[0]
        state = self._senders.setdefault(
            sender, Sender(Subject(sender >> 8, sender & 0xFF, MESSAGE, self.field_name))
        )
        state.rows += len(table)
        state.first = state.first or table.frames.place(0)
        state.last = table.frames.place(len(table) - 1)
        before = self._last.get(aircraft)
        joined = table if before is None else join([before, table])
        where = np.column_stack((joined["lat"], joined["lon"]))
        fresh = np.concatenate(([True], np.any(np.diff(where, axis=0) != 0, axis=1)))
        joined = joined.take(fresh)
        self._last[aircraft] = joined.take(np.array([len(joined) - 1])).compact()
        if len(joined) > 1:
            self.add(state, _legs(joined))

    @abstractmethod
    def add(self, sender: Sender, legs: Legs) -> None:
        """Add ways of one aircraft."""

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every sender in which the mistake is."""
        for sender in self._senders.values():
            told = self.told(sender)
            if told and sender.first is not None and sender.last is not None:
                values = {"rows": sender.rows, **told}
                yield Observation(sender.subject, sender.first, sender.last, sender.rows, values)

    @abstractmethod
    def told(self, sender: Sender) -> dict[str, Scalar] | None:
        """Return the values for the texts where the mistake is made."""

    @abstractmethod
    def enough(self, sender: Sender) -> bool:
        """Return whether there is enough motion to tell."""

    def verdict(self) -> Verdict:
        """Return the reports of senders of whom it can be told."""
        mine = [state for key, state in self._senders.items() if self.concerns_sender(key)]
        told = sum(sender.rows for sender in mine if self.enough(sender))
        if mine and not told:
            return Verdict(0, "no aircraft moves far enough between its reports")
        return Verdict(told)


def _legs(table: Table) -> Legs:
    lat, lon = table["lat"] * 1e-7, table["lon"] * 1e-7
    flags = table["flags"].astype(np.int64)

    def said(name: str, scale: float, flag: str) -> Floats:
        values = np.where(flags & _flag(flag) != 0, table[name] * scale, np.nan)
        return np.asarray((values[1:] + values[:-1]) / 2)

    height = np.where(flags & _flag("VALID_ALTITUDE") != 0, table["altitude"] * 1e-3, np.nan)
    heading = np.where(flags & _flag("VALID_HEADING") != 0, table["heading"] * 1e-2, np.nan)
    return Legs(
        np.diff(table.frames.t_us) * 1e-6,
        distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:]),
        bearing_deg(lat[:-1], lon[:-1], lat[1:], lon[1:]),
        np.diff(height),
        said("hor_velocity", 1e-2, "VALID_VELOCITY"),
        said("ver_velocity", 1e-2, "VERTICAL_VELOCITY_VALID"),
        heading[1:],
    )


class Units(_Traffic):
    """Speeds, or altitudes, that are a factor off the way that is gone."""

    def add(self, sender: Sender, legs: Legs) -> None:
        """Add what was said and seen along the ground, and along the vertical."""
        dt = legs.seconds
        near = (dt >= self.params["shortest_s"]) & (dt <= self.params["longest_s"])
        level = near & np.isfinite(legs.speed_mps) & (legs.distance_m > self.params["min_leg_m"])
        sender.add("level", legs.speed_mps * dt, legs.distance_m, level)
        upright = near & np.isfinite(legs.climb_mps + legs.climbed_m)
        upright &= (legs.climbed_m != 0) & (legs.climb_mps != 0)
        sender.add("upright", legs.climb_mps * dt, legs.climbed_m, upright)

    def enough(self, sender: Sender) -> bool:
        """Return whether some aircraft went far, or high, enough."""
        return any(self._ratio(sender, name) is not None for name in ("level", "upright"))

    def _ratio(self, sender: Sender, name: str) -> float | None:
        """Return what was said per what was seen, None where that cannot be told."""
        count, said, seen, both = sender.sums.get(name, np.zeros(4)).tolist()
        far = self.params["min_way_m"] if name == "level" else self.params["min_climb_m"]
        if count < self.params["min_legs"] or seen < far**2 / count or not said:
            return None
        alike = abs(both) / np.sqrt(said * seen)
        return both / seen if alike >= self.params["min_alike"] else None

    def told(self, sender: Sender) -> dict[str, Scalar] | None:
        """Return by how much, and which."""
        for name, what in (
            ("level", "hor_velocity"),
            ("upright", "ver_velocity, beside the change of altitude,"),
        ):
            ratio = self._ratio(sender, name)
            if ratio is None:
                continue
            near = min(FACTORS, key=lambda factor: abs(np.log(abs(ratio) / factor)))
            off = abs(np.log(abs(ratio) / near))
            is_factor = off < self.params["tolerance"] and off < abs(np.log(abs(ratio)))
            if ratio > 0 and is_factor:
                return {"what": what, "ratio": round(ratio, 6), "says": FACTORS[near]}
        return None


class HeadingReversed(_Traffic):
    """Headings that point to where the aircraft comes from."""

    field_name = "heading"

    def add(self, sender: Sender, legs: Legs) -> None:
        """Count the ways that go against the heading, and all."""
        near = legs.seconds <= self.params["longest_s"]
        fast = legs.distance_m > self.params["min_speed_mps"] * legs.seconds
        good = near & fast & (legs.distance_m > self.params["min_leg_m"])
        good &= np.isfinite(legs.heading_deg)
        off = np.abs(wrapped_deg(legs.heading_deg - legs.bearing_deg))
        against = np.asarray(off > self.params["against_deg"], np.float64)
        sender.add("against", against, np.ones(len(off)), good)

    def enough(self, sender: Sender) -> bool:
        """Return whether enough ways are known."""
        return float(sender.sums.get("against", np.zeros(4))[0]) >= int(self.params["min_legs"])

    def told(self, sender: Sender) -> dict[str, Scalar] | None:
        """Return how many ways go against the heading."""
        if not self.enough(sender):
            return None
        count, against, _, _ = sender.sums["against"].tolist()
        if against < self.params["share"] * count:
            return None
        return {"legs": int(count), "against": int(against)}
