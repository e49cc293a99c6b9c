"""`inspect --sender` on the command line."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from samples.make import HERE

ENU = str(HERE / "vision_in_enu.tlog")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["inspect", *arguments], catch_exceptions=False)


def test_text() -> None:
    """Each step has a line, and a failed one says why below."""
    result = run("--sender", "1/191", ENU)
    lines = result.output.splitlines()
    axes = next(k for k, line in enumerate(lines) if line.strip().startswith("axes"))
    assert result.exit_code == 0
    assert "FAILED" in lines[axes]
    assert "MFC401: VISION_POSITION_ESTIMATE.x holds East" in lines[axes + 1]
    assert any(line.split()[:2] == ["signs", "passed"] for line in lines)


def test_json() -> None:
    """The document has the verdicts, their findings and how each rule ended."""
    (file,) = json.loads(run("--sender", "1/191", "--format", "json", ENU).output)["files"]
    by_name = {step["step"]: step for step in file["steps"]}
    assert (file["sender"], file["heard"]) == ("1/191", True)
    assert len(by_name) == 10
    assert by_name["axes"]["verdict"] == "failed"
    assert by_name["axes"]["findings"][0]["code"] == "MFC401"
    assert {run["status"] for run in by_name["covariance"]["runs"]} <= {"ran", "not-applicable"}


def test_nobody_there() -> None:
    """A sender that is not heard is said to be silent."""
    result = run("--sender", "9/9", ENU)
    assert result.exit_code == 0
    assert "9/9 says nothing here; heard: " in result.output


@pytest.mark.parametrize("sender", ["1", "1/2/3", "1/256", "-1/3", "a/b", "1/", "²/1"])
def test_no_sender(sender: str) -> None:
    """What is no sender is a usage error that says how to write one."""
    result = run(f"--sender={sender}", ENU)
    assert result.exit_code == 2
    assert "1/191" in result.output


@pytest.mark.parametrize(
    "other", [["--clocks"], ["--origins"], ["--message", "ODOMETRY"], ["--all"]]
)
def test_what_does_not_go_together(other: list[str]) -> None:
    """One view at a time."""
    assert run("--sender", "1/191", *other, ENU).exit_code == 2
