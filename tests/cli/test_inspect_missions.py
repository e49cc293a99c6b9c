"""`inspect --missions` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from tests.missions.transfers import JUMP, OTHER, TAKEOFF, Fields, Transfers, waypoints

FENCE = [
    {"seq": k, "command": 5001, "frame": 0, "x": 10_000 * x, "y": 10_000 * y, "param1": 4}
    for k, (x, y) in enumerate([(1, 1), (2, 1), (2, 2), (1, 2)])
]
ITEMS: list[Fields] = [
    {**waypoints(1)[0], "command": TAKEOFF, "param4": float("nan")},
    *waypoints(3)[1:],
    {"seq": 3, "command": JUMP, "frame": 2, "param1": 1.0, "param2": 2.0},
]


def run(recording: Transfers, folder: Path, *arguments: str) -> Result:
    path = folder / "flight.tlog"
    path.write_bytes(recording.data)
    return CliRunner().invoke(main, ["inspect", "--missions", *arguments, str(path)])


def test_tables(tmp_path: Path) -> None:
    recording = Transfers().alive().upload(ITEMS).upload(FENCE, kind=1).count(2).items(ITEMS[:1])
    result = run(recording, tmp_path)
    assert result.exit_code == 0
    assert "system 1: mission not known: an upload was not accepted" in result.output
    assert "system 1: fence, 4 items (uploaded)" in result.output
    (failed,) = (line for line in result.output.splitlines() if "1 of 2" in line)
    assert failed.split()[2:6] == ["upload", "1", "mission", "255/190"]


def test_json(tmp_path: Path) -> None:
    recording = Transfers().alive().upload(ITEMS).download(ITEMS[:2])
    (file,) = json.loads(run(recording, tmp_path, "--format", "json").output)["files"]
    assert [each["what"] for each in file["transfers"]] == ["upload", "download"]
    (held,) = file["held"]
    assert (held["known"], held["count"], held["autopilot"]) == ("read back", 2, "px4")
    assert held["items"][0]["command_name"] == "NAV_TAKEOFF"
    assert held["items"][0]["params"] == [0, 0, 0, None]


def test_waypoints(tmp_path: Path) -> None:
    recording = Transfers().alive().upload(ITEMS)
    first, *lines = run(recording, tmp_path, "--format", "waypoints").output.splitlines()
    assert first == "QGC WPL 110"
    rows = [line.split("\t") for line in lines]
    assert [row[3] for row in rows] == ["22", "16", "16", "177"]
    assert rows[1][8:] == ["47.39874200", "8.54559400", "20.00000000", "1"]


@pytest.mark.parametrize(
    ("autopilot", "firmware", "numbers"), [(12, 12, [1, 2, 3, 4]), (3, 3, [1, 2, 3])]
)
def test_plan(tmp_path: Path, autopilot: int, firmware: int, numbers: list[int]) -> None:
    """ArduPilot's item 0 is home, and none of the items of a plan; jumps go to numbers from 1."""
    recording = Transfers().alive(autopilot).upload(ITEMS).upload(FENCE, kind=1)
    plan = json.loads(run(recording, tmp_path, "--format", "plan").output)
    mission = plan["mission"]
    assert mission["firmwareType"] == firmware
    assert [item["doJumpId"] for item in mission["items"]] == numbers
    assert mission["items"][-1]["params"][0] == (2 if autopilot == 12 else 1)
    (polygon,) = plan["geoFence"]["polygons"]
    assert polygon["inclusion"]
    assert polygon["polygon"] == [[0.001, 0.001], [0.002, 0.001], [0.002, 0.002], [0.001, 0.002]]


def test_one_mission_goes_into_a_file(tmp_path: Path) -> None:
    recording = Transfers().alive().alive(12, OTHER).upload(ITEMS).download(ITEMS, OTHER)
    result = run(recording, tmp_path, "--format", "plan")
    assert result.exit_code == 2
    assert "systems 1, 2 hold some" in result.output


def test_nothing_sent(tmp_path: Path) -> None:
    result = run(Transfers().alive(), tmp_path)
    assert result.exit_code == 0
    assert "no mission was sent" in result.output


@pytest.mark.parametrize("arguments", [["--origins"], ["--all"], ["--message", "HEARTBEAT"]])
def test_what_does_not_go_together(tmp_path: Path, arguments: list[str]) -> None:
    assert run(Transfers().alive(), tmp_path, *arguments).exit_code == 2


def test_formats_of_missions_need_missions(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(Transfers().alive().data)
    assert CliRunner().invoke(main, ["inspect", "--format", "plan", str(path)]).exit_code == 2
