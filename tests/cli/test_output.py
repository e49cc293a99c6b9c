"""`--output FORMAT=PATH`: one pass over the recordings, several reports."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mavframecheck.report import DRAWN, FORMATS, Checked
from tests.cli.conftest import FakeEngine, Run
from tests.report import made_up

FOUND = Checked(made_up.file(), (made_up.finding(),))


def test_one_pass_gives_every_report(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Each file holds what `--format` would have written; each recording is judged once."""
    engine.answers["a.tlog"] = FOUND
    wanted = [part for form in FORMATS for part in ("--output", f"{form}=report.{form}")]
    result = run("check", "a.tlog", "b.tlog", *wanted)
    assert result.exit_code == 1
    assert engine.checked == ["a.tlog", "b.tlog"]
    assert result.stdout_bytes == Path("report.text").read_bytes()
    assert len(json.loads(Path("report.json").read_bytes())["files"]) == 2
    for page in sorted(Path("report").iterdir()):
        assert f'href="report/{page.name}"' in Path("report.html").read_text("utf-8")
    for form in FORMATS.keys() - DRAWN:
        alone = run("check", "a.tlog", "b.tlog", "--format", form).stdout_bytes
        assert Path(f"report.{form}").read_bytes() == alone


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("json", "is not FORMAT=PATH, such as json=report.json"),
        ("=report.json", "is not FORMAT=PATH"),
        ("json=", "is not FORMAT=PATH"),
        ("yaml=report.yaml", "no format is called 'yaml'; there are text, json"),
        ("json=missing/report.json", "cannot write a report here: No such file or directory"),
    ],
)
def test_mistakes_are_said_before_reading(
    engine: FakeEngine, logs: Path, run: Run, output: str, words: str
) -> None:
    """Nobody waits an hour to learn that the report cannot be written."""
    result = run("check", "a.tlog", "--output", output)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.split())
    assert engine.checked == []


def test_interrupted_run_writes_every_report(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Ctrl-C in the second file keeps the first, in files too."""
    engine.answers |= {"a.tlog": FOUND, "b.tlog": KeyboardInterrupt()}
    assert run("check", "a.tlog", "b.tlog", "--output", "json=r.json").exit_code == 130
    assert len(json.loads(Path("r.json").read_bytes())["findings"]) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
def test_full_disk_is_no_clean_run(engine: FakeEngine, logs: Path, run: Run) -> None:
    """A report that cannot be written is said and counts."""
    result = run("check", "a.tlog", "--output", "json=/dev/full")
    assert (result.exit_code, "cannot write the report" in result.stderr) == (2, True)


def test_report_writes_pages(engine: FakeEngine, logs: Path, run: Run) -> None:
    """One recording is a page, several are an index and a page each; findings are no failure."""
    engine.answers["a.tlog"] = FOUND
    assert run("report", "a.tlog").exit_code == 0
    assert "finding-1" in Path("report.html").read_text("utf-8")
    result = run("report", "a.tlog", "b.tlog", "--output", "all.html")
    assert (result.exit_code, result.stderr) == (0, "mavframecheck: wrote all.html\n")
    assert [file.name[:4] for file in sorted(Path("all").iterdir())] == ["001-", "002-"]
    assert run("report", "a.tlog", "--output", "missing/r.html").exit_code == 2
