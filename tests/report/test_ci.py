"""What CI services read: JUnit by its parser, GitHub and GitLab by their documented shapes."""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import Any

import jsonschema
import pytest
from junitparser import Error, Failure, JUnitXml, Skipped

from mavframecheck.model import Severity
from mavframecheck.report import Checked, Context, Remark, concise, github, gitlab, junit
from tests.report import made_up

CONTEXT = Context("0.1.0", rules=made_up.rules())

# https://docs.gitlab.com/ci/testing/code_quality/#code-quality-report-format
CODE_QUALITY = {
    "type": "array",
    "items": {
        "type": "object",
        "required": ["description", "check_name", "fingerprint", "severity", "location"],
        "properties": {
            "description": {"type": "string", "minLength": 1},
            "check_name": {"type": "string", "minLength": 1},
            "fingerprint": {"type": "string", "minLength": 1},
            "severity": {"enum": ["info", "minor", "major", "critical", "blocker"]},
            "location": {
                "type": "object",
                "required": ["path", "lines"],
                "properties": {
                    "path": {"type": "string", "pattern": "^(?!\\./)"},
                    "lines": {
                        "type": "object",
                        "required": ["begin"],
                        "properties": {"begin": {"type": "integer", "minimum": 1}},
                    },
                },
            },
        },
    },
}


def read_junit(*results: Checked, context: Context = CONTEXT) -> JUnitXml:
    """Return what a JUnit parser makes of the report."""
    return JUnitXml.fromstring(b"".join(junit.render(results, context)))


def test_junit_says_how_each_rule_ended() -> None:
    """Failed, passed, or skipped with the reason; counts are those that the parser finds."""
    xml = read_junit(made_up.flight(), made_up.clean())
    suites = list(xml)
    cases = {case.name.split()[0]: case for case in suites[0]}
    assert isinstance(cases["MFC302"].result[0], Failure)
    assert "Multiply latitude" in cases["MFC302"].result[0].text
    assert cases["MFC001"].is_passed
    (skipped,) = cases["MFC202"].result
    assert isinstance(skipped, Skipped)
    assert skipped.message.startswith("insufficient data: no home position")
    assert cases["MFC003"].is_passed, "information is no failure"
    assert "never arrived" in cases["MFC003"].system_out
    ends = Counter(type(end) for suite in suites for case in suite for end in case.result)
    assert xml.tests == sum(len(list(suite)) for suite in suites)
    assert (xml.failures, xml.errors, xml.skipped) == (ends[Failure], ends[Error], ends[Skipped])


def test_junit_fails_by_fail_on() -> None:
    """A warning is a failure only where the user says so."""
    warning = Checked(made_up.file(), (made_up.mask(),))
    assert read_junit(warning).failures == 1
    assert read_junit(warning, context=CONTEXT._replace(fail_on=Severity.ERROR)).failures == 0


def test_junit_shows_files_that_cannot_be_read() -> None:
    """An error, not a missing line."""
    context = CONTEXT._replace(remarks=(Remark("is a PX4 ULog", "a.ulg"), Remark("unused")))
    xml = read_junit(made_up.clean(), context=context)
    assert xml.errors == 1
    (case,) = list(xml)[-1]
    assert isinstance(case.result[0], Error)
    assert (case.classname, case.result[0].message) == ("a.ulg", "is a PX4 ULog")


def obeyed(text: str) -> list[dict[str, str]]:
    """Read workflow commands as the runner of GitHub Actions does."""

    def decode(value: str) -> str:
        for code, character in (("%3A", ":"), ("%2C", ","), ("%0D", "\r"), ("%0A", "\n")):
            value = value.replace(code, character)
        return value.replace("%25", "%")

    found = []
    for line in text.splitlines():
        match = re.match(r"::(\w+) (.*?)::(.*)$", line)
        if match:
            pairs = (pair.split("=", 1) for pair in match[2].split(","))
            properties = {key: decode(value) for key, value in pairs}
            found.append({"level": match[1], "message": decode(match[3]), **properties})
    return found


def test_github_annotations_come_worst_first() -> None:
    """Level, title, file and line are those of the finding."""
    info = Checked(made_up.file(), (made_up.stream_rule(), made_up.mask(), made_up.finding()))
    found = obeyed("".join(github.render((info,), CONTEXT)))
    assert [each["level"] for each in found] == ["error", "warning", "notice"]
    assert found[0]["title"] == "MFC302 degrees-in-scaled-field"
    assert (found[0]["file"], found[0]["line"]) == ("flight.tlog", "1")
    assert found[0]["message"].endswith("Fix: " + made_up.finding().fix)


def test_github_text_cannot_end_its_annotation() -> None:
    """Percent signs, commas, colons and line ends arrive as they were, or as escapes."""
    tricky = made_up.finding(file="a,b:c%0A::error.tlog", text="50%,\n::warning::x", name="n,m:k")
    text = "".join(github.render((Checked(made_up.file(), (tricky,)),), CONTEXT))
    (only,) = obeyed(text)
    assert only["file"] == r"a,b:c%0A\x3a:error.tlog"
    assert only["title"] == "MFC302 n,m:k"
    assert r"50%, \x3a:warning\x3a:x" in only["message"]


def test_github_counts_what_it_does_not_show() -> None:
    """GitHub drops all beyond ten of a level without a word."""
    many = Checked(made_up.file(), tuple(made_up.finding() for _ in range(13)))
    text = "".join(github.render((many,), CONTEXT))
    assert len(obeyed(text)) == 10
    assert "3 more errors not shown as an annotation:" in text
    assert "1 file: 13 errors" in text


def test_github_says_what_was_not_read() -> None:
    """An unreadable file is an error, an unused setting a warning."""
    context = CONTEXT._replace(remarks=(Remark("is a PX4 ULog", "a.ulg"), Remark("unused")))
    found = obeyed("".join(github.render((made_up.clean(),), context)))
    assert [(x["level"], x["message"]) for x in found] == [
        ("error", "is a PX4 ULog"),
        ("warning", "unused"),
    ]


def test_gitlab_follows_the_documented_shape() -> None:
    """Every issue has what GitLab needs, and a fingerprint of its own."""
    results = (made_up.flight(), made_up.flight(), made_up.hostile())
    issues: Any = json.loads(b"".join(gitlab.render(results, CONTEXT)))
    jsonschema.validate(issues, CODE_QUALITY)
    prints = [issue["fingerprint"] for issue in issues]
    assert len(set(prints)) == len(prints) == 9
    again = json.loads(b"".join(gitlab.render(results, CONTEXT)))
    assert [issue["fingerprint"] for issue in again] == prints


def test_concise_is_one_line_a_finding() -> None:
    """Place, severity, code, name, stream, text; the verdict at the end."""
    mission = Checked(made_up.file(path="m.plan"), (made_up.mission_item(),))
    *lines, last = "".join(concise.render((made_up.flight(), mission), CONTEXT)).splitlines()
    assert len(lines) == 5
    place = "flight.tlog:123456: error MFC302 degrees-in-scaled-field 1/191 "
    assert any(line.startswith(place) for line in lines)
    assert lines[-1].startswith("field.waypoints:5:71: warning MFC204 ")
    assert last.startswith("2 files: 2 errors, 2 warnings, 1 info; ")


@pytest.mark.parametrize("form", [concise, github])
def test_verdict_is_there_without_findings(form: Any) -> None:
    """Silence must not read as a pass."""
    last = "".join(form.render((made_up.clean(),), CONTEXT)).splitlines()[-1]
    assert "rules ran" in last or "rule ran" in last
