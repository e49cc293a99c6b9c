"""Shell completion, versions, and a watched folder."""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mavframecheck.report import Checked
from tests.cli.conftest import FakeEngine, Run
from tests.report import made_up

ROOT = Path(__file__).parents[2]


def completed(words: str, place: int) -> list[str]:
    """Return what bash would offer for the word at `place`."""
    given = {"COMP_WORDS": words, "COMP_CWORD": str(place)}
    answer = subprocess.run(
        [sys.executable, "-m", "mavframecheck"],
        env=os.environ | given | {"_MAVFRAMECHECK_COMPLETE": "bash_complete"},
        capture_output=True,
        check=True,
        text=True,
        cwd=ROOT,
    )
    return [line.partition(",")[2] for line in answer.stdout.splitlines()]


def test_commands_options_and_rules_are_completed() -> None:
    """As the script of the shell asks for them."""
    assert completed("mavframecheck ru", 1) == ["rules", "rule"]
    assert "--update-baseline" in completed("mavframecheck check --up", 2)
    assert "MFC302" in completed("mavframecheck rule MFC30", 2)
    assert completed("mavframecheck rule degrees-in-s", 2) == ["degrees-in-scaled-field"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_scripts_are_understood_by_their_shell(run: Run, shell: str) -> None:
    """Where the shell is installed; elsewhere the script at least names the command."""
    script = run("completion", shell).stdout
    assert "_MAVFRAMECHECK_COMPLETE" in script
    found = shutil.which(shell)
    if found:
        subprocess.run([found, "-n"], input=script.encode(), check=True)


def test_version_names_the_data(run: Run) -> None:
    """Program, dialect, catalogue, rules: the same digests every time."""
    lines = run("--version").stdout.splitlines()
    assert [line.split()[0] for line in lines] == [
        *("mavframecheck", "dialect", "catalogue", "rules"),
    ]
    assert "ardupilotmega" in lines[1]
    assert lines == run("--version").stdout.splitlines()


def test_watch_judges_what_appears(
    engine: FakeEngine, logs: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is there is left alone, what comes is judged when complete, and Ctrl-C is its end."""
    recording = (ROOT / "samples" / "clean_copter.tlog").read_bytes()
    engine.answers["new.tlog"] = Checked(made_up.file(path="new.tlog"), (made_up.finding(),))
    clock = itertools.count(0.0, 10.0)
    naps = itertools.count()

    def sleep(_seconds: float) -> None:
        if next(naps) == 0:
            (logs / "new.tlog").write_bytes(recording)
        elif (logs / "new.tlog").stat().st_size and engine.checked:
            raise KeyboardInterrupt

    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    monkeypatch.setattr("time.sleep", sleep)
    result = run("check", "--watch", str(logs), "--format", "concise")
    assert engine.checked == ["new.tlog"]
    assert result.exit_code == 1
    assert "MFC302" in result.stdout
    assert result.stderr.splitlines()[-1] == "mavframecheck: end of the watch"


def test_watch_takes_no_path(run: Run, tmp_path: Path) -> None:
    """One or the other."""
    result = run("check", "a.tlog", "--watch", str(tmp_path))
    assert (result.exit_code, "either PATH or --watch" in result.stderr) == (2, True)


def test_a_thousand_logs(engine: FakeEngine, tmp_path: Path, run: Run) -> None:
    """In order, in one table, and one that vanishes on the way stops nothing."""
    names = [f"{number:04d}.tlog" for number in range(1000)]
    recording = (ROOT / "samples" / "clean_copter.tlog").read_bytes()[:400]
    for name in names:
        (tmp_path / name).write_bytes(recording)
        engine.answers[name] = Checked(made_up.file(path=name), (made_up.mask(file=name),))
    engine.answers["0500.tlog"] = FileNotFoundError(2, "No such file or directory")
    result = run("check", str(tmp_path), "--format", "concise")
    assert result.exit_code == 2
    assert engine.checked == names
    found = [line.partition(":")[0] for line in result.stdout.splitlines()[:-1]]
    assert found == [name for name in names if name != "0500.tlog"]
    assert "0500.tlog: No such file or directory" in result.stderr
    assert result.stdout.splitlines()[-1].startswith("999 files: 999 warnings; ")
