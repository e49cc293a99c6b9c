"""`--format github`: annotations of GitHub Actions, the worst first; chosen by itself there.

GitHub shows ten of each level in a step and drops the rest without a word: here they are counted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from mavframecheck.model import Finding, Severity
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.places import line, shown
from mavframecheck.report.verdict import Census, judged
from mavframecheck.report.words import plural

MOST = 10
"""Annotations of one level that GitHub shows of a step."""
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}


def render(results: Iterable[Checked], context: Context) -> Iterator[str]:
    """Yield the annotations once the last file is judged, then what was found and judged."""
    census = Census()
    findings = [finding for checked in census.count(results) for finding in checked.findings]
    for severity in Severity:
        yield from _level([each for each in findings if each.severity is severity], severity)
    for remark in context.remarks:
        where = {"file": shown(remark.path)} if remark.path is not None else {}
        yield command("error" if where else "warning", remark.text, {"title": "not judged"} | where)
    yield f"{census.total}\n{judged(census.files, verbose=True)}\n"


def _level(findings: Sequence[Finding], severity: Severity) -> Iterator[str]:
    for finding in findings[:MOST]:
        properties = {
            "title": f"{finding.code} {finding.name}",
            "file": shown(finding.file),
            "line": str(line(finding)),
        }
        yield command(LEVELS[severity], _message(finding), properties)
    if len(findings) > MOST:
        more = f"{plural(len(findings) - MOST, f'more {severity}')} not shown as an annotation:"
        yield f"{more}\n"
        for finding in findings[MOST:]:
            place = f"{finding.file}: {finding.code} {finding.name} {finding.subject}"
            yield f"  {sentence(place)}\n"


def _message(finding: Finding) -> str:
    subject = f"{finding.subject}: " if finding.subject else ""
    often = f" ({finding.count} times)" if finding.count > 1 else ""
    return f"{subject}{finding.text}{often} Fix: {finding.fix}"


def command(level: str, message: str, properties: dict[str, str]) -> str:
    """Return a workflow command in which nothing of the text can end it or start another."""
    pairs = ",".join(f"{key}={_property(value)}" for key, value in properties.items())
    return f"::{level} {pairs}::{_data(message)}\n"


def _data(text: str) -> str:
    return sentence(text).replace("%", "%25")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
