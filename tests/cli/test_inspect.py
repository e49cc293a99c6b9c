"""`inspect` on the command line: tables for people, JSON for machines, exit codes."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from mavframecheck.wire import load_dialect
from mavframecheck.wire.encode import encode_frame, encode_payload, stamped

START_US = 1_772_619_072_000_000
HOSTILE = "\x1b[2J\u202e"


def records() -> bytes:
    """Return ten of each: position, set-points in two frames, a parameter with a hostile name."""
    layouts = load_dialect().by_name
    messages: list[tuple[str, dict[str, Any]]] = [
        ("HEARTBEAT", {"type": 2, "autopilot": 12}),
        (
            "GLOBAL_POSITION_INT",
            {"lat": 473977420, "lon": 85455940, "alt": 488_000, "relative_alt": 10_000},
        ),
        ("ATTITUDE", {"roll": 0.5, "yaw": math.nan}),
        ("NAMED_VALUE_FLOAT", {"name": HOSTILE.encode()[:10], "value": 1.0}),
        ("RAW_IMU", {"time_usec": 5_000_000, "xacc": 1}),
    ]
    data = b""
    for number in range(10):
        frame = 1 if number else 8
        setpoint = {"x": float(number), "type_mask": 3576, "coordinate_frame": frame}
        for name, values in (*messages, ("SET_POSITION_TARGET_LOCAL_NED", setpoint)):
            payload = encode_payload(layouts[name], values)
            sent = encode_frame(layouts[name], payload, sysid=1, compid=1, seq=0)
            data += stamped(sent, START_US + number * 100_000)
    return data


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with one recording."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "flight.tlog"
    path.write_bytes(records())
    return path


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["inspect", *arguments], catch_exceptions=False)


def test_text_says_what_numbers_mean(log: Path) -> None:
    result = run("flight.tlog")
    assert result.exit_code == 0
    flat = " ".join(result.stdout.split())
    for words in (
        "1/1 PX4 of unknown version, quadrotor",
        "GLOBAL_POSITION_INT 10.0 Hz (10)",
        "lat latitude, degE7 geodetic, WGS 84; + north 47.397742 deg",
        "relative_alt altitude, mm above home; + up 10 m",
        "LOCAL_NED 90 %, BODY_NED 10 %",
        "type_mask 3576 100 %: uses x, y, z; ignores vx",
        "(28.65 deg)",
        "NaN 100 %",
        "3 further fields",
        "of place and time only a stamp in: NAMED_VALUE_FLOAT 10.0 Hz (10); RAW_IMU 10.0 Hz (10)",
        "nothing of place or time in: HEARTBEAT 10.0 Hz (10)",
        "datum: WGS 84; projection: none",
        "above home height from: home position",
    ):
        assert words in flat
    assert max(map(len, result.stdout.splitlines())) <= 100
    assert "rollspeed" not in flat


def test_every_field_on_request(log: Path) -> None:
    assert "rollspeed" in run("flight.tlog", "--all").stdout
    result = run("flight.tlog", "--message", "raw_imu")
    assert "xacc" in result.stdout
    assert "ATTITUDE" not in result.stdout
    assert "none of the messages" in run("flight.tlog", "--message", "ODOMETRY").stdout


@pytest.mark.parametrize("arguments", [[], ["--all"], ["--format", "json"]])
def test_hostile_text_is_escaped(log: Path, arguments: list[str]) -> None:
    """Names of values come from the log."""
    log.rename(f"{HOSTILE}.tlog")
    result = run(f"{HOSTILE}.tlog", *arguments)
    assert result.exit_code == 0
    assert "\x1b" not in result.stdout
    if arguments != ["--format", "json"]:
        assert "\u202e" not in result.stdout


def test_json_has_every_field_and_no_nan(log: Path) -> None:
    result = run("flight.tlog", "--format", "json")

    def refuse(word: str) -> None:
        raise AssertionError(word)

    document = json.loads(result.stdout_bytes, parse_constant=refuse)
    assert set(document) == {"version", "files"}
    (file,) = document["files"]
    (sender,) = file["senders"]
    assert (sender["autopilot"], file["messages"]) == ("px4", 60)
    streams = {each["message"]: each for each in sender["streams"]}
    assert streams["ATTITUDE"]["rate_hz"] == pytest.approx(10)
    (view,) = streams["SET_POSITION_TARGET_LOCAL_NED"]["views"]
    x = next(each for each in view["fields"] if each["name"] == "x")
    assert x["frames"] == [
        {"reference": "LOCAL_NED", "count": 9},
        {"reference": "BODY_NED", "count": 1},
    ]
    assert {each["name"] for each in file["references"]} >= {"LOCAL_NED", "BODY_NED", "wgs84"}


def test_json_is_documented(log: Path) -> None:
    """Every key of the document stands in docs/output.md."""
    text = (Path(__file__).parents[2] / "docs" / "output.md").read_text()
    keys: set[str] = set()

    def collect(value: Any) -> None:
        if isinstance(value, dict):
            keys.update(value)
        for item in value.values() if isinstance(value, dict) else value:
            if isinstance(item, dict | list):
                collect(item)

    collect(json.loads(run("flight.tlog", "--format", "json").stdout_bytes))
    assert {key for key in keys if f"`{key}`" not in text and key not in text} == set()


def test_several_files_and_one_that_is_none(log: Path, tmp_path: Path) -> None:
    (tmp_path / "b.tlog").write_bytes(log.read_bytes())
    both = run("flight.tlog", "b.tlog")
    assert both.exit_code == 0
    assert [line for line in both.stdout.splitlines() if line.endswith(".tlog")] == [
        "flight.tlog",
        "b.tlog",
    ]
    result = run("nowhere.tlog", "flight.tlog")
    assert result.exit_code == 2
    assert "no such file" in result.stderr
    assert "GLOBAL_POSITION_INT" in result.stdout


def test_nothing_to_decode(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "noise.raw").write_bytes(bytes(range(200)) * 20)
    assert run("noise.raw", "--input-kind", "raw").exit_code == 3
    (tmp_path / "empty").mkdir()
    assert run("empty").exit_code == 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--message", "ATITUDE"], "Did you mean ATTITUDE"),
        (["--dialect", "commom"], "common"),
        (["--dialect", "commom", "--message", "ATTITUDE"], "common"),
        (["--format", "xml"], "json"),
    ],
)
def test_usage_errors(log: Path, options: list[str], words: str) -> None:
    result = run("flight.tlog", *options)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.split())


def test_no_path() -> None:
    assert run().exit_code == 2


def test_other_dialect(log: Path) -> None:
    assert "PX4" in run("flight.tlog", "--dialect", "common").stdout
