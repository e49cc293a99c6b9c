"""`check`: options become settings, findings become exit codes, one bad file stops nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mavframecheck.engine import RuleFileError, SettingsError
from mavframecheck.report import Checked
from mavframecheck.sources import SourceError
from mavframecheck.wire import DialectError
from tests.cli.conftest import FakeEngine, Run
from tests.report import made_up

INFO = Checked(made_up.file(), (made_up.stream_rule(),))
WARNING = Checked(made_up.file(), (made_up.mask(),))
ERROR = Checked(made_up.file(), (made_up.finding(), made_up.stream_rule()))
NOTHING = Checked(made_up.file(messages=0, runs=()), ())


def test_without_a_path_it_shows_an_example(run: Run) -> None:
    """Nobody has to guess; and nothing was judged, so it is no success."""
    result = run("check")
    assert result.exit_code == 2
    assert "mavframecheck check flight.tlog" in result.stderr
    assert not result.stdout


@pytest.mark.parametrize(
    ("answer", "options", "code"),
    [
        (made_up.clean(), (), 0),
        (INFO, (), 0),
        (INFO, ("--fail-on", "info"), 1),
        (WARNING, (), 1),
        (WARNING, ("--fail-on", "error"), 0),
        (ERROR, ("--fail-on", "error"), 1),
        (NOTHING, (), 3),
        (SourceError("a.tlog: no permission to read this file"), (), 2),
        (PermissionError(13, "Permission denied"), (), 2),
        (KeyboardInterrupt(), (), 130),
    ],
)
def test_exit_codes(
    engine: FakeEngine,
    logs: Path,
    run: Run,
    answer: Checked | BaseException,
    options: tuple[str, ...],
    code: int,
) -> None:
    """0 clean, 1 findings, 2 cannot read, 3 nothing decoded, 130 interrupted."""
    engine.answers["a.tlog"] = answer
    assert run("check", "a.tlog", *options).exit_code == code


def test_an_unreadable_file_does_not_stop_the_others(
    engine: FakeEngine, logs: Path, run: Run
) -> None:
    """It is named on standard error, and the exit code says that the report is not all."""
    engine.answers["a.tlog"] = SourceError("a.tlog: this is a PX4 ULog")
    result = run("check", "missing.tlog", "a.tlog", "b.tlog")
    assert engine.checked == ["a.tlog", "b.tlog"]
    assert result.exit_code == 2
    assert "missing.tlog" in result.stderr
    assert result.stderr.count("a.tlog") == 1
    assert "no findings" in result.stdout


def test_one_empty_file_among_others_is_not_exit_3(
    engine: FakeEngine, logs: Path, run: Run
) -> None:
    """3 is for runs in which nothing at all was decoded."""
    engine.answers["a.tlog"] = NOTHING
    assert run("check", "a.tlog", "b.tlog").exit_code == 0


def test_directory_without_recordings(engine: FakeEngine, tmp_path: Path, run: Run) -> None:
    """A CI job that points at the wrong directory must not pass."""
    result = run("check", str(tmp_path))
    assert result.exit_code == 3
    assert "no recording" in result.stderr
    assert "nothing was judged" in result.stdout


def test_a_file_named_twice_is_judged_once(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Globs overlap."""
    run("check", "a.tlog", "b.tlog", "./a.tlog")
    assert engine.checked == ["a.tlog", "b.tlog"]


def test_interrupted_run_reports_what_was_done(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Ctrl-C in the second of two files keeps the first, even in JSON."""
    engine.answers |= {"a.tlog": ERROR, "b.tlog": KeyboardInterrupt()}
    result = run("check", "a.tlog", "b.tlog", "--format", "json")
    assert result.exit_code == 130
    assert len(json.loads(result.stdout)["findings"]) == 2
    assert "interrupted" in result.stderr


def test_ctrl_c_anywhere_is_not_taken_for_findings(
    engine: FakeEngine, logs: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also before the first file and while a report is written."""

    def interrupt(_directories: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("mavframecheck.engine.load_pack", interrupt)
    assert run("check", "a.tlog").exit_code == 130


def test_options_become_settings(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Each reaches the engine in its type."""
    run(
        *("check", "a.tlog", "--preview", "--autopilot", "px4", "--dialect", "common"),
        *("--input-kind", "raw", "--select", "mfc3,unmasked-zero-yaw", "--select", "MFC107"),
        *("--ignore", "MFC302", "--set", "MFC302.near_km=2", "--set", "mfc302.strict=no"),
        *("--set", "MFC302.tries=7", "--set", "MFC302.word=south=up"),
    )
    settings = engine.settings
    assert settings.preview
    assert (settings.autopilot, settings.dialect, settings.input_kind) == ("px4", "common", "raw")
    assert settings.select == ("MFC3", "MFC107", "MFC107")
    assert settings.ignore == ("MFC302",)
    expected = {"near_km": 2.0, "strict": False, "tries": 7, "word": "south=up"}
    assert settings.overrides == {"MFC302": expected}
    assert isinstance(settings.overrides["MFC302"]["near_km"], float)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--select", "MFC303"), "Did you mean MFC302"),
        (("--ignore", "degrees-in-scaled-fields"), "Did you mean degrees-in-scaled-field"),
        (("--select", "XYZ"), "'mavframecheck rules' lists them"),
        (("--set", "MFC302.near=1"), "It has: near_km=1.0, tries=3, strict=true, word=north"),
        (("--set", "MFC107.near=1"), "It has: none"),
        (("--set", "MFC999.near_km=1"), "Rules with parameters: MFC302"),
        (("--set", "MFC302.near_km"), "is not CODE.param=value"),
        (("--set", "MFC302.near_km=far"), "takes a number, not 'far'"),
        (("--set", "MFC302.near_km=nan"), "takes a number"),
        (("--set", "MFC302.tries=2.5"), "takes a whole number"),
        (("--set", "MFC302.strict=maybe"), "takes true or false"),
        (("--format", "xml"), "'text', 'json', 'jsonl'"),
        (("--autopilot", "px5"), "'px4'"),
        (("--rules", "nowhere"), "nowhere"),
    ],
)
def test_mistakes_say_what_exists(
    engine: FakeEngine, logs: Path, run: Run, options: tuple[str, ...], words: str
) -> None:
    """A usage error names what the user may have meant, and judges nothing."""
    result = run("check", "a.tlog", *options)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.split())
    assert engine.checked == []


def test_bad_settings_and_rule_files_are_usage_errors(
    engine: FakeEngine, logs: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the engine refuses is said without a traceback."""
    engine.answers["a.tlog"] = SettingsError("no dialect is called commom")
    result = run("check", "a.tlog")
    assert (result.exit_code, "commom" in result.stderr) == (2, True)

    engine.answers["a.tlog"] = DialectError("no such dialect")
    assert run("check", "a.tlog").exit_code == 2

    def refuse(_directories: object) -> None:
        raise RuleFileError("mine.toml: detect.flag: column 3: unknown name")

    monkeypatch.setattr("mavframecheck.engine.load_pack", refuse)
    result = run("check", "a.tlog")
    assert (result.exit_code, "column 3" in result.stderr) == (2, True)


def test_formats(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Each format reaches standard output whole."""
    engine.answers["a.tlog"] = made_up.hostile()
    assert json.loads(run("check", "a.tlog", "--format", "json").stdout_bytes)["version"]
    lines = run("check", "a.tlog", "--format", "jsonl").stdout_bytes.splitlines()
    assert [json.loads(line)["type"] for line in lines] == ["finding", "file"]
    assert "rules ran" in run("check", "a.tlog").stdout


def test_hostile_file_name_in_an_error(engine: FakeEngine, logs: Path, run: Run) -> None:
    """A name may clear the screen of whoever reads the error."""
    name = "\x1b[2J.tlog"
    (logs / name).write_bytes(b"\0")
    engine.answers[name] = SourceError(f"{name}: is empty")
    result = run("check", name)
    assert "\x1b" not in result.output
    assert r"\x1b[2J.tlog: is empty" in result.stderr
