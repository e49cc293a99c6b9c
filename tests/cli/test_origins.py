"""`inspect --origins` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from tests.vehicle.test_origins import ALT, LAT, LON, MOVED, V, recorded


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Return a recording in which the origin is moved in flight, and home is not."""
    path = tmp_path / "flight.tlog"
    says = [*V.beats(0, 2, 0), *V.flight(0, 20_000, 5), *V.beats(2, 20), *V.home(3), *V.origin(6)]
    path.write_bytes(recorded([*says, *MOVED.ask(14), *MOVED.origin(15)]))
    return path


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["inspect", "--origins", *arguments])


def test_tables(log: Path) -> None:
    result = run(str(log))
    assert result.exit_code == 0
    lines = result.output.splitlines()
    assert "system 1" in lines
    (moved,) = (line for line in lines if "asked for by 255/190" in line)
    assert "N +11.1  E +0.0  up +3.0 m" in moved
    assert {"  Local origins", "  Home", "  Armed at"} <= set(lines)


def test_json(log: Path) -> None:
    (file,) = json.loads(run(str(log), "--format", "json").output)["files"]
    (vehicle,) = file["vehicles"]
    first, second = vehicle["origins"]
    assert (first["origin_id"], first["source"], first["asked_by"]) == (
        1,
        "GPS_GLOBAL_ORIGIN",
        None,
    )
    assert (first["lat"], first["lon"]) == (LAT, LON)
    assert (first["height_m"], first["height_reference"]) == (ALT, "msl")
    assert (second["north_m"], second["up_m"]) == (pytest.approx(11.1, abs=0.1), pytest.approx(3.0))
    assert vehicle["homes"][0]["armed"]
    assert len(vehicle["launches"]) == 1


def test_nothing_said(tmp_path: Path) -> None:
    path = tmp_path / "quiet.tlog"
    path.write_bytes(recorded(V.beats(0, 3, 0)))
    result = run(str(path))
    assert result.exit_code == 0
    assert "no autopilot says where its origin or home is" in result.output


@pytest.mark.parametrize("option", [["--all"], ["--message", "ATTITUDE"]])
def test_what_does_not_go_together(log: Path, option: list[str]) -> None:
    assert run(str(log), *option).exit_code == 2
