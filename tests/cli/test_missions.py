"""`check` of mission files, from the command line to the findings."""

from __future__ import annotations

import json
import math
import re
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.missions import read_mission
from mavframecheck.missions.text import MissionError
from mavframecheck.sources import MISSIONS, open_recording
from tests.cli.conftest import Run
from tests.missions.made import item, plan, written

ROOT = Path(__file__).parents[2]
REAL = ROOT / "../shared/corpus/real"
SWAPPED = item(lat=8.5457, lon=47.3978)
HIGH = item(alt=520.0)


def found(run: Run, *arguments: str) -> list[dict[str, Any]]:
    result = run("check", *arguments, "--format", "json")
    assert result.exit_code in (0, 1), result.stderr
    findings: list[dict[str, Any]] = json.loads(result.stdout)["findings"]
    return findings


def test_a_finding_names_line_column_item_and_command(run: Run, tmp_path: Path) -> None:
    file = written(tmp_path, plan(item(22), item(), HIGH, HIGH, item(), HIGH))
    lines = file.read_text("utf-8").splitlines()
    high = [k for k, line in enumerate(lines, 1) if "520.0" in line]
    findings = [each for each in found(run, str(file)) if each["code"] == "MFC202"]

    assert [each["location"]["line"] for each in findings] == [high[0], high[2]]
    assert [each["count"] for each in findings] == [2, 1]
    location = findings[0]["location"]
    assert lines[location["line"] - 1][location["column"] - 1 :] == "520.0"
    assert (location["item"], location["command"]) == (2, "NAV_WAYPOINT")
    assert (findings[0]["sysid"], findings[0]["time_first"]) == (None, None)
    assert findings[0]["fingerprint"] != findings[1]["fingerprint"]

    text = run("check", str(file)).stdout
    assert f"2 times, first in line {high[0]}, column 11, item 2, NAV_WAYPOINT" in text
    assert "for PX4, quadrotor" in text
    assert "6 mission items" in text


def test_scaled_degrees_are_found_once_with_and_without_home(run: Run, tmp_path: Path) -> None:
    scaled = item(lat=473978000, lon=85457000)
    homeless = written(tmp_path, plan(scaled, plannedHomePosition=[0, 0, 0]), "a.plan")
    assert [each["code"] for each in found(run, str(homeless))] == ["MFC304"]
    assert [each["code"] for each in found(run, str(written(tmp_path, plan(scaled))))] == ["MFC306"]


def test_directories_and_patterns_pick_missions_up_by_content(run: Run, tmp_path: Path) -> None:
    written(tmp_path, plan(item(22), SWAPPED), "mission.json")
    written(tmp_path, "QGC WPL 110\n0 1 0 16 0 0 0 0 47.3 8.5 488 1\n", "notes.txt")
    written(tmp_path, '{"some": "json"}', "other.json")
    result = run("check", str(tmp_path), "--format", "json")
    files = json.loads(result.stdout)["files"]

    assert [(Path(file["path"]).name, file["kind"]) for file in files] == [
        ("mission.json", "plan"),
        ("notes.txt", "wpl"),
    ]
    assert [each["code"] for each in found(run, str(tmp_path / "m*.json"))] == ["MFC305"]
    assert run("inspect", str(tmp_path)).exit_code == 3


def test_the_autopilot_option_overrules_the_file(run: Run, tmp_path: Path) -> None:
    rows = [[0, 0, 0, 0, 47.3977, 8.5456, 20], [0, 0, 0, 0, 47.3987, 8.5456, 20]]
    rows += [[0, 0, 0, 0, 47.3987, 8.5476, 20]]
    lines = [f"{k} 0 3 {16 if k else 22} {' '.join(map(str, row))} 1" for k, row in enumerate(rows)]
    file = str(written(tmp_path, "QGC WPL 120\n" + "\n".join(lines), "m.waypoints"))

    assert [each["code"] for each in found(run, file)] == []
    assert [
        each["code"] for each in found(run, file, "--autopilot", "px4")
    ] == []  # no type: no yaw
    zero = plan(*(item(params=[0, 0, 0, 0], lat=r[4], lon=r[5]) for r in rows), firmwareType=3)
    mission = str(written(tmp_path, zero))
    assert [each["code"] for each in found(run, mission)] == []
    assert [each["code"] for each in found(run, mission, "--autopilot", "px4")] == ["MFC602"]


def test_fix_and_diff(run: Run, tmp_path: Path) -> None:
    file = written(tmp_path, plan(item(22), item(frame=6), item()))
    before = file.read_bytes()

    diff = run("check", "--diff", str(tmp_path))
    assert diff.exit_code == 1
    assert [line for line in diff.stdout.splitlines() if re.match(r"[-+] ", line)] == [
        '-        "frame": 6,',
        '+        "frame": 3,',
    ]
    assert file.read_bytes() == before
    assert run("check", "--diff", "--ignore", "MFC111", str(file)).exit_code == 0

    fixed = run("check", "--fix", str(file))
    assert (fixed.exit_code, "1 value corrected" in fixed.stderr) == (0, True)
    assert file.read_bytes() == before.replace(b'"frame": 6', b'"frame": 3')
    assert run("check", "--diff", str(file)).exit_code == 0


@pytest.mark.parametrize(
    ("content", "code", "words"),
    [
        (b'{"fileType": "Plan", "version": 1, "version": 1}', 2, "line 1, column 36"),
        (b'{"fileType": "Plan", "x": \xff}', 2, "column 27: byte 0xff is not UTF-8"),
        (b'{"fileType": "Plan", "x": NaN}', 2, "NaN is no JSON"),
        (b'{"fileType": "Plan", "x": ' + b"[" * 200_000, 2, "levels of nesting"),
        (b'{"fileType": "Plan", "x": ' + b"9" * 100_000 + b"}", 2, "a number of 100000 characters"),
        (b'{"fileType": "Plan", "x": "' + b"y" * 40_000_000, 2, "more than 32 MB"),
        (b'{"fileType": "Plan", "version": 1, "mission": {"items": 3}}', 2, '"items" must be'),
        (b'{"fileType": "Plan", "version": 1, "mission": {"items": []}}', 3, ""),
        (b'{"fileType": "Plan", "version": 1}', 2, 'must have "mission"'),
        (b'{"fileType": "Mission", "items": []}', 2, "only whole plans are read"),
        (b'{"version": "1.0", "waypoints": []}', 3, "JSON, but neither a recording nor a plan"),
        (b"QGC WPL 110\n1\t0\t3", 2, "line 2, column 6: 3 columns where 12 belong"),
        (b"QGC WPL 7\n", 2, "version 7"),
        (b"QGC WPL 110\n", 3, ""),
    ],
    ids=range(14),
)
def test_what_cannot_be_read_is_one_clear_error(
    run: Run, tmp_path: Path, content: bytes, code: int, words: str
) -> None:
    file = written(tmp_path, content, "m.plan")
    began = time.process_time()
    result = run("check", str(file))
    assert time.process_time() - began < 20  # far from what a hang would take
    assert result.exit_code == code, result.stderr
    assert words in result.stderr
    assert len(result.stderr.splitlines()) == bool(words)
    assert len(result.stderr) < 400


SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5)
)
ODD = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=8), max_leaves=8)
ITEMS = st.fixed_dictionaries(
    {},
    optional={
        "type": st.sampled_from(["SimpleItem", "ComplexItem"]) | ODD,
        "command": st.integers(0, 65_535) | ODD,
        "frame": st.integers(0, 25) | ODD,
        "params": st.lists(st.none() | st.floats(allow_nan=False), min_size=7, max_size=7) | ODD,
        "doJumpId": ODD,
        "Items": ODD,
        "TransectStyleComplexItem": ODD,
    },
)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(ITEMS, max_size=4), ODD, ODD)
def test_no_plan_crashes(
    run: Run, tmp_path: Path, items: list[Any], home: Any, polygon: Any
) -> None:
    made = plan(*items, plannedHomePosition=home) | {"geoFence": {"polygons": polygon}}
    file = written(tmp_path, json.dumps(made).replace("Infinity", "1e999"))
    assert run("check", str(file)).exit_code in (0, 1, 2, 3)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(st.lists(st.integers(-1, 70_000) | st.floats() | st.sampled_from(["x", "1e5", "-0"])))
)
def test_no_waypoint_file_crashes(run: Run, tmp_path: Path, rows: list[list[Any]]) -> None:
    whole = [(row + [3] * 12)[:12] if len(row) % 3 else row for row in rows]
    lines = [" ".join(map(str, row)) for row in whole]
    file = written(tmp_path, "QGC WPL 110\n" + "\n".join(lines), "m.waypoints")
    assert run("check", str(file)).exit_code in (0, 1, 2, 3)


def test_a_long_mission_is_judged_whole(run: Run, tmp_path: Path) -> None:
    around = [(math.sin(k / 50), math.cos(k / 50)) for k in range(10_000)]
    items = [item(lat=47.4 + 0.01 * n, lon=8.55 + 0.01 * e) for n, e in around]
    items[9_000] = item(lat=8.55, lon=47.4)
    findings = found(run, str(written(tmp_path, plan(*items))))
    assert [(each["code"], each["location"]["item"]) for each in findings] == [("MFC305", 9_000)]


@pytest.mark.skipif(not REAL.is_dir(), reason="no recordings at ../shared/corpus/real")
@pytest.mark.parametrize(("folder", "refused"), [("plan", 0), ("wpl", 1)])
def test_every_real_mission_is_read_or_refused_for_a_reason(folder: str, refused: int) -> None:
    reasons = []
    for path in sorted((REAL / folder).iterdir()):
        with open_recording(path, kinds=MISSIONS) as file:
            try:
                assert read_mission(file).items
            except MissionError as error:
                reasons.append(str(error).removeprefix(f"{path}, "))
    assert reasons == ["line 2, column 1: 'a' is no number"] * refused
