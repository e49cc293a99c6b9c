"""`--format sarif`: SARIF 2.1.0, for code scanning services and editors.

A recording is binary: a region has the bytes, and line 1 because GitHub refuses a region without a
line. With ``--verbose`` a rule that judged nothing is a result of kind ``notApplicable`` or ``open``,
and a suppressed finding is one with ``suppressions``. Not without: GitHub takes every result, of
whatever kind, for an alert.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

from mavframecheck.model import (
    ByteLocation,
    FileReport,
    Finding,
    MissionLocation,
    Rule,
    RuleRun,
    Severity,
    Suppressed,
)
from mavframecheck.report import Checked, Context, Remark
from mavframecheck.report.escape import markdown, sentence
from mavframecheck.report.json import document
from mavframecheck.report.places import uri
from mavframecheck.report.verdict import furthest

SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
FINGERPRINT = "mavframecheck/v1"
"""Name of the fingerprint in ``partialFingerprints``; another way to make it gets another number."""
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
_FIRST_LINE = {"startLine": 1}
_KINDS = {"not-applicable": "notApplicable", "insufficient-data": "open"}
_LINK = re.compile(r"https?://[^\s<>()\"'\\^`{|}]+")


def render(results: Iterable[Checked], context: Context) -> Iterator[bytes]:
    """Yield the log once the last file is judged."""
    checked = list(results)
    files = [each.file for each in checked]
    rules = {rule.code: number for number, rule in enumerate(context.rules)}
    found = [_result(one, rules) for each in checked for one in each.findings]
    if context.verbose:
        found += [_aside(one, rules) for each in checked for one in each.suppressed]
        found += _not_judged(files, rules)
    run = {
        "tool": {"driver": _driver(context)},
        "invocations": [_invocation(context.remarks)],
        "artifacts": [_artifact(file) for file in files],
        "results": found,
    }
    yield document({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


# ---- the tool and its rules ----


def _driver(context: Context) -> dict[str, Any]:
    return {
        "name": "mavframecheck",
        "version": context.version,
        "semanticVersion": context.version,
        "rules": [_rule(rule) for rule in context.rules],
    }


def _rule(rule: Rule) -> dict[str, Any]:
    return {
        "id": sentence(rule.code),
        "name": sentence(rule.name),
        "shortDescription": {"text": _text(rule.summary)},
        "fullDescription": {"text": _text(rule.explain.why)},
        "help": {
            "text": _text(f"{rule.explain.why} Fix: {rule.explain.fix}"),
            "markdown": _help(rule),
        },
        "defaultConfiguration": {"level": LEVELS[rule.severity]},
        "properties": {
            "tags": ["mavlink", sentence(rule.family)],
            "precision": rule.confidence,
            "problem.severity": {"note": "recommendation"}.get(
                LEVELS[rule.severity], LEVELS[rule.severity]
            ),
        },
    }


def _help(rule: Rule) -> str:
    """Return what the rule is about, why it matters and how to mend it, in Markdown."""
    parts = [
        f"**{markdown(rule.summary)}**",
        *_paragraphs(rule.explain.why),
        "### How to mend it",
        *_paragraphs(rule.explain.fix),
    ]
    if rule.explain.references:
        parts += ["### References", "\n".join(f"- {_link(x)}" for x in rule.explain.references)]
    return "\n\n".join(parts)


def _paragraphs(text: str) -> list[str]:
    return [markdown(paragraph) for paragraph in text.strip().split("\n\n")]


def _link(reference: str) -> str:
    """Return a reference, as a link when all of it is a plain address."""
    return f"<{reference}>" if _LINK.fullmatch(reference) else markdown(reference)


# ---- results ----


def _result(finding: Finding, rules: dict[str, int]) -> dict[str, Any]:
    often = f" ({finding.count} times)" if finding.count > 1 else ""
    return {
        **_reference(finding.code, rules),
        "level": LEVELS[finding.severity],
        "message": {"text": _text(f"{finding.text}{often} Fix: {finding.fix}")},
        "locations": [_location(finding)],
        "partialFingerprints": {FINGERPRINT: finding.fingerprint},
        "properties": {
            "confidence": finding.confidence,
            "count": finding.count,
            "utc_first": finding.utc_first,
            "utc_last": finding.utc_last,
            "related": finding.related,
            "evidence": finding.evidence,
        },
    }


def _aside(suppressed: Suppressed, rules: dict[str, int]) -> dict[str, Any]:
    reason = {"kind": "external", "status": "accepted", "justification": suppressed.reason}
    return _result(suppressed.finding, rules) | {"suppressions": [reason]}


def _not_judged(files: Sequence[FileReport], rules: dict[str, int]) -> Iterator[dict[str, Any]]:
    """Yield a result for each rule that judged no file of the run."""
    for code, run in sorted(furthest(chain.from_iterable(file.runs for file in files)).items()):
        if run.status != "ran":
            yield _idle(code, run, rules) | {"locations": [_beginning(files[0].path)]}


def _idle(code: str, run: RuleRun, rules: dict[str, int]) -> dict[str, Any]:
    reason = run.reason or run.status.replace("-", " ")
    return {
        **_reference(code, rules),
        "kind": _KINDS[run.status],
        "level": "none",
        "message": {"text": _text(reason)},
    }


def _reference(code: str, rules: dict[str, int]) -> dict[str, Any]:
    index = {"ruleIndex": rules[code]} if code in rules else {}
    return {"ruleId": sentence(code), **index}


def _location(finding: Finding) -> dict[str, Any]:
    place: dict[str, Any] = {
        "physicalLocation": {
            "artifactLocation": {"uri": uri(finding.file)},
            "region": _region(finding),
        }
    }
    if finding.subject:
        place["logicalLocations"] = [{"fullyQualifiedName": sentence(finding.subject)}]
    return place


def _beginning(path: str) -> dict[str, Any]:
    return {"physicalLocation": {"artifactLocation": {"uri": uri(path)}, "region": _FIRST_LINE}}


def _region(finding: Finding) -> dict[str, int]:
    match finding.location:
        case ByteLocation(offset=offset, length=length):
            return _FIRST_LINE | {"byteOffset": offset, "byteLength": length}
        case MissionLocation(line=int(line), column=column):
            return {"startLine": line} | ({} if column is None else {"startColumn": column})
    return _FIRST_LINE


def _artifact(file: FileReport) -> dict[str, Any]:
    return {
        "location": {"uri": uri(file.path)},
        "roles": ["analysisTarget"],
        "properties": {"kind": file.kind, "messages": file.messages, "notes": file.notes},
    }


def _invocation(remarks: Sequence[Remark]) -> dict[str, Any]:
    """Return whether all files could be read, and what the user's settings are warned of."""
    unreadable = [_unreadable(each) for each in remarks if each.path is not None]
    settings = [_notification(each, "warning") for each in remarks if each.path is None]
    return {
        "executionSuccessful": not unreadable,
        "toolExecutionNotifications": unreadable,
        "toolConfigurationNotifications": settings,
    }


def _unreadable(remark: Remark) -> dict[str, Any]:
    return _notification(remark, "error") | {"locations": [_beginning(remark.path or "")]}


def _notification(remark: Remark, level: str) -> dict[str, Any]:
    return {"level": level, "message": {"text": _text(remark.text)}}


def _text(text: str) -> str:
    """Return a plain message: brackets would be a link, braces a place to fill in."""
    escaped = re.sub(r"[\\\[\]]", r"\\\g<0>", sentence(text))
    return escaped.replace("{", "{{").replace("}", "}}")
