"""`inspect --clocks` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from mavframecheck.cli import main
from tests.vehicle.clock_bench import CLEAN


@pytest.fixture
def log(tmp_path: Path) -> str:
    path = tmp_path / "flight.tlog"
    path.write_bytes(CLEAN["time of day, answered"])
    return str(path)


def run(*arguments: str) -> str:
    result = CliRunner().invoke(main, ["inspect", "--clocks", *arguments], catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_text(log: str) -> None:
    lines = run(log).splitlines()
    attitude = next(line for line in lines if "ATTITUDE.time_boot_ms" in line)
    assert "boot" in attitude
    assert "ppm" in attitude
    vision = next(line for line in lines if "VISION_POSITION_ESTIMATE.usec" in line)
    assert "1970 (UTC)" in vision
    assert any("1/1 asks 300 times" in line for line in lines)


def test_json(log: str) -> None:
    (file,) = json.loads(run("--format", "json", log))["files"]
    by_name = {stream["message"]: stream for stream in file["streams"]}
    assert by_name["RAW_IMU"]["domain"] == "boot"
    assert abs(by_name["RAW_IMU"]["error_ppm"]) < 500
    assert by_name["RAW_IMU"]["latency_p99_s"] < 0.1
    assert file["restarts"] == []
