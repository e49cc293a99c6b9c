"""Every shipped rule explains itself, and does on its own examples what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mavframecheck.engine.compiled import bind
from mavframecheck.engine.examples import run_example
from mavframecheck.engine.expression import Expression
from mavframecheck.engine.pack import compile_rule, read_rule, rule_files, source_folder
from mavframecheck.model import Example, Rule
from mavframecheck.wire import load_dialect
from tests.strategies import DIALECT

MESSAGES = set(DIALECT.by_name) | set(load_dialect("all").by_name)
"""Rules also name messages of dialects that a user may choose."""
FILES = rule_files(source_folder())
RULES: list[tuple[Rule, Path]] = [(read_rule(file)[0], file) for file in FILES]
EXAMPLES = [
    pytest.param(one, example, id=f"{one.code}-{k}-{example.expect}")
    for one, _ in RULES
    for k, example in enumerate(one.example)
]
FOLDER = {
    "0": "stream",
    "1": "frames",
    "2": "altitude",
    "3": "units",
    "4": "axes",
    "5": "external",
    "6": "sentinels",
    "7": "origin",
    "8": "time",
}
"""First digit of a code -> folder of its family, as far as there are rules."""

each = pytest.mark.parametrize(("one", "file"), RULES, ids=lambda v: getattr(v, "code", ""))


@each
def test_name_and_place(one: Rule, file: Path) -> None:
    """`rules/<family>/MFCnnn-name.toml`."""
    assert re.fullmatch(r"MFC\d{3}", one.code)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)+", one.name)
    assert file.name == f"{one.code}-{one.name}.toml"
    assert file.parent.name == FOLDER.get(one.code[3], file.parent.name)


def test_codes_and_names_are_unique() -> None:
    for key in ("code", "name", "summary"):
        found = [getattr(one, key) for one, _ in RULES]
        assert len(found) == len(set(found)), key


@each
def test_it_explains_itself(one: Rule, file: Path) -> None:
    """Summary, text, why, fix and references, in sentences."""
    explain = one.explain
    for words in (one.summary, explain.text, explain.why.strip(), explain.fix):
        assert words
        assert words[0] == words[0].lstrip()
        assert words.rstrip()[-1] in ".}:?!", words
    assert explain.references
    assert all(explain.references)
    assert {example.expect for example in one.example} == {"bad", "good"}


@each
def test_thresholds_are_used_and_have_a_unit_or_are_explained(one: Rule, file: Path) -> None:
    """A parameter that nothing reads is a mistake; its unit stands in the name or beside it."""
    text = file.read_text("utf-8")
    rest = text.split("[params]", 1)[-1] + text.split("[params]", 1)[0]
    for name in one.params:
        used_elsewhere = len(re.findall(rf"\b{name}\b", rest)) > 1
        assert used_elsewhere or one.detect.check, name


@each
def test_fields_and_messages_exist(one: Rule, file: Path) -> None:
    """Messages are those of the dialect, and each expression reads fields that they have."""
    compiled = compile_rule(one, {}, str(file))
    for message in one.applies.message:
        assert message.lstrip("!") in MESSAGES, message
    if one.detect.check:
        return
    bindings = [b for name in DIALECT.by_name for b in bind(compiled, name)]
    assert bindings
    asked = [compiled.when, compiled.flag, compiled.worst, *compiled.lets.values()]
    fields = {f for expression in asked if expression for f in _fields(expression)}
    for name in fields:
        assert any(_has(binding.message, binding.resolve(name)[0]) for binding in bindings), name


def _fields(expression: Expression) -> set[str]:
    """Return the names in raw(), si(), used() and the like."""
    return set(re.findall(r"\b(?:raw|si|used|ignored|unknown|present)\((\w+)\)", expression.source))


def _has(message: str, field: str) -> bool:
    return field in DIALECT.by_name[message].by_name


@pytest.mark.parametrize(("one", "example"), EXAMPLES)
def test_examples(one: Rule, example: Example) -> None:
    """A bad example makes the rule speak, with all texts filled in; a good one does not.

    A good one that the rule cannot judge, for lack of data, shows nothing.
    """
    report, findings = run_example(one, example, f"{one.code}.toml")
    run = next(run for run in report.runs if run.code == one.code)
    assert {f.code for f in findings} == ({one.code} if example.expect == "bad" else set())
    for found in findings:
        assert found.text
        assert found.fix
        for words in (found.text, found.fix):
            assert not re.search(r"\bnan\b|\{|\}|\bunknown unknown\b", words), words
        assert found.evidence["expected"] is not None
        assert found.evidence["observed"] is not None
        assert found.location is not None
    if example.expect == "bad":
        assert run.status == "ran"
    assert report.damage_total == 0 or one.code.startswith("MFC00")
