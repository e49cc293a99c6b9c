"""The registry of origins, homes and launch points."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
import pyproj
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from mavframecheck.geo.geodesy import distance_m
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.established import ASKED, INFERRED, SAID
from mavframecheck.vehicle.origins import Registry
from mavframecheck.wire import read_batches
from tests.strategies import DIALECT, START_US, chunks, cut, frame

LAT, LON, ALT = 47.397744, 8.5455933, 488.0
ARMED = 128
Say = tuple[float, str, dict[str, Any], tuple[int, int]]
Project = Callable[[float, float, float, float], tuple[float, float]]


def px4(north: float, east: float, lat0: float, lon0: float) -> tuple[float, float]:
    """Return latitude and longitude of a local position as PX4 projects; oracle: PROJ."""
    plane = pyproj.Proj(proj="aeqd", lat_0=lat0, lon_0=lon0, R=6_371_000)
    lon, lat = plane(east, north, inverse=True)
    return lat, lon


def ardupilot(north: float, east: float, lat0: float, lon0: float) -> tuple[float, float]:
    """Return the same as ArduPilot does: a fixed length of 1e-7 degrees, east by the mean latitude."""
    lat = lat0 + north / 111_318.84502145034
    return lat, lon0 + east / (111_318.84502145034 * np.cos(np.radians((lat + lat0) / 2)))


class Vehicle(NamedTuple):
    """A vehicle that says where it is."""

    system: int = 1
    lat: float = LAT
    lon: float = LON
    alt: float = ALT
    project: Project = px4

    @property
    def sender(self) -> tuple[int, int]:
        return self.system, 1

    def pair(self, t: float, ms: int, ned: tuple[float, float, float] = (0, 0, -12)) -> list[Say]:
        """Return a local position and the global one that belongs to it."""
        lat, lon = self.project(ned[0], ned[1], self.lat, self.lon)
        place = {"lat": round(lat * 1e7), "lon": round((lon + 180) % 360 * 1e7 - 1.8e9)}
        place |= {"alt": round((self.alt - ned[2]) * 1e3), "time_boot_ms": ms}
        local = {"time_boot_ms": ms, **dict(zip("xyz", map(float, ned), strict=True))}
        return [
            (t, "LOCAL_POSITION_NED", local, self.sender),
            (t, "GLOBAL_POSITION_INT", place, self.sender),
        ]

    def flight(
        self, t: float, ms: int, seconds: float, ned: tuple[float, float, float] = (0, 0, -12)
    ) -> list[Say]:
        """Return pairs, five a second."""
        count = round(seconds * 5)
        return [say for k in range(count) for say in self.pair(t + 0.2 * k, ms + 200 * k, ned)]

    def origin(self, t: float) -> list[Say]:
        """Return what the vehicle says of its origin."""
        return [(t, "GPS_GLOBAL_ORIGIN", self.place, self.sender)]

    def home(self, t: float) -> list[Say]:
        """Return that home is at the origin."""
        return [(t, "HOME_POSITION", self.place, self.sender)]

    def beats(self, t: float, count: int, mode: int = ARMED) -> list[Say]:
        """Return heartbeats, one a second."""
        beat = {"autopilot": 12, "type": 2, "base_mode": mode}
        return [(t + k, "HEARTBEAT", beat, self.sender) for k in range(count)]

    @property
    def place(self) -> dict[str, int]:
        """The origin as messages hold it."""
        names, values = ("latitude", "longitude"), (self.lat, self.lon)
        fields = {name: round(value * 1e7) for name, value in zip(names, values, strict=True)}
        return fields | {"altitude": round(self.alt * 1e3)}

    def ask(self, t: float) -> list[Say]:
        """Return that somebody asks for the origin to be here."""
        fields = {**self.place, "target_system": self.system}
        return [(t, "SET_GPS_GLOBAL_ORIGIN", fields, (255, 190))]


def recorded(says: Iterable[Say]) -> bytes:
    """Return a tlog of what is said, in order of time."""
    data = b""
    for number, (t, name, fields, sender) in enumerate(sorted(says, key=lambda say: say[0])):
        data += (START_US + round(t * 1e6)).to_bytes(8, "big")
        data += frame(name, fields, sender, number)
    return data


def read(says: Iterable[Say], cuts: Iterable[int] = ()) -> Registry:
    """Return the registry of a recording that comes in pieces."""
    context = Context()
    for batch in read_batches(chunks(cut(recorded(says), cuts)), DIALECT, stamped=True):
        context.update(batch)
        context.settle()
    return context.registry


V = Vehicle()
MOVED = V._replace(lat=LAT + 1e-4, alt=ALT + 3)


@pytest.mark.parametrize("project", [px4, ardupilot])
@settings(max_examples=60, deadline=None)
@given(
    lat=st.floats(-80, 80),
    lon=st.floats(-180, 179.9),
    north=st.floats(-3000, 3000),
    east=st.floats(-3000, 3000),
)
def test_inferred(project: Project, lat: float, lon: float, north: float, east: float) -> None:
    """Positions alone tell where the origin is, to what the projections differ by."""
    assume(abs(lat) + abs(lon) > 0.1)  # 0, 0 means that there is no position
    vehicle = Vehicle(lat=lat, lon=lon, project=project)
    (origin,) = read(vehicle.flight(0, 20_000, 3, (north, east, -40))).origins
    off_m = distance_m(lat, lon, origin.at.lat, origin.at.lon)
    assert off_m <= 0.05 + 0.007 * np.hypot(north, east)
    assert origin.at.alt_msl == pytest.approx(vehicle.alt, abs=0.01)
    assert (origin.source, origin.boot_ms) == (INFERRED, 20_000)


def test_said() -> None:
    """What a message says counts as it is; positions that agree add nothing."""
    (origin,) = read([*V.origin(0), *V.flight(1, 20_000, 20, (300, -200, -30))]).origins
    assert origin.at == pytest.approx((LAT, LON, ALT), abs=1e-7)
    assert (origin.origin_id, origin.source, origin.height_reference) == (1, SAID, "msl")


def test_said_later() -> None:
    """An inferred origin that is said later is the same one, more exactly."""
    registry = read([*V.flight(0, 20_000, 5), *V.origin(6), *V.flight(7, 27_000, 5)])
    assert [(o.origin_id, o.source) for o in registry.origins] == [(1, INFERRED), (1, SAID)]
    assert [o.source for o in registry.of(1)] == [SAID]
    assert not registry.moves


def test_height_datum_reset() -> None:
    """The height is set anew at arming and no message says so: the positions do."""
    after = V._replace(alt=ALT + 2.5)
    registry = read([*V.origin(0), *V.flight(1, 20_000, 5), *after.flight(6, 25_000, 5)])
    first, second = registry.origins
    assert (first.source, second.source) == (SAID, INFERRED)
    assert second.at.alt_msl == pytest.approx(ALT + 2.5, abs=0.01)
    (move,) = registry.moves
    assert move.shift == pytest.approx((0, 0, -2.5), abs=0.02)
    assert (move.said, move.armed_s) == (False, None)


def test_who_leapt() -> None:
    """The local position leaps under a steady global one."""
    at = px4(30, 0, LAT, LON)
    moved = V._replace(lat=at[0], lon=at[1])
    says = [*V.flight(0, 20_000, 5, (40, 0, -12)), *moved.flight(5, 25_000, 5, (10, 0, -12))]
    (move,) = read(says).moves
    assert move.local_m == pytest.approx(30, abs=0.1)
    assert move.global_m == pytest.approx(0, abs=0.1)


def test_moved_on_request() -> None:
    registry = read(
        [*V.origin(0), *V.beats(0, 3, 0), *V.beats(3, 20), *MOVED.ask(14), *MOVED.origin(15)]
    )
    (move,) = registry.moves
    assert (move.before.origin_id, move.after.origin_id) == (1, 2)
    assert (move.said, move.after.asked_by) == (True, 255 * 256 + 190)
    assert move.armed_s == pytest.approx(12)


def test_refused() -> None:
    """An autopilot that ignores a request keeps its origin."""
    registry = read([*V.origin(0), *MOVED.ask(2), *V.flight(3, 20_000, 10)])
    assert [o.source for o in registry.origins] == [SAID]


def test_asked_where_none_is_known() -> None:
    """A request is all there is, until the positions say otherwise: that is no move."""
    registry = read([*V.beats(0, 20), *MOVED.ask(2), *V.flight(3, 20_000, 10)])
    assert [o.source for o in registry.origins] == [ASKED, INFERRED]
    assert not registry.moves


def test_restart() -> None:
    """Nothing of one boot holds in the next, and an origin elsewhere then is no move."""
    far = V._replace(lat=LAT + 0.01)
    says = [*V.origin(0), *V.home(0), *V.flight(1, 60_000, 10)]
    registry = read([*says, *far.flight(20, 2000, 10), *far.home(28)])
    assert [(o.origin_id, o.boot) for o in registry.origins] == [(1, 0), (2, 1)]
    assert [home.boot for home in registry.homes] == [0, 1]
    ((system, seen),) = registry.lost
    assert (system, registry.moves) == (1, [])
    asked = np.array([seen.number + k for k in (-1, 0, 1)])
    second = registry.origins[1].seen.number
    assert registry.at(1, asked).tolist() == [0, 0, -1]
    assert registry.at(1, np.array([second, second + 1, 10**6])).tolist() == [-1, 1, 1]


def test_restart_at_the_same_place() -> None:
    registry = read(
        [*V.origin(0), *V.flight(1, 60_000, 10), *V.flight(20, 2000, 10), *V.origin(31)]
    )
    assert {(o.origin_id, o.boot) for o in registry.origins} == {(1, 0), (2, 1)}


def test_said_before_the_restart_is_certain() -> None:
    """An origin said right behind a restart belongs to the new boot, and is no move."""
    far = V._replace(lat=LAT + 0.01)
    says = [*V.origin(0), *V.flight(1, 60_000, 10), *far.flight(20, 2000, 10), *far.origin(20.1)]
    registry = read(says)
    assert registry.of(1)[-1].boot == 1
    assert (registry.of(1)[-1].source, registry.moves) == (SAID, [])


def test_two_vehicles() -> None:
    other = Vehicle(system=2, lat=LAT + 3e-4)
    registry = read([*V.flight(0, 20_000, 5), *other.flight(0.01, 20_000, 5), *other.origin(6)])
    assert registry.systems == [1, 2]
    assert registry.in_force(1) == registry.of(1)[0]
    assert registry.of(2)[0].at.lat == pytest.approx(LAT + 3e-4, abs=1e-7)


def test_home_and_launch() -> None:
    """Home, launch point and origin are three places."""
    home = V._replace(lat=LAT + 1e-3)
    says = [*V.origin(0), *home.home(1), *V.beats(0, 6, 0), *V.flight(2, 20_000, 8, (50, 0, 0))]
    registry = read([*says, *V.beats(6, 5)])
    (launch,) = registry.launches
    assert launch.at is not None
    assert distance_m(LAT, LON, launch.at.lat, launch.at.lon) == pytest.approx(50, abs=0.4)
    assert registry.homes[0].at.lat == pytest.approx(LAT + 1e-3)
    assert (registry.homes[0].armed_s, registry.homes[0].asked_by) == (None, None)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    parts=st.lists(st.integers(0, 9), min_size=2, max_size=6),
    cuts=st.lists(st.integers(0, 60_000), max_size=8),
)
def test_pieces(parts: list[int], cuts: list[int]) -> None:
    """The registry does not depend on where a recording is cut."""
    says: list[Say] = []
    for k, part in enumerate(parts):
        t, vehicle = 20.0 * k, (V, MOVED)[part % 2]
        ms = round(t * 1e3) if part % 3 else 1000
        says += vehicle.flight(t, ms, 4, (part * 3.0, 0, -5))
        says += vehicle.origin(t + 1) if part > 5 else []
        says += vehicle.ask(t + 2) if part in {3, 8} else []
        says += vehicle.home(t + 3)
        says += vehicle.beats(t, 3, ARMED if part > 2 else 0)
    whole, pieces = read(says), read(says, cuts)
    for name in ("origins", "moves", "homes", "launches", "lost"):
        assert getattr(pieces, name) == getattr(whole, name)
