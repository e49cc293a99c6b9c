"""Rules about whole missions: quiet on good ones, loud on bad ones, one finding for one mistake."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.model import Finding, Rule
from tests.engine.judged import Result, judge, run_of
from tests.missions.transfers import (
    ERROR,
    HOME,
    JUMP,
    LAT,
    LON,
    SEA,
    STATION,
    VEHICLE,
    Fields,
    Transfers,
    waypoints,
)

ROOT = Path(__file__).parents[2] / "rules"
CODES = ("MFC416", "MFC901", "MFC902", "MFC905", "MFC909", "MFC910")
RULES = tuple(
    msgspec.convert(tomllib.loads(next(ROOT.glob(f"*/{code}-*.toml")).read_text("utf-8")), Rule)
    for code in CODES
)
PACK = Pack(RULES, {rule.code: rule.code for rule in RULES})
PLANE, COPTER, PX4 = (3, 1), (3, 2), (12, 2)
VERTEX, CIRCLE = 5001, 5003


def judged(recording: Transfers, cuts: tuple[int, ...] = ()) -> Result:
    return judge(recording.data, cuts, PACK)


def found(recording: Transfers) -> list[Finding]:
    return list(judged(recording)[1])


def flying(vehicle: tuple[int, int] = PX4) -> Transfers:
    """Return a recording in which a vehicle says what it is and where home is."""
    autopilot, kind = vehicle
    return Transfers().say("HEARTBEAT", VEHICLE, type=kind, autopilot=autopilot).home(488)


def placed(*corners: tuple[float, float], **changes: Any) -> list[Fields]:
    """Return items at metres north and east of home, on no coarse grid."""
    return [
        {
            **waypoints(1, **changes)[0],
            "seq": seq,
            "x": LAT + round(north * 89.93),
            "y": LON + round(east * 132.83),
        }
        for seq, (north, east) in enumerate(corners)
    ]


ROUTE = ((10.0, 5.0), (120.0, 31.0), (140.0, 170.0), (-33.0, 95.0), (-12.0, 21.0))


def test_a_good_mission() -> None:
    result = judged(flying().upload(placed(*ROUTE)).download(placed(*ROUTE)))
    assert not result[1]
    for code in ("MFC901", "MFC902", "MFC909", "MFC910"):
        assert run_of(result, code).status == "ran", code
    assert run_of(result, "MFC905").status == "not-applicable"


def test_a_recording_without_missions() -> None:
    result = judged(flying())
    assert {run_of(result, code).status for code in CODES} == {"not-applicable"}


def test_a_long_leg() -> None:
    (finding,) = found(flying().upload(placed(*ROUTE, (250_000.0, 900.0))))
    assert (finding.code, finding.evidence["seq_to"]) == ("MFC901", 5)


def test_an_exchanged_place_is_another_rules_business() -> None:
    route = placed(*ROUTE)
    route[2]["x"], route[2]["y"] = route[2]["y"], route[2]["x"]
    assert not found(flying().upload(route))


@pytest.mark.parametrize(
    ("vehicle", "climb", "steep"),
    [(PLANE, 150.0, True), (PLANE, 80.0, False), (COPTER, 150.0, False), (COPTER, 700.0, True)],
)
def test_a_steep_leg(vehicle: tuple[int, int], climb: float, steep: bool) -> None:
    route = placed((0.0, 0.0), (10.0, 5.0), (120.0, 31.0), (200.0, 60.0), (300.0, 90.0))
    route[3]["z"] = 20.0 + climb
    recording = flying(vehicle).upload(route)
    assert [finding.code for finding in found(recording)] == ["MFC901"] * steep


def test_a_leg_between_frames_is_another_rules_business() -> None:
    route = placed(*ROUTE)
    route[3] |= {"frame": SEA, "z": 900.0}
    assert not found(flying().upload(route))


def test_what_a_vehicle_sends_back_as_it_got_it_is_judged_once() -> None:
    route = placed(*ROUTE, (250_000.0, 900.0))
    (finding,) = found(flying().upload(route).download(route))
    assert finding.subject == "255/190 MISSION_ITEM_INT"
    (held,) = found(flying().download(route))
    assert held.subject == "1/1 MISSION_ITEM_INT"


def test_counted_from_one() -> None:
    route = [{**item, "seq": item["seq"] + 1} for item in placed(*ROUTE)]
    (finding,) = found(flying().upload(route, ERROR))
    assert (finding.code, finding.evidence["item"]) == ("MFC902", 5)


def test_jumps() -> None:
    jump = {"seq": 5, "command": JUMP, "frame": 2, "param2": 3.0}
    assert not found(flying().upload([*placed(*ROUTE), {**jump, "param1": 1.0}]))
    for goal in (5.0, 6.0, -1.0):
        (finding,) = found(flying().upload([*placed(*ROUTE), {**jump, "param1": goal}]))
        assert (finding.code, finding.subject) == ("MFC902", "255/190 MISSION_ITEM_INT.param1")


def test_an_item_that_the_recording_lost_is_no_gap() -> None:
    recording = flying().upload(placed(*ROUTE))
    del recording.frames[5]
    assert not found(recording)


def fence(*corners: tuple[float, float], said: int | None = None) -> list[Fields]:
    number = float(len(corners) if said is None else said)
    return placed(*corners, command=VERTEX, frame=SEA, param1=number, z=0.0)


SQUARE = ((0.0, 3.0), (200.0, 9.0), (210.0, 190.0), (5.0, 180.0))


@pytest.mark.parametrize(
    ("items", "what"),
    [
        (fence(*SQUARE), ""),
        (fence(*SQUARE, said=5), "count"),
        (fence(*SQUARE, said=3), "count"),
        (fence(*SQUARE[:2]), "corners"),
        (fence(SQUARE[1], SQUARE[0], *SQUARE[2:]), "crosses"),
        (fence((0.0, 3.0), (50.0, 3.0), (100.0, 3.0)), "flat"),
        (placed((0.0, 3.0), command=CIRCLE, frame=SEA, param1=40.0), ""),
        (placed((0.0, 3.0), command=CIRCLE, frame=SEA, param1=0.0), "radius"),
        (placed((0.0, 3.0), command=CIRCLE, frame=SEA, param1=float("nan")), "radius"),
    ],
)
def test_fences(items: list[Fields], what: str) -> None:
    findings = found(flying().upload(items, kind=1))
    assert [f.evidence["what"] for f in findings if f.code == "MFC905"] == [what] * bool(what)


def test_a_fence_with_many_corners_is_bounded() -> None:
    corners = [(float(k % 50), float(k * 7 % 1999)) for k in range(2500)]
    assert "MFC905" not in {
        finding.code for finding in found(flying().upload(fence(*corners), kind=1))
    }


def test_rounded_coordinates() -> None:
    route = placed(*((north * 40, east * 40) for north, east in ROUTE))
    for item in route:
        item["x"], item["y"] = item["x"] // 10_000 * 10_000, item["y"] // 10_000 * 10_000
    (finding,) = found(flying().upload(route))
    assert (finding.code, finding.evidence["decimals"]) == ("MFC909", 3)
    route[4]["x"] += 1
    assert not found(flying().upload(route))


def test_a_readback_that_differs() -> None:
    route, other = placed(*ROUTE), placed(*ROUTE)
    other[2]["z"] = 60.0
    (finding,) = found(flying().upload(route).download(other))
    assert (finding.code, finding.evidence["item"]) == ("MFC910", 2)
    assert finding.evidence["lifted_m"] == "40.0"


def test_home_and_other_levels_in_a_readback() -> None:
    """ArduPilot overwrites item 0; a frame of another level is another height."""
    route, other = placed(*ROUTE), placed(*ROUTE)
    other[0] |= {"x": LAT + 50_000, "z": 488.0, "frame": SEA}
    assert not found(flying(COPTER).upload(route).download(other))
    other[3]["frame"] = SEA
    assert [f.code for f in found(flying(COPTER).upload(route).download(other))] == ["MFC910"]


def test_a_readback_after_another_change_is_not_compared() -> None:
    to = {"target_system": 1, "target_component": 1}
    recording = flying().upload(placed(*ROUTE)).say("MISSION_CLEAR_ALL", STATION, **to)
    recording.acknowledge().download([])
    assert not found(recording)


def exchanged(items: list[Fields]) -> list[Fields]:
    """Return items with north and east of home exchanged."""
    swapped = [((i["y"] - LON) / 132.83, (i["x"] - LAT) / 89.93) for i in items]
    return placed(*swapped)


def targets(recording: Transfers, items: list[Fields]) -> Transfers:
    for item in items:
        at = {"lat_int": item["x"], "lon_int": item["y"], "alt": 20.0, "target_system": 1}
        mask = {"type_mask": 0x0DF8, "coordinate_frame": HOME}
        recording.say("SET_POSITION_TARGET_GLOBAL_INT", (1, 191), **at, **mask)
    return recording


def reached(recording: Transfers, items: list[Fields]) -> Transfers:
    for item in items:
        at = {"lat": item["x"], "lon": item["y"], "alt": 508_000, "relative_alt": 20_000}
        recording.say("GLOBAL_POSITION_INT", VEHICLE, **at)
        recording.say("MISSION_ITEM_REACHED", VEHICLE, seq=item["seq"])
    return recording


@pytest.mark.parametrize("follow", [targets, reached])
def test_tracks_beside_the_mission(follow: Any) -> None:
    route = placed(*ROUTE)
    assert not found(follow(flying().upload(route), route))
    (finding,) = found(follow(flying().upload(route), exchanged(route)))
    assert (finding.code, finding.evidence["says"]) == ("MFC416", "with north and east exchanged")


def test_tracks_that_fit_nothing() -> None:
    """Another route, a mission flown in part, and one on a line say nothing."""
    route = placed(*ROUTE)
    other = placed((40.0, -80.0), (-60.0, -33.0), (-90.0, 120.0), (15.0, 66.0), (8.0, -9.0))
    assert not found(targets(flying().upload(route), other))
    assert not found(targets(flying().upload(route), exchanged(route)[:2]))
    line = placed(*((0.0, east) for east in (10.0, 50.0, 90.0, 130.0)))
    assert not found(targets(flying().upload(line), exchanged(line)))


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(cuts=st.lists(st.integers(0, 3000), min_size=1, max_size=8).map(tuple))
def test_cuts(cuts: tuple[int, ...]) -> None:
    route = placed(*ROUTE, (250_000.0, 900.0))
    recording = reached(flying().upload(route).download(placed(*ROUTE)), exchanged(route))
    recording = targets(recording.upload(fence(*SQUARE, said=3), kind=1), exchanged(route))
    assert judged(recording, cuts) == judged(recording)
