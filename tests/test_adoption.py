"""What other repositories name to adopt the check: the pre-commit hook and the GitHub action."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOOK = (ROOT / ".pre-commit-hooks.yaml").read_text("utf-8")
ACTION = (ROOT / "action.yml").read_text("utf-8")


def test_the_hook_takes_missions_and_recordings() -> None:
    files = re.compile(re.findall(r"^  files: (.*)$", HOOK, re.MULTILINE)[0])
    samples = [path.name for path in (ROOT / "samples").iterdir()]
    taken = {name for name in [*samples, "a.fen", "b.poly", "c.ral"] if files.search(name)}
    missions = {".plan", ".waypoints", ".fen", ".poly", ".ral"}
    assert {Path(name).suffix for name in taken} == missions | {".tlog", ".pcap"}
    assert "entry: mavframecheck check\n" in HOOK


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash, which runs the action")
def test_the_action_passes_paths_with_spaces_and_options(tmp_path: Path) -> None:
    script = textwrap.dedent(re.findall(r"- name: check\n.*?run: \|\n(.*)", ACTION, re.DOTALL)[0])
    shutil.copy(ROOT / "samples" / "sea_level_height.plan", tmp_path / "a mission.plan")
    command = tmp_path / "mavframecheck"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mavframecheck "$@"\n')
    command.chmod(0o755)
    given = {"MAVFRAMECHECK": str(command), "PATHS": "a mission.plan\n"}

    def run(arguments: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | given | {"ARGS": arguments}
        shell = ["bash", "-e", "-o", "pipefail", "-c", script]
        return subprocess.run(
            shell, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
        )

    found = run("")
    assert found.returncode == 1, found.stderr
    assert "MFC202" in found.stdout
    assert run("--ignore=MFC2\n--autopilot=px4\n").returncode == 0
