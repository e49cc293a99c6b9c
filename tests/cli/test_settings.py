"""The configuration file, the command line over it, baselines, and what is shown of both."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from mavframecheck.report import Checked
from tests.cli.conftest import FakeEngine, Run
from tests.report import made_up

ERROR = Checked(made_up.file(path="a.tlog"), (made_up.finding(), made_up.mask()))


def configure(text: str) -> None:
    """Write the configuration of the working directory."""
    Path("mavframecheck.toml").write_text(text, encoding="utf-8")


def test_configuration_becomes_settings(engine: FakeEngine, logs: Path, run: Run) -> None:
    """It reaches the engine; the command line replaces --select and adds to the rest."""
    configure(
        "select = ['MFC1']\nignore = ['MFC302']\nautopilot = 'px4'\ndialect = 'common'\n"
        "[params.MFC302]\nnear_km = 5\ntries = 9"
    )
    run("check", "a.tlog", "--ignore", "MFC107", "--set", "MFC302.near_km=2")
    settings = engine.settings
    assert (settings.select, settings.ignore) == (("MFC1",), ("MFC302", "MFC107"))
    assert (settings.autopilot, settings.dialect) == ("px4", "common")
    assert settings.overrides == {"MFC302": {"near_km": 2.0, "tries": 9}}
    run("check", "a.tlog", "--select", "MFC3", "--extend-select", "MFC1", "--dialect", "minimal")
    settings = engine.settings
    assert (settings.select, settings.extend_select) == (("MFC3",), ("MFC1",))
    assert settings.dialect == "minimal"


def test_isolated_and_config(engine: FakeEngine, logs: Path, run: Run) -> None:
    """`--isolated` looks for no file, `--config` takes the one that is named."""
    configure("preview = true")
    run("check", "a.tlog", "--isolated")
    assert not engine.settings.preview
    other = logs / "ci.toml"
    other.write_text("autopilot = 'ardusub'", encoding="utf-8")
    run("check", "a.tlog", "--config", str(other))
    assert (engine.settings.preview, engine.settings.autopilot) == (False, "ardusub")


def test_mistake_in_the_file_is_a_usage_error(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Exit 2, the file and the key named, nothing judged."""
    configure("extend-slect = ['MFC1']")
    result = run("check", "a.tlog")
    assert result.exit_code == 2
    assert "Did you mean extend-select" in " ".join(result.stderr.split())
    assert engine.checked == []


def test_policy_decides_the_exit_code(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Severities, ignores, suppressions and fail-on of the file count."""
    engine.answers["a.tlog"] = ERROR
    assert run("check", "a.tlog").exit_code == 1
    configure("fail-on = 'error'\n[severity]\nMFC302 = 'warning'")
    assert run("check", "a.tlog").exit_code == 0
    assert run("check", "a.tlog", "--fail-on", "warning").exit_code == 1
    configure("[per-stream-ignores]\n'1/191' = ['MFC']")
    assert run("check", "a.tlog").exit_code == 0


def test_suppressed_findings_are_counted_and_explained(
    engine: FakeEngine, logs: Path, run: Run
) -> None:
    """The text says how many, --verbose which and why, JSON all of it; an expired one is said."""
    engine.answers["a.tlog"] = ERROR
    suppression = "[[suppressions]]\nrule = 'MFC3'\nreason = 'mended in May'\n"
    expired = "[[suppressions]]\nrule = 'MFC1'\nreason = 'old'\nuntil = 2020-01-01\n"
    configure(suppression + expired)
    result = run("check", "a.tlog", "--verbose")
    assert "1 warning, 1 suppressed" in result.stdout
    text = " ".join(result.stdout.split())
    assert "SET_POSITION_TARGET_GLOBAL_INT.lat_int: mended in May (configuration)" in text
    assert "suppression of MFC1 expired on 2020-01-01; it was: old" in result.stderr
    report = json.loads(run("check", "a.tlog", "--format", "json").stdout)
    (suppressed,) = report["suppressed"]
    assert (suppressed["by"], suppressed["reason"]) == ("configuration", "mended in May")
    assert [x["code"] for x in report["findings"]] == ["MFC107"]


def test_baseline_from_beginning_to_end(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Written, clean, something new, something gone."""
    ran = made_up.file(path="a.tlog")
    engine.answers["a.tlog"] = Checked(ran, (made_up.finding(),))
    learn = run("check", "a.tlog", "--baseline", "known.json", "--update-baseline")
    assert (learn.exit_code, "known.json: now 1 known finding" in learn.stderr) == (0, True)
    assert run("check", "a.tlog", "--baseline", "known.json").exit_code == 0
    engine.answers["a.tlog"] = ERROR
    new = run("check", "a.tlog", "--baseline", "known.json", "--format", "concise")
    assert new.exit_code == 1
    assert "MFC107" in new.stdout
    assert "MFC302" not in new.stdout
    engine.answers["a.tlog"] = Checked(ran, ())
    configure("baseline = 'known.json'")
    gone = run("check", "a.tlog")
    assert gone.exit_code == 0
    assert "MFC302 on 1/191 SET_POSITION_TARGET_GLOBAL_INT.lat_int no longer" in gone.stderr


def test_baseline_is_not_written_from_half_a_run(engine: FakeEngine, logs: Path, run: Run) -> None:
    """What could not be read may hold what the baseline knows."""
    engine.answers["b.tlog"] = PermissionError(13, "Permission denied")
    options = ("--baseline", "known.json", "--update-baseline")
    assert run("check", "a.tlog", "b.tlog", *options).exit_code == 2
    engine.answers["b.tlog"] = KeyboardInterrupt()
    assert run("check", "a.tlog", "b.tlog", *options).exit_code == 130
    assert not Path("known.json").exists()
    del engine.answers["b.tlog"]
    unwritten = run("check", "a.tlog", "--baseline", "no/known.json", "--update-baseline")
    assert (unwritten.exit_code, "cannot be written" in unwritten.stderr) == (2, True)
    assert run("check", "a.tlog", "--update-baseline").exit_code == 2


def test_shown_settings_are_a_configuration_file(engine: FakeEngine, logs: Path, run: Run) -> None:
    """What is shown can be saved and means the same."""
    configure(
        "fail-on = 'error'\n[per-file-ignores]\n'bench/*' = ['MFC1']\n[params.MFC302]\n"
        "strict = false\n[[suppressions]]\nrule = 'MFC302'\nreason = 'a \"b\"'\nuntil = 2030-01-31"
    )
    shown = run("check", "--show-settings", "--select", "MFC3").stdout
    assert shown.startswith(f"# {logs / 'mavframecheck.toml'}\n")
    values = tomllib.loads(shown)
    assert (values["fail-on"], values["select"]) == ("error", ["MFC3"])
    configure(shown)
    assert tomllib.loads(run("check", "--show-settings").stdout) == values
    assert engine.checked == []


def test_statistics_instead_of_findings(engine: FakeEngine, logs: Path, run: Run) -> None:
    """Which rule, how many, in how many files, by whom."""
    engine.answers |= {"a.tlog": ERROR, "b.tlog": Checked(made_up.file(), (made_up.mask(),))}
    lines = run("check", "a.tlog", "b.tlog", "--statistics").stdout.splitlines()
    assert lines[:4] == [
        "error    MFC302 degrees-in-scaled-field",
        "    1 finding in 1 of 2 files, sent by 1/191",
        "warning  MFC107 unmasked-zero-yaw",
        "    2 findings in 2 of 2 files, sent by 1/191",
    ]
    assert lines[4] == "2 files: 1 error, 2 warnings"


def test_github_is_chosen_in_github_actions(
    engine: FakeEngine, logs: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And only while no format is named."""
    engine.answers["a.tlog"] = ERROR
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    assert run("check", "a.tlog").stdout.startswith("::error title=MFC302")
    assert not run("check", "a.tlog", "--format", "text").stdout.startswith("::")


def test_junit_fails_where_the_exit_code_does(engine: FakeEngine, logs: Path, run: Run) -> None:
    """`--fail-on` reaches the formats, and so do files that cannot be read."""
    engine.answers |= {"a.tlog": ERROR, "b.tlog": PermissionError(13, "Permission denied")}
    text = run("check", "a.tlog", "b.tlog", "--format", "junit", "--fail-on", "error").stdout
    assert text.count("<failure") == 1
    assert '<error message="Permission denied"' in text
