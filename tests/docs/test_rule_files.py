"""`docs/rule-files.md` names everything that a rule file may hold, and its worked example works."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest
from click.testing import CliRunner

from mavframecheck.cli import main
from mavframecheck.engine.compiled import OWN_NAMES
from mavframecheck.engine.examples import run_example
from mavframecheck.engine.functions import FIELD_FUNCTIONS, FUNCTIONS
from mavframecheck.engine.pack import load_pack
from mavframecheck.model import Example, Rule, Step
from mavframecheck.model.rule import (
    Applies,
    Detect,
    Explain,
    Persist,
    ProofLines,
    SeverityWhen,
)
from mavframecheck.vehicle import NAMES
from samples.make import HERE

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "rule-files.md").read_text("utf-8")
CODE = set(re.findall(r"`([^`\n]+)`", PAGE))
"""What stands between backticks."""
CALLED = {call for code in CODE for call in re.findall(r"^(\w+)(?:$|\()", code)}
TABLES = re.findall(r"`\[\[?(\w+)\]\]?`", PAGE)
WORKED = re.search(r"```toml\n(code = .*?)```", PAGE, re.DOTALL)
OWN_SYNTAX = {"known", "maybe", "stack", "listed"}
"""Functions that the compiler knows itself."""


@pytest.mark.parametrize("name", sorted(NAMES))
def test_context_names(name: str) -> None:
    """Every context name is there."""
    assert name in CODE


@pytest.mark.parametrize("name", sorted({*FUNCTIONS, *FIELD_FUNCTIONS, *OWN_SYNTAX}))
def test_functions(name: str) -> None:
    """Every function is there."""
    assert name in CALLED


def test_no_other_functions() -> None:
    """What reads as a call of a function is one that there is."""
    calls = {call for code in CODE for call in re.findall(r"\b([a-z]\w*)\(", code)}
    assert calls <= {*FUNCTIONS, *FIELD_FUNCTIONS, *OWN_SYNTAX}


def test_own_names() -> None:
    """So are the names that every rule knows."""
    assert OWN_NAMES <= CODE


@pytest.mark.parametrize(
    "part", [Rule, Applies, Detect, Persist, SeverityWhen, ProofLines, Explain, Example, Step]
)
def test_keys(part: type[msgspec.Struct]) -> None:
    """So is every key of every table."""
    known = {word for code in CODE for word in re.findall(r"\w+", code)} | set(TABLES)
    assert {field.encode_name for field in msgspec.structs.fields(part)} <= known


@pytest.fixture
def my_rules(tmp_path: Path) -> Path:
    """Return a directory with the rule of the page."""
    assert WORKED is not None
    (tmp_path / "FLY001-above-our-ceiling.toml").write_text(WORKED[1], "utf-8")
    return tmp_path


def test_worked_example(my_rules: Path) -> None:
    """The rule of the page loads beside the shipped ones, and its examples do what they say."""
    pack = load_pack([my_rules])
    rule = pack.by_code["FLY001"]
    for example in rule.example:
        _, findings = run_example(rule, example, pack.sources["FLY001"])
        assert bool(findings) == (example.expect == "bad")


def test_worked_example_on_the_command_line(my_rules: Path) -> None:
    """It judges a recording with the options of the page, and a slip names file, key and column."""
    command = ["check", "--rules", str(my_rules), "--select", "FLY"]
    flight = str(HERE / "clean_copter.tlog")
    assert CliRunner().invoke(main, [*command, flight]).exit_code == 0
    file = next(my_rules.iterdir())
    file.write_text(file.read_text("utf-8").replace("> ceiling_m", "> ceiling"), "utf-8")
    result = CliRunner().invoke(main, [*command, flight])
    assert result.exit_code == 2
    said = " ".join(result.output.split())
    assert "detect.flag, column 44: unknown name 'ceiling'" in said
    assert "detect.flag, column 44: unknown name 'ceiling'" in PAGE
