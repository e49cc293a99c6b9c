"""Mission files become items: the numbers, their places, and errors that name them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from mavframecheck.missions import read_mission
from mavframecheck.missions.planned import FENCE, MISSION, RALLY, Planned
from mavframecheck.missions.text import MissionError
from mavframecheck.sources import MISSIONS, Kind, open_recording
from tests.missions.made import HOME, item, plan, written

WPL = """QGC WPL 110
# made by hand
0\t1\t0\t16\t0\t0\t0\t0\t-35.363262\t149.165237\t584.0\t1

1  0  3  22  15.0  0  0  nan  -35.3632  149.16520  20.0  1
2\t0\t10\t16\t0\t0\t0\t0\t-35.361\t149.16\t30\t1
"""


def read(folder: Path, content: Any, name: str = "m.plan") -> Planned:
    with open_recording(written(folder, content, name), kinds=MISSIONS) as file:
        return read_mission(file)


def text_at(planned: Planned, place: int) -> str:
    return planned.text.number(place)


def test_simple_items_keep_every_number_and_its_place(tmp_path: Path) -> None:
    made = plan(
        item(22, params=[15, 0, 0, None], lat=47.39774190, lon=-8.5e0, alt=12.5, doJumpId=1),
        item(178, 2, params=[0, 5.5, -1, 0], lat=0, lon=0, alt=0, AltitudeMode=1, Altitude=50),
        globalPlanAltitudeMode=1,
    )
    planned = read(tmp_path, json.dumps(made, indent=4).replace("47.3977419", "47.39774190"))
    first, second = planned.items

    assert (planned.kind, planned.autopilot, planned.vehicle_type) == ("plan", 12, 2)
    assert planned.home is not None
    assert list(planned.home[:3]) == HOME
    assert (first.command, first.frame, first.x, first.y, first.z) == (
        22,
        3,
        47.3977419,
        -8.5,
        12.5,
    )
    assert first.params[0] == 15
    assert math.isnan(first.params[3])
    assert (first.said.x_decimals, first.said.y_decimals, first.said.number) == (8, 1, 1)
    assert (second.said.altitude_mode, second.said.altitude) == (1, 50)
    assert second.said.plan_altitude_mode == 1
    assert math.isnan(second.said.terrain_altitude)
    assert text_at(planned, first.places.x) == "47.39774190"
    assert text_at(planned, first.places.command) == "22"
    assert text_at(planned, second.places.frame) == "2"
    assert text_at(planned, second.places.param2) == "5.5"
    assert planned.text.content[first.places.item] == "{"


def test_older_items_keep_their_place_in_coordinate(tmp_path: Path) -> None:
    old = item()
    old["coordinate"], old["params"] = old["params"][4:], old["params"][:4]
    older = item()
    del older["params"]
    older |= {"coordinate": [47.3978, 8.5457, 30.0], **{f"param{k}": k for k in (1, 2, 3, 4)}}
    one, other = read(tmp_path, plan(old, older)).items

    assert (one.x, one.y, one.z) == (other.x, other.y, other.z) == (47.3978, 8.5457, 30.0)
    assert other.params == (1, 2, 3, 4)


def test_complex_items_are_judged_by_what_they_hold(tmp_path: Path) -> None:
    survey = {
        "type": "ComplexItem",
        "complexItemType": "survey",
        "TransectStyleComplexItem": {"Items": [item(), item(206, 2)]},
    }
    scan = {"type": "ComplexItem", "complexItemType": "StructureScan", "polygon": []}
    planned = read(tmp_path, plan(item(22), survey, scan, item(21)))

    assert [each.command for each in planned.items] == [22, 16, 206, 21]
    assert [each.said.complex_item for each in planned.items[1:3]] == [1, 1]
    assert math.isnan(planned.items[3].said.complex_item)
    assert "StructureScan in line " in planned.notes[0]
    assert "not judged" in planned.notes[0]


def test_fence_and_rally_points_become_what_is_sent(tmp_path: Path) -> None:
    corners = [[47.3, 8.5], [47.4, 8.5], [47.4, 8.6]]
    made = plan(item()) | {
        "geoFence": {
            "breachReturn": [47.35, 8.55, 40],
            "circles": [{"circle": {"center": [47.3, 8.5], "radius": 99.5}, "inclusion": False}],
            "polygons": [{"inclusion": True, "polygon": corners, "version": 1}],
            "version": 2,
        },
        "rallyPoints": {"points": [[47.31, 8.51, 25]], "version": 2},
    }
    planned = read(tmp_path, made)
    fence = [each for each in planned.items if each.mission_type == FENCE]
    (rally,) = [each for each in planned.items if each.mission_type == RALLY]

    assert [each.command for each in fence] == [5000, 5001, 5001, 5001, 5004]
    assert [(each.x, each.y) for each in fence[1:4]] == [tuple(corner) for corner in corners]
    assert [each.params[0] for each in fence[1:]] == [3, 3, 3, 99.5]
    assert (fence[0].frame, fence[0].z) == (3, 40)
    assert text_at(planned, fence[4].places.param1) == "99.5"
    assert (rally.command, rally.frame, rally.z) == (5100, 3, 25)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "only version 1 of plans"),
        ({"mission": []}, '"mission" must be an object'),
        ({"mission": {}}, None),
        ({"mission": {"items": {}}}, '"items" must be an array'),
        ({"mission": {"items": [1]}}, "a mission item must be an object"),
        ({"mission": {"items": [{}]}}, 'must have "params"'),
        ({"mission": {"items": [item() | {"params": [1, 2, 3]}]}}, "must hold 7 values, not 3"),
        ({"mission": {"items": [item(lat="47")]}}, "value 5 must be a number or null"),
        ({"mission": {"items": [item(lat=True)]}}, "value 5 must be a number or null"),
        ({"mission": {"items": [item() | {"frame": 3.5}]}}, '"frame" must be a whole number from 0 to 255'),
        ({"mission": {"items": [item(command=-1)]}}, '"command" must be a whole number'),
        ({"mission": {"items": [item(command=10**30)]}}, '"command" must be a whole number'),
        ({"mission": {"items": [], "plannedHomePosition": [1]}}, "must hold 2 or 3 values"),
        ({"geoFence": {"polygons": [{"polygon": [[1]]}]}}, "this must hold 2 or 3 values"),
        ({"geoFence": {"circles": [{"circle": {"center": [1, 2]}}]}}, 'must have "radius"'),
        ({"fileType": "GeoFence"}, 'its fileType is "GeoFence": only whole plans'),
    ],
)  # fmt: skip
def test_a_plan_that_is_none_says_why(tmp_path: Path, change: Any, words: str | None) -> None:
    made = plan(item()) | change
    if words is None:
        assert read(tmp_path, made).items == []
        return
    with pytest.raises(MissionError) as error:
        read(tmp_path, made)
    assert words in str(error.value)


def test_a_type_error_names_line_and_column(tmp_path: Path) -> None:
    content = '{"fileType": "Plan", "version": 1,\n "mission": {"items":\n  [{"params": "no"}]}}'
    with pytest.raises(
        MissionError, match=r'm\.plan, line 3, column 15: "params" must be an array'
    ):
        read(tmp_path, content)


def test_waypoint_files_are_read_as_loosely_as_they_are_written(tmp_path: Path) -> None:
    for content in (WPL, WPL.replace("\n", "\r\n"), "\ufeff" + WPL):
        planned = read(tmp_path, content, "m.txt")
        home, takeoff, waypoint = planned.items

        assert planned.home is not None
        assert planned.home[:3] == (home.x, home.y, 584.0)
        assert (home.current, takeoff.command, waypoint.frame) == (1, 22, 10)
        assert (takeoff.x, takeoff.y, takeoff.z) == (-35.3632, 149.1652, 20.0)
        assert math.isnan(takeoff.params[3])
        assert (takeoff.said.y_decimals, takeoff.said.number) == (5, 1)
        assert text_at(planned, takeoff.places.y) == "149.16520"
        assert planned.text.place(takeoff.places.item) == (5, 1)


def test_home_is_taken_from_item_0_only_where_it_can_be(tmp_path: Path) -> None:
    assert read(tmp_path, WPL.replace("WPL 110", "WPL 120"), "m.txt").home is None
    assert read(tmp_path, WPL.replace("\t16\t0\t0", "\t22\t0\t0", 1), "m.txt").home is None
    no_height = read(tmp_path, WPL.replace("584.0", "0"), "m.txt").home
    assert no_height is not None
    assert math.isnan(no_height.alt_msl)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("1\t0\t3\t16\t0\t0\t0\t0\t47\t8\t30", "column 25: 11 columns where 12 belong: autocontinue"),
        ("1 0 3 16 0 0 0 0 47 8 30 1 9", "column 28: more than 12 columns"),
        ("1 0 3 16 0 0 0 0 47,5 8 30 1", "column 18: latitude is '47,5', which is no number: write a point"),
        ("1 0 3 x 0 0 0 0 47 8 30 1", "command is 'x'"),
        ("1 0 3.5 16 0 0 0 0 47 8 30 1", "frame must be a whole number"),
        ("1 0 3 16 0 0 0 0 1e999 8 30 1", "latitude is '1e999'"),
        ("1 0 3 16 0 0 0 0 1_0 8 30 1", "latitude is '1_0'"),
        ("a", "column 1: 'a' is no number"),
    ],
)  # fmt: skip
def test_a_waypoint_line_that_is_none_says_where(tmp_path: Path, row: str, words: str) -> None:
    with pytest.raises(MissionError) as error:
        read(tmp_path, f"QGC WPL 110\n{row}\n", "m.txt")
    assert "line 2, " in str(error.value)
    assert words in str(error.value)


def test_unknown_versions_of_waypoint_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MissionError, match="version 100 of waypoint files is not known"):
        read(tmp_path, "QGC WPL 100\n", "m.txt")


def test_fences_and_rally_points_in_waypoint_files_have_their_own_numbers(tmp_path: Path) -> None:
    rows = "".join(
        f"{k}\t0\t0\t{c}\t4\t0\t0\t0\t47.1\t8.1\t0\t1\n" for k, c in enumerate((16, 5001, 5100))
    )
    planned = read(tmp_path, "QGC WPL 110\n" + rows, "m.txt")
    assert [each.mission_type for each in planned.items] == [MISSION, FENCE, RALLY]


POINTS = ["47.3977 8.5456", "47.3987 8.5456", "47.3987 8.5466", "47.3977 8.5466"]


def test_files_of_points(tmp_path: Path) -> None:
    head = "#saved by Mission Planner 1.3\n"
    polygon = read(tmp_path, head + "\n".join([*POINTS, POINTS[0]]), "a.poly")
    fence = read(tmp_path, head + "\n".join([POINTS[0], *POINTS[1:], POINTS[1]]) + "\n", "a.fen")
    rally = read(tmp_path, head + "RALLY\t47.3977\t8.5456\t100.5\t40.0\t0.0\t0\n", "a.ral")

    assert [each.command for each in polygon.items] == [5001] * 4
    assert [each.command for each in fence.items] == [5000, 5001, 5001, 5001]
    assert fence.items[1].params[0] == 3
    assert fence.text.place(fence.items[1].places.y) == (3, 9)
    (point,) = rally.items
    assert (point.command, point.x, point.y, point.z) == (5100, 47.3977, 8.5456, 100.5)
    with pytest.raises(MissionError, match="line 5, column 14: 1 columns where"):
        read(tmp_path, "\n".join([*POINTS, "47.3977000000"]), "b.poly")
    with pytest.raises(MissionError, match="line 2, column 7: 'x' is no number"):
        read(tmp_path, "RALLY 1.5 2.5 3\nRALLY x 2 3\n", "b.ral")


def test_files_are_told_apart_by_content(tmp_path: Path) -> None:
    kinds = {
        Kind.PLAN: json.dumps(plan()),
        Kind.WPL: WPL,
        Kind.POINTS: "\n".join(POINTS),
        Kind.RALLY: "# x\r\nRALLY 1 2 3\r\n",
        Kind.TEXT: "47.3977 8.5456 12\n" * 5,
        Kind.JSON: '{"version": 1, "route": []}',
    }
    for kind, content in kinds.items():
        with open_recording(written(tmp_path, content, "any"), kinds=None) as file:
            assert file.kind is kind
