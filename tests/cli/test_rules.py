"""`rules` and `rule`: what can be found, and one explained."""

from __future__ import annotations

import json

import pytest

from mavframecheck import __version__
from tests.cli.conftest import FakeEngine, Run


def test_rules(engine: FakeEngine, run: Run) -> None:
    """People get a table, machines a list."""
    result = run("rules")
    assert result.exit_code == 0
    assert "MFC107" in result.stdout
    codes = [rule["code"] for rule in json.loads(run("rules", "--format", "json").stdout)]
    assert codes == ["MFC107", "MFC302"]


@pytest.mark.parametrize("word", ["MFC302", "mfc302", "degrees-in-scaled-field"])
def test_rule_by_code_or_name(engine: FakeEngine, run: Run, word: str) -> None:
    """Both are what findings show."""
    result = run("rule", word)
    assert result.exit_code == 0
    assert "Gulf of Guinea" in result.stdout
    assert json.loads(run("rule", word, "--format", "json").stdout)["code"] == "MFC302"


def test_unknown_rule(engine: FakeEngine, run: Run) -> None:
    """A near miss is guessed."""
    result = run("rule", "degree-in-scaled-field")
    assert result.exit_code == 2
    assert "Did you mean degrees-in-scaled-field?" in result.stderr


def test_group(run: Run) -> None:
    """Help names every command without importing one; the version is the package's."""
    shown = run("-h").stdout
    assert all(name in shown for name in ("check", "inspect", "rules", "rule"))
    assert __version__ in run("--version").stdout
    assert run("chek").exit_code == 2
