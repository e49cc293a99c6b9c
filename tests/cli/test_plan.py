"""`check --plan`: recordings beside the mission that they were meant to fly."""

from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner, Result

from mavframecheck.cli import main
from tests.checks.test_mission_rules import ROUTE, exchanged, flying, placed, reached
from tests.missions.transfers import Fields, Transfers


def run(folder: Path, recording: Transfers, *arguments: str) -> Result:
    path = folder / "flight.tlog"
    path.write_bytes(recording.data)
    options = ["check", "--select", "MFC416", "--format", "json", *arguments]
    return CliRunner().invoke(main, [*options, str(path)])


def planned(folder: Path, items: list[Fields]) -> str:
    """Write a waypoint file with these items."""
    rows = [
        f"{i['seq']}\t0\t{i['frame']}\t{i['command']}\t0\t0\t0\t0\t{i['x'] / 1e7:.7f}\t{i['y'] / 1e7:.7f}\t{i['z']}\t1"
        for i in items
    ]
    path = folder / "intended.waypoints"
    path.write_text("\n".join(["QGC WPL 110", *rows]) + "\n", "utf-8")
    return str(path)


def test_a_mission_that_was_uploaded_mirrored(tmp_path: Path) -> None:
    """What was sent is wrong; that it was flown follows, and is not said again."""
    route = placed(*ROUTE)
    recording = reached(flying().upload(exchanged(route)), exchanged(route))
    assert run(tmp_path, recording).exit_code == 0
    result = run(tmp_path, recording, "--plan", planned(tmp_path, route))
    assert result.exit_code == 1
    (finding,) = json.loads(result.output)["findings"]
    assert finding["message_name"] == "MISSION_ITEM_INT"
    assert finding["evidence"]["says"] == "with north and east exchanged"


def test_a_flight_along_the_plan(tmp_path: Path) -> None:
    route = placed(*ROUTE)
    recording = reached(flying().upload(route), route)
    assert run(tmp_path, recording, "--plan", planned(tmp_path, route)).exit_code == 0


def test_a_flight_of_which_only_the_track_is_recorded(tmp_path: Path) -> None:
    route = placed(*ROUTE)
    result = run(tmp_path, reached(flying(), exchanged(route)), "--plan", planned(tmp_path, route))
    (finding,) = json.loads(result.output)["findings"]
    assert finding["message_name"] == "MISSION_ITEM_REACHED"


def test_a_plan_that_is_none(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.plan"
    wrong.write_text("{}", "utf-8")
    result = run(tmp_path, flying(), "--plan", str(wrong))
    assert result.exit_code == 2
    assert "wrong.plan" in result.stderr
    assert run(tmp_path, flying(), "--plan", str(tmp_path / "none.plan")).exit_code == 2
