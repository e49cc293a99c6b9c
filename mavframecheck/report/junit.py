"""`--format junit`: a test suite a recording and a test case a rule, for CI services that show tests.

A rule that did not judge is a skipped test: it is no pass.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from xml.etree import ElementTree as ET

from mavframecheck.model import Finding, RuleRun
from mavframecheck.report import Checked, Context, Remark
from mavframecheck.report.escape import sentence
from mavframecheck.report.places import shown
from mavframecheck.report.verdict import furthest
from mavframecheck.report.words import plural

_COUNTED = {"tests": "testcase", "failures": "failure", "errors": "error", "skipped": "skipped"}


def render(results: Iterable[Checked], context: Context) -> Iterator[bytes]:
    """Yield the document once the last file is judged."""
    names = {rule.code: rule.name for rule in context.rules}
    root = ET.Element("testsuites", name="mavframecheck")
    for checked in results:
        root.append(_suite(checked, names, context))
    root.extend(_unreadable(remark) for remark in context.remarks if remark.path is not None)
    for element in (*root, root):
        _count(element)
    ET.indent(root)
    yield ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _count(element: ET.Element) -> None:
    """Write on a suite, or on all of them, how many of its tests ended how."""
    for name, tag in _COUNTED.items():
        element.set(name, str(sum(1 for _ in element.iter(tag))))


def _suite(checked: Checked, names: dict[str, str], context: Context) -> ET.Element:
    path = shown(checked.file.path)
    suite = ET.Element("testsuite", name=path)
    runs = furthest(checked.file.runs)
    found: dict[str, list[Finding]] = {}
    for finding in checked.findings:
        found.setdefault(finding.code, []).append(finding)
        names.setdefault(finding.code, finding.name)
    for code in sorted({*runs, *found}):
        name = sentence(f"{code} {names.get(code, '')}")
        case = ET.SubElement(suite, "testcase", classname=path, name=name, time="0")
        _fill(case, runs.get(code), found.get(code, ()), context)
    return suite


def _fill(
    case: ET.Element, run: RuleRun | None, findings: Sequence[Finding], context: Context
) -> None:
    """Say how a test case ended: failed, passed with remarks, skipped, or passed."""
    failing = [each for each in findings if each.severity.rank >= context.fail_on.rank]
    if failing:
        message = plural(len(failing), "finding")
        failure = ET.SubElement(case, "failure", type=failing[0].severity, message=message)
        failure.text = _body(failing)
    if len(findings) > len(failing):
        rest = [each for each in findings if each.severity.rank < context.fail_on.rank]
        ET.SubElement(case, "system-out").text = _body(rest)
    if not findings and run is not None and run.status != "ran":
        reason = f"{run.status.replace('-', ' ')}: {run.reason}"
        ET.SubElement(case, "skipped", message=sentence(reason))


def _body(findings: Sequence[Finding]) -> str:
    return "\n".join(
        sentence(f"{each.severity} {each.subject}: {each.text} ({plural(each.count, 'time')})")
        + "\n  Fix: "
        + sentence(each.fix)
        for each in findings
    )


def _unreadable(remark: Remark) -> ET.Element:
    """Return a suite whose only test is that the file can be read."""
    path = shown(remark.path or "")
    suite = ET.Element("testsuite", name=path)
    case = ET.SubElement(suite, "testcase", classname=path, name="can be read", time="0")
    ET.SubElement(case, "error", message=sentence(remark.text))
    return suite
