"""`check --dem`: missions over a terrain model."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from tests.geo.terrains import HOME, Floats, projected, written
from tests.missions.made import item, plan
from tests.missions.made import written as mission

pytest.importorskip("rasterio", reason="rasterio is not installed (the extra dem)")

UTM = (462_000.0, 5_253_000.0, 10.0)
"""West, north and pixel of a model around home, m of zone 32."""
SIZE = (1100, 1000)


def ridge(x: Floats, y: Floats) -> Floats:
    """Return 488 m, and a ridge of 300 m that runs from west to east a kilometre north of home."""
    _, north = projected("EPSG:32632", np.array([HOME[0]]), np.array([HOME[1]]))
    return 488 + 300 * np.maximum(0, 1 - np.abs(y - north - 1000) / 200) + 0 * x


def terrain(folder: Path, **profile: Any) -> str:
    options = {"crs": "EPSG:32632", "grid": UTM, "size": SIZE, "dtype": "float32"}
    return written(folder / "site.tif", ridge, **options | profile)


def flight(*legs: tuple[float, float, int]) -> dict[str, Any]:
    """Return a plan of places so many metres north of home, with height and frame."""
    lats = [HOME[0] + north / 111_186.0 for north, _, _ in legs]
    return plan(
        *(
            item(16, frame, lat=lat, lon=HOME[1], alt=alt)
            for lat, (_, alt, frame) in zip(lats, legs)
        )
    )


OVER_THE_RIDGE = ((200.0, 100.0, 3), (2000.0, 100.0, 3))


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["check", "--isolated", *arguments])


def test_a_leg_through_a_ridge(tmp_path: Path) -> None:
    file = str(mission(tmp_path, flight(*OVER_THE_RIDGE)))
    result = run(file, "--dem", terrain(tmp_path), "--select", "MFC911", "--format", "json")
    assert result.exit_code == 1
    report = json.loads(result.output)
    (finding,) = report["findings"]
    assert finding["location"]["item"] == 1
    assert finding["location"]["command"] == "NAV_WAYPOINT"
    assert finding["evidence"]["above_m"] == pytest.approx(-200, abs=10)
    assert finding["evidence"]["lat"] == pytest.approx(HOME[0] + 1000 / 111_186, abs=1e-4)
    (note,) = report["files"][0]["notes"]
    assert note == (
        "terrain model site.tif: a point every 10 m; its heights are taken as above mean sea level: "
        "it does not say what they are above"
    )


def test_nothing_is_claimed_without_it(tmp_path: Path) -> None:
    file = str(mission(tmp_path, flight(*OVER_THE_RIDGE)))
    report = json.loads(run(file, "--select", "MFC911", "--format", "json").output)
    assert not report["findings"]
    (ran,) = report["files"][0]["runs"]
    assert ran["status"] == "not-applicable"
    assert ran["reason"] == "no terrain model was given (--dem FILE)"
    assert not report["files"][0]["notes"]


def test_a_waypoint_file(tmp_path: Path) -> None:
    """Home is its first item."""
    lines = [
        f"0\t1\t0\t16\t0\t0\t0\t0\t{HOME[0]}\t{HOME[1]}\t488.0\t1",
        f"1\t0\t3\t16\t0\t0\t0\t0\t{HOME[0] + 0.002}\t{HOME[1]}\t100.0\t1",
        f"2\t0\t3\t16\t0\t0\t0\t0\t{HOME[0] + 0.018}\t{HOME[1]}\t100.0\t1",
    ]
    file = tmp_path / "m.waypoints"
    file.write_text("\n".join(["QGC WPL 110", *lines]) + "\n", "utf-8")
    result = run(str(file), "--dem", terrain(tmp_path), "--select", "MFC911", "--format", "concise")
    assert result.exit_code == 1
    assert "m.waypoints:4:" in result.output
    assert "from item 1 to item 2" in result.output


def test_a_mission_beside_the_model(tmp_path: Path) -> None:
    """Insufficient data, with how much of it the model covers."""
    path = terrain(tmp_path, grid=(UTM[0], UTM[1] + 100_000, UTM[2]))
    file = str(mission(tmp_path, flight((200.0, 600.0, 0), (2000.0, 600.0, 0))))
    result = run(file, "--dem", path, "--select", "MFC911", "--format", "json")
    assert result.exit_code == 0
    (ran,) = json.loads(result.output)["files"][0]["runs"]
    assert ran["status"] == "insufficient-data"
    assert ran["reason"] == "the terrain model covers 0 % of the mission (1.8 km)"


def test_the_configuration_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its path is from the folder of that file; the command line goes before it."""
    terrain(tmp_path)
    (tmp_path / "mavframecheck.toml").write_text('dem = "site.tif"\nselect = ["MFC911"]\n', "utf-8")
    (tmp_path / "missions").mkdir()
    mission(tmp_path / "missions", flight(*OVER_THE_RIDGE))
    monkeypatch.chdir(tmp_path / "missions")
    runner = CliRunner()
    assert runner.invoke(main, ["check", "m.plan"]).exit_code == 1
    assert 'dem = "site.tif"' in runner.invoke(main, ["check", "--show-settings"]).output
    other = written(tmp_path / "flat.tif", lambda x, _: 0 * x + 488)
    assert runner.invoke(main, ["check", "m.plan", "--dem", other]).exit_code == 0
    (tmp_path / "site.tif").unlink()
    missing = runner.invoke(main, ["check", "m.plan"])
    assert missing.exit_code == 2
    assert "there is no such file" in missing.stderr


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_what_is_no_terrain_model(jobs: str, tmp_path: Path) -> None:
    """Wrong usage, said once: no mission is to blame."""
    for name in ("a.plan", "b.plan"):
        mission(tmp_path, flight(*OVER_THE_RIDGE), name)
    broken = tmp_path / "broken.tif"
    broken.write_bytes(Path(terrain(tmp_path)).read_bytes()[:3000])
    result = run(str(tmp_path), "--jobs", jobs, "--dem", str(broken))
    assert result.exit_code == 2
    assert result.stderr.count("terrain model broken.tif: ") == 1
    assert run(str(tmp_path), "--dem", str(tmp_path / "none.tif")).exit_code == 2


def test_fix_and_baseline(tmp_path: Path) -> None:
    """They go on as they do without it."""
    path = terrain(tmp_path)
    file = mission(tmp_path, flight((200.0, 100.0, 6), (2000.0, 100.0, 6)))
    assert "-" in run(str(file), "--diff", "--dem", path).output
    assert run(str(file), "--fix", "--dem", path, "--select", "MFC111,MFC911").exit_code == 1
    known = ["--dem", path, "--select", "MFC911", "--baseline", str(tmp_path / "known.json")]
    run(str(file), *known, "--update-baseline")
    assert run(str(file), *known).exit_code == 0


def test_without_rasterio(tmp_path: Path) -> None:
    """Who lacks it is told how to get it; who gives no terrain model needs none."""
    program = (
        "import sys; sys.modules['rasterio'] = None\n"
        "from mavframecheck.cli import main\n"
        "main(['check', '--isolated', '--select', 'MFC911', *sys.argv[1:]])"
    )
    file = str(mission(tmp_path, flight(*OVER_THE_RIDGE)))

    def call(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", program, *arguments]
        return subprocess.run(command, check=False, capture_output=True, text=True)

    lacking = call(file, "--dem", terrain(tmp_path))
    assert lacking.returncode == 2
    assert "pip install 'mavframecheck[dem]'" in lacking.stderr
    assert "Traceback" not in lacking.stderr
    assert call(file).returncode == 0
