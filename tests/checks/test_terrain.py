"""Legs beside the ground (MFC911), over ground that is a formula."""

from __future__ import annotations

import json
from collections.abc import Callable
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
import pytest

from mavframecheck.engine import Settings
from mavframecheck.engine.check import check_mission, check_recording
from mavframecheck.geo.terrain import Ground, Level
from mavframecheck.model import Finding, MissionLocation, RuleRun
from mavframecheck.sources import Recording
from tests.checks.rule_bench import pack_of_files
from tests.missions.made import DIALECT, item, plan
from tests.missions.transfers import Fields, Transfers, waypoints

PACK = pack_of_files("MFC911")
LAT, LON = 47.397742, 8.545594
SEA, HOME, MISSION, TERRAIN = 0, 3, 2, 10
WAYPOINT, SPLINE, TAKEOFF, LAND, RTL, LOITER, ROI = 16, 82, 22, 21, 20, 19, 195
NORTH = 1 / 111_186.0
"""Degrees of a metre to the north, here."""

Floats = np.typing.NDArray[np.float64]


class Hill(NamedTuple):
    """Ground whose height is a formula of metres to the north of home."""

    shape: Callable[[Floats], Floats]
    step_m: float = 10.0

    def heights(self, lat: Floats, lon: Floats) -> Floats:
        height: Floats = self.shape((lat - LAT) / NORTH) + 0 * lon
        return height


def ridge(north: Floats) -> Floats:
    """Return 488 m, and a ridge of 200 m, 400 m wide, a kilometre north of home."""
    return 488 + 200 * np.maximum(0, 1 - np.abs(north - 1000) / 200)


def step(north: float, alt: float, command: int = WAYPOINT, frame: int = HOME) -> dict[str, Any]:
    """Return an item so many metres north of home."""
    return item(command, frame, lat=LAT + north * NORTH, lon=LON, alt=alt)


def judged(
    *items: dict[str, Any], ground: Ground | None = None, **mission: Any
) -> tuple[list[Finding], RuleRun]:
    """Return what is found of a plan over some ground, flat and 488 m high if none is given."""
    text = json.dumps(plan(*items, **mission), indent=1).encode()
    file = Recording("m.plan", BytesIO(text), None)
    over = Level(488.0) if ground is None else ground
    report, findings = check_mission(file, PACK, Settings(), DIALECT, over)
    return list(findings), report.runs[0]


def quiet(*items: dict[str, Any], **more: Any) -> bool:
    findings, run = judged(*items, **more)
    assert run.status == "ran", run
    return not findings


def test_a_flight_from_take_off_to_landing() -> None:
    route = (step(0, 5, TAKEOFF), step(300, 40), step(600, 60), step(0, 0, LAND))
    findings, run = judged(*route)
    assert not findings
    assert (run.status, run.checked, run.reason) == ("ran", 3, "")


def test_without_a_terrain_model() -> None:
    text = json.dumps(plan(step(0, -100), step(300, -100))).encode()
    report, findings = check_mission(
        Recording("m.plan", BytesIO(text), None), PACK, Settings(), DIALECT
    )
    assert not findings
    (run,) = report.runs
    assert run.status == "not-applicable"
    assert run.reason == "no terrain model was given (--dem FILE)"


def test_a_ridge_between_two_items() -> None:
    """Both items are 100 m above their ground, and the ridge between them is 200 m high."""
    (finding,), run = judged(
        step(0, 30, TAKEOFF), step(500, 100), step(1600, 100), ground=Hill(ridge)
    )
    assert (finding.code, finding.severity.value, run.checked) == ("MFC911", "warning", 2)
    said = finding.evidence
    assert (said["seq_from"], said["seq_to"], said["listed"]) == (1, 2, "1-2")
    assert said["above_m"] == pytest.approx(-100, abs=5.0)
    assert said["ground_m"] == pytest.approx(688, abs=5.0)
    assert said["lat"] == pytest.approx(LAT + 1000 * NORTH, abs=5 * NORTH)
    assert said["reading"] == ""
    where = finding.location
    assert isinstance(where, MissionLocation)
    assert (where.item, where.command) == (2, "NAV_WAYPOINT")
    assert "from item 1 to item 2 goes 100 m below the ground (688 m" in finding.text


def test_the_place_is_that_of_the_height(
    tmp_path: Any,
) -> None:
    """Line and column of the altitude of the item that the worst leg leads to."""
    (finding,), _ = judged(step(500, 100), step(1600, 100), ground=Hill(ridge))
    where = finding.location
    assert isinstance(where, MissionLocation)
    lines = json.dumps(plan(step(500, 100), step(1600, 100)), indent=1).splitlines()
    assert where.line is not None
    assert where.column is not None
    assert lines[where.line - 1][where.column - 1 :] == "100"


def test_low_above_the_ground_is_information() -> None:
    (finding,), _ = judged(step(500, 210), step(1600, 210), ground=Hill(ridge))
    assert finding.severity.value == "info"
    assert finding.evidence["above_m"] == pytest.approx(10, abs=5.0)
    assert quiet(step(500, 230), step(1600, 230), ground=Hill(ridge))


def test_less_deep_than_models_are_wrong() -> None:
    (finding,), _ = judged(step(500, -4), step(900, -4))
    assert finding.severity.value == "info"
    assert "less than models are wrong" in finding.text


def test_one_finding_for_all_legs_of_a_kind() -> None:
    """The deepest in front, the others counted."""
    route = [step(500 + 1100 * (k % 2), 100 - k) for k in range(7)]
    (finding,), _ = judged(*route, ground=Hill(ridge))
    assert finding.count == 6
    assert (finding.evidence["seq_to"], finding.evidence["legs"]) == (6, 6)
    assert "so do 5 more legs" in finding.text


@pytest.mark.parametrize("command", [TAKEOFF, 84])
def test_low_by_right_after_a_take_off(command: int) -> None:
    assert quiet(step(0, 2, command), step(200, 40))
    (finding,), _ = judged(step(0, 2, command), step(400, 2))
    assert finding.evidence["seq_to"] == 1


@pytest.mark.parametrize("command", [LAND, 85])
@pytest.mark.parametrize("said", [0, -30, 500])
def test_low_by_right_before_a_landing(command: int, said: float) -> None:
    """The height of a landing is not read, and the way there may be level until the end."""
    assert quiet(step(500, 40), step(0, said, command))
    (finding,), _ = judged(step(1600, 100), step(200, 0, command), ground=Hill(ridge))
    assert finding.evidence["above_m"] == pytest.approx(-100, abs=5.0)


def test_where_the_way_is_not_known_nothing_is_said() -> None:
    """Splines, what follows a return, a landing or a take-off wherever that is, and regions of interest."""
    for between in (
        step(800, 100, SPLINE),
        item(RTL, MISSION, lat=0.0, lon=0.0, alt=0.0),
        item(TAKEOFF, HOME, lat=0.0, lon=0.0, alt=50.0),
        item(LAND, HOME, lat=0.0, lon=0.0, alt=0.0),
    ):
        assert quiet(step(500, 100), between, step(1600, 100), ground=Hill(ridge))
    assert quiet(step(500, 250), step(1000, -100, ROI), step(1600, 250), ground=Hill(ridge))


def test_circles_are_climbed_in() -> None:
    """A fixed wing may fly to a loiter at the height that it has, and sink there."""
    assert quiet(step(500, 230), step(1600, 50, LOITER), ground=Hill(ridge))


def test_heights_above_the_sea_meant_above_home() -> None:
    (finding,), _ = judged(step(500, 80, frame=SEA), step(900, 90, frame=SEA))
    said = finding.evidence
    assert said["above_m"] == pytest.approx(80 - 488)
    assert (said["reading"], said["reference"]) == ("above home", "above the sea")
    assert said["other_m"] == pytest.approx(80.0)
    assert "Read as above home it would be 80 m above the ground." in finding.text


def test_another_reading_must_explain_all_legs() -> None:
    """Above home the second leg would be in the ridge."""
    route = (step(0, 80, frame=SEA), step(500, 80, frame=SEA), step(1600, 80, frame=SEA))
    (finding,), _ = judged(*route, ground=Hill(ridge))
    assert finding.evidence["reading"] == ""


def test_heights_above_home_meant_above_the_sea() -> None:
    """Only below the sea does this lead into the ground."""
    low = Level(-300.0)
    route = (step(500, -250), step(900, -250))
    (finding,), _ = judged(*route, ground=low, plannedHomePosition=[LAT, LON, -300.0])
    assert finding.evidence["reading"] == "above the sea"
    assert finding.evidence["other_m"] == pytest.approx(50.0)


def test_both_references_in_one_leg() -> None:
    assert quiet(step(500, 600, frame=SEA), step(1600, 250), ground=Hill(lambda n: 488 + 0 * n))
    (finding,), _ = judged(step(500, 588, frame=SEA), step(1600, 100), ground=Hill(ridge))
    assert finding.evidence["above_m"] == pytest.approx(-100, abs=5.0)


def test_above_terrain_items_are_judged_alone() -> None:
    """The vehicle follows the terrain between them, which needs no model here."""
    assert quiet(
        step(500, 50, frame=TERRAIN), step(1000, 50, frame=11), step(1600, 50), ground=Hill(ridge)
    )
    (finding,), _ = judged(step(500, 50, frame=TERRAIN), step(1600, 3, frame=TERRAIN))
    assert (finding.evidence["seq_from"], finding.evidence["seq_to"]) == (1, 1)
    assert "Item 1 is no more than 3 m above the ground" in finding.text


@pytest.mark.parametrize("told", [0.0, None])
def test_home_without_a_height_lies_on_the_ground(told: float | None) -> None:
    """What nobody filled in: the terrain model says it, and the finding says so."""
    home = [LAT, LON, told]
    assert quiet(step(500, 100), step(700, 100), plannedHomePosition=home)
    (finding,), _ = judged(
        step(500, 100), step(1600, 100), ground=Hill(ridge), plannedHomePosition=home
    )
    assert finding.evidence["home"] == "by the terrain model"


def test_home_at_the_sea_has_the_height_zero() -> None:
    (finding,), _ = judged(
        step(500, 5), step(700, 5), ground=Level(3.0), plannedHomePosition=[LAT, LON, 0.0]
    )
    assert finding.evidence["home"] == "as said"
    assert finding.evidence["above_m"] == pytest.approx(2.0)


def test_home_far_from_its_ground_says_nothing() -> None:
    """Then heights above home are not compared; those above the sea still are."""
    findings, run = judged(step(500, 10), step(700, 10), ground=Level(900.0))
    assert not findings
    assert run.status == "insufficient-data"
    assert "home is said to be 488 m above the sea, and the ground there is at 900 m" in run.reason
    route = (step(500, 10), step(700, 10), step(900, 600, frame=SEA), step(990, 600, frame=SEA))
    (finding,), run = judged(*route, ground=Level(900.0))
    assert finding.evidence["seq_to"] == 3
    assert run.status == "ran"
    assert "home" in run.reason


def test_no_home_at_all() -> None:
    findings, run = judged(step(500, 10), step(700, 10), plannedHomePosition=None)
    assert not findings
    assert run.status == "insufficient-data"
    assert run.reason == "neither the mission nor the terrain model says how high home is"
    assert quiet(step(0, 600, frame=SEA), step(500, 600, frame=SEA), plannedHomePosition=None)


def test_outside_of_the_model() -> None:
    """Nothing is said; part of the way: what is known is judged, and how much that is, said."""
    findings, run = judged(step(500, 10), step(700, 10), ground=Hill(lambda n: n * np.nan))
    assert not findings
    assert run.status == "insufficient-data"

    sea = (step(0, 600, frame=SEA), step(2000, 600, frame=SEA))
    findings, run = judged(*sea, ground=Hill(lambda n: n * np.nan))
    assert not findings
    assert run.status == "insufficient-data"
    assert run.reason == "the terrain model covers 0 % of the mission (2.0 km)"

    half = Hill(lambda n: np.where(n < 1000.5, 620.0, np.nan))
    (finding,), run = judged(*sea, ground=half)
    assert finding.evidence["above_m"] == pytest.approx(-20)
    assert run.status == "ran"
    assert run.reason == "the terrain model covers 50 % of the mission (2.0 km)"


@pytest.mark.parametrize("vehicle", [10, 11, 12])
def test_what_does_not_fly(vehicle: int) -> None:
    findings, run = judged(step(500, -50), step(700, -50), vehicleType=vehicle)
    assert not findings
    assert run.status == "not-applicable"


def test_across_180_degrees() -> None:
    """A leg of 20 km, not one around the Earth."""
    route = [item(16, SEA, lat=0.0 + 1e-5, lon=lon, alt=100.0) for lon in (179.9, -179.9, 179.95)]
    home = [1e-5, 179.9, 0.0]

    class Strait(NamedTuple):
        step_m: float = 100.0

        def heights(self, lat: Floats, lon: Floats) -> Floats:
            near = np.abs(np.mod(lon, 360) - 180) < 0.2
            return np.where(near, 0.0, 5000.0) + 0 * lat

    assert quiet(*route, ground=Strait(), plannedHomePosition=home)


def test_samples_are_bounded() -> None:
    """Whatever the model resolves and the mission covers."""
    asked: list[int] = []

    class Fine(NamedTuple):
        step_m: float = 0.01

        def heights(self, lat: Floats, lon: Floats) -> Floats:
            asked.append(len(lat))
            return np.zeros(len(lat)) + 0 * lon

    route = [step(90_000.0 * (k % 2), 600, frame=SEA) for k in range(300)]
    judged(*route, ground=Fine())
    assert max(asked) < 210_000


def recorded(items: list[Fields], home_m: float = 488.0) -> Transfers:
    return Transfers().alive().home(home_m).upload(items)


def test_in_a_recording() -> None:
    """An upload, with home as the vehicle says it."""

    def found(items: list[Fields], ground: Ground) -> tuple[list[Finding], RuleRun]:
        file = Recording("a.tlog", BytesIO(recorded(items).data), None)
        report, findings = check_recording(file, PACK, Settings(), DIALECT, ground=ground)
        return list(findings), report.runs[0]

    findings, run = found(waypoints(5, z=100.0), Level(488.0))
    assert not findings
    assert (run.status, run.checked) == ("ran", 4)
    (finding,), _ = found(waypoints(5, z=100.0), Hill(lambda n: 488 + n / 2))
    assert finding.evidence["seq_to"] == 4
    assert finding.message_name == "MISSION_ITEM_INT"


def test_home_that_moved_level() -> None:
    """It was on the ridge first: its height is compared with the ground where it lies now."""
    moved = Transfers().alive().home(488.0, north_deg=1000 * NORTH).home(488.0)
    file = Recording("a.tlog", BytesIO(moved.upload(waypoints(5, z=100.0)).data), None)
    report, findings = check_recording(file, PACK, Settings(), DIALECT, ground=Hill(ridge))
    assert not findings
    assert (report.runs[0].status, report.runs[0].checked) == ("ran", 4)
