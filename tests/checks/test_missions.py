"""Missions that mix heights above home and above the sea."""

from __future__ import annotations

import tomllib
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

FILE = next((Path(__file__).parents[2] / "rules").glob("*/MFC203-*.toml"))
RULE = msgspec.convert(tomllib.loads(FILE.read_text("utf-8")), Rule)
PACK = Pack((RULE,), {RULE.code: str(FILE)})
VEHICLE, STATION = (1, 1), (255, 190)
WAYPOINT, TAKEOFF, LAND, CHANGE_SPEED = 16, 22, 21, 178
SEA, HOME, TERRAIN = 0, 3, 10
LAT, LON = 473_977_420, 85_455_940

Item = tuple[int, int, float]
"""Command, MAV_FRAME, z."""


class Recording:
    """A recording that grows, a tenth of a second per message."""

    def __init__(self) -> None:
        self.data, self._t_us = b"", START_US

    def say(self, name: str, sender: tuple[int, int], **fields: Any) -> Recording:
        self._t_us += 100_000
        self.data += self._t_us.to_bytes(8, "big") + frame(name, fields, sender)
        return self

    def alive(self, autopilot: int = 12) -> Recording:
        return self.say("HEARTBEAT", VEHICLE, type=2, autopilot=autopilot)

    def home(self, height_m: float) -> Recording:
        at = {"latitude": LAT, "longitude": LON, "altitude": round(height_m * 1e3)}
        return self.say("HOME_POSITION", VEHICLE, q=[1.0, 0, 0, 0], **at)

    def upload(self, *items: Item, step: int = 10_000) -> Recording:
        to = {"target_system": 1, "target_component": 1}
        self.say("MISSION_COUNT", STATION, count=len(items), **to)
        for seq, (command, mav_frame, z) in enumerate(items):
            at = {"x": LAT + step * seq, "y": LON, "z": z, "frame": mav_frame}
            self.say("MISSION_ITEM_INT", STATION, seq=seq, command=command, **at, **to)
        back = {"target_system": 255, "target_component": 190, "type": 0}
        return self.say("MISSION_ACK", VEHICLE, **back)


def found(recording: Recording, cuts: tuple[int, ...] = ()) -> Result:
    """Judge a recording with the rule alone."""
    return judge(recording.data, cuts, PACK)


MIXED: tuple[Item, ...] = ((WAYPOINT, HOME, 30.0), (WAYPOINT, SEA, 35.0), (WAYPOINT, HOME, 40.0))
FITTING: tuple[Item, ...] = (
    (WAYPOINT, HOME, 30.0),
    (WAYPOINT, SEA, 523.0),
    (WAYPOINT, HOME, 40.0),
)


def test_alike_numbers_in_different_frames() -> None:
    """30 m above home, then 35 m above a sea that is 488 m lower."""
    _, (finding,) = found(Recording().alive().home(488).upload(*MIXED))
    assert finding.count == 2
    assert "item 1 (35.0 m above the sea) to item 2 (40.0 m above home)" in finding.text
    assert finding.evidence["climb_m"] == "493.0"
    assert finding.message_name == "MISSION_ITEM_INT"


@pytest.mark.parametrize(
    "items",
    [
        FITTING,
        tuple((WAYPOINT, SEA, z) for z in (520.0, 35.0, 530.0)),
        tuple((WAYPOINT, HOME, z) for z in (20.0, 504.0, 30.0)),
        ((WAYPOINT, TERRAIN, 30.0), (WAYPOINT, SEA, 523.0)),
        ((WAYPOINT, HOME, 30.0), (LAND, SEA, 0.0)),
        ((WAYPOINT, HOME, 30.0), (CHANGE_SPEED, SEA, 35.0), (WAYPOINT, HOME, 30.0)),
        ((WAYPOINT, HOME, 30.0), (WAYPOINT, SEA, 700.0)),
    ],
    ids=["fits", "all sea", "all home", "terrain", "land", "no place", "high on purpose"],
)
def test_plausible_missions(items: tuple[Item, ...]) -> None:
    """Mixing frames is legal; steep legs without a mix are another rule's business."""
    _, findings = found(Recording().alive().home(488).upload(*items))
    assert not findings


def test_gentle_slope() -> None:
    """A descent of 200 m over 11 km may be meant."""
    _, findings = found(Recording().alive().home(200).upload(*MIXED, step=1_000_000))
    assert not findings


def test_home_near_the_sea() -> None:
    """Where home is at 20 m nothing can be told apart."""
    _, findings = found(Recording().alive().home(20).upload(*MIXED))
    assert not findings


def test_item_zero_is_home_on_ardupilot() -> None:
    """Item 0 above the sea is no leg there, and says how high home is when nothing else does."""
    items = ((WAYPOINT, SEA, 584.0), (TAKEOFF, HOME, 20.0), (WAYPOINT, HOME, 30.0))
    _, findings = found(Recording().alive(autopilot=3).upload(*items))
    assert not findings
    _, findings = found(Recording().alive(autopilot=3).upload(*items, (WAYPOINT, SEA, 35.0)))
    assert len(findings) == 1


def test_home_unknown() -> None:
    """Silence would read as a pass."""
    result = found(Recording().alive().upload(*MIXED))
    assert not result[1]
    assert run_of(result, "MFC203").status == "insufficient-data"


def test_no_mission() -> None:
    """Nothing to judge."""
    assert run_of(found(Recording().alive().home(488)), "MFC203").status == "not-applicable"


def test_home_from_position_and_later() -> None:
    """Without HOME_POSITION height and relative height tell it, even after the mission."""
    recording = Recording().alive().upload(*MIXED)
    at = {"lat": LAT, "lon": LON, "alt": 500_000, "relative_alt": 12_000}
    _, findings = found(recording.say("GLOBAL_POSITION_INT", VEHICLE, **at))
    assert len(findings) == 1


def test_same_mission_twice() -> None:
    """A mission that is sent again is one mission."""
    _, findings = found(Recording().alive().home(488).upload(*MIXED).upload(*MIXED))
    assert len(findings) == 1


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    cuts=st.lists(st.integers(0, 3000), min_size=1, max_size=12).map(tuple),
    homes=st.lists(st.sampled_from([20.0, 22.0, 26.0, 300.0, 488.0]), max_size=6),
)
def test_cuts(cuts: tuple[int, ...], homes: list[float]) -> None:
    """Findings do not depend on batches."""
    recording = Recording().alive()
    for height in homes:
        recording.home(height)
    recording.upload(*MIXED).home(488).upload(*FITTING).home(20).upload(*FITTING)
    assert found(recording, cuts) == found(recording)
