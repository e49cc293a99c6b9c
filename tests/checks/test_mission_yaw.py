"""Missions with yaw 0 in every item."""

from __future__ import annotations

import tomllib
from math import nan
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.model import Rule
from tests.engine.judged import Result, judge, run_of
from tests.strategies import START_US, frame

FILE = next((Path(__file__).parents[2] / "rules").glob("*/MFC602-*.toml"))
RULE = msgspec.convert(tomllib.loads(FILE.read_text("utf-8")), Rule)
PACK = Pack((RULE,), {RULE.code: str(FILE)})
VEHICLE, STATION = (1, 1), (255, 190)
PX4, ARDUPILOT = 12, 3
QUADROTOR, FIXED_WING = 2, 1
WAYPOINT, TAKEOFF, RETURN = 16, 22, 20
LAT, LON = 473_977_420, 85_455_940

Item = tuple[int, float, int, int]
"""Command, param4, x, y."""

SQUARE: tuple[Item, ...] = (
    (TAKEOFF, 0.0, LAT, LON),
    (WAYPOINT, 0.0, LAT, LON + 20_000),
    (WAYPOINT, 0.0, LAT - 20_000, LON + 20_000),
    (RETURN, 0.0, 0, 0),
)


class Recording:
    """A recording that grows, a tenth of a second per message."""

    def __init__(self) -> None:
        self.data, self._t_us = b"", START_US

    def say(self, name: str, sender: tuple[int, int], **fields: Any) -> Recording:
        self._t_us += 100_000
        self.data += self._t_us.to_bytes(8, "big") + frame(name, fields, sender)
        return self

    def alive(self, autopilot: int = PX4, kind: int = QUADROTOR) -> Recording:
        return self.say("HEARTBEAT", VEHICLE, type=kind, autopilot=autopilot)

    def upload(
        self, items: tuple[Item, ...], sender: tuple[int, int] = STATION, to: int = 1
    ) -> Recording:
        aimed = {"target_system": to, "target_component": 1}
        self.say("MISSION_COUNT", sender, count=len(items), **aimed)
        for seq, (command, yaw, x, y) in enumerate(items):
            at = {"x": x, "y": y, "z": 15.0, "frame": 2 if command == RETURN else 3}
            self.say(
                "MISSION_ITEM_INT", sender, seq=seq, command=command, param4=yaw, **at, **aimed
            )
        return self


def found(recording: Recording, cuts: tuple[int, ...] = ()) -> Result:
    """Judge a recording with the rule alone."""
    return judge(recording.data, cuts, PACK)


def test_zero_everywhere() -> None:
    """A mission that turns the vehicle north at each item."""
    _, (finding,) = found(Recording().alive().upload(SQUARE))
    assert (finding.severity, finding.count, finding.field) == ("warning", 3, "param4")


@pytest.mark.parametrize(
    "yaws", [(nan, nan, nan), (0.0, 90.0, 0.0), (nan, 0.0, 0.0), (0.0, 0.0, 360.0)]
)
def test_headings_that_were_set(yaws: tuple[float, ...]) -> None:
    """One item with another heading, or none, shows that somebody thought of it."""
    items = tuple((c, yaw, x, y) for (c, _, x, y), yaw in zip(SQUARE, (*yaws, 0.0), strict=True))
    assert not found(Recording().alive().upload(items))[1]


def test_northward() -> None:
    """A mission that leads north, or nowhere."""
    north = tuple((c, 0.0, LAT + 20_000 * k, LON) for k, (c, *_) in enumerate(SQUARE[:3]))
    still = tuple((c, 0.0, LAT, LON) for c, *_ in SQUARE[:3])
    assert not found(Recording().alive().upload(north).upload(still))[1]


@pytest.mark.parametrize(("autopilot", "kind"), [(ARDUPILOT, QUADROTOR), (PX4, FIXED_WING)])
def test_who_does_not_turn(autopilot: int, kind: int) -> None:
    """ArduPilot does not read it, an aeroplane cannot do it."""
    assert not found(Recording().alive(autopilot, kind).upload(SQUARE))[1]


def test_too_few_items() -> None:
    """Two items may be meant so."""
    assert not found(Recording().alive().upload(SQUARE[:2]))[1]


def test_unknown_vehicle() -> None:
    """Without a heartbeat nothing can be said."""
    result = found(Recording().upload(SQUARE))
    assert not result[1]
    assert run_of(result, RULE.code).status == "insufficient-data"


def test_late_heartbeat() -> None:
    """The vehicle may say what it is after the upload."""
    assert len(found(Recording().upload(SQUARE).alive())[1]) == 1


def test_same_mission_twice() -> None:
    """A mission that is sent again, and read back, is one mission."""
    again = Recording().alive().upload(SQUARE).upload(SQUARE).upload(SQUARE, VEHICLE, 255)
    assert len(found(again)[1]) == 1


@settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, 900), min_size=1, max_size=8).map(tuple))
def test_cuts(cuts: tuple[int, ...]) -> None:
    """Findings do not depend on batches."""
    recording = Recording().upload(SQUARE).alive().upload(SQUARE[:2])
    assert found(recording, cuts) == found(recording)
