"""`--format gitlab`: a Code Quality report, shown by GitLab beside the changes of a merge request."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from mavframecheck.model import Finding, Severity
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.json import document
from mavframecheck.report.places import line, shown

LEVELS = {Severity.ERROR: "major", Severity.WARNING: "minor", Severity.INFO: "info"}


def render(results: Iterable[Checked], _context: Context) -> Iterator[bytes]:
    """Yield the report once the last file is judged."""
    seen: Counter[tuple[str, str]] = Counter()
    yield document([_issue(each, seen) for checked in results for each in checked.findings])


def _issue(finding: Finding, seen: Counter[tuple[str, str]]) -> dict[str, Any]:
    path = shown(finding.file)
    subject = f"{finding.subject}: " if finding.subject else ""
    seen[path, finding.fingerprint] += 1
    number = seen[path, finding.fingerprint]
    return {
        "description": sentence(f"{finding.code} {finding.name}: {subject}{finding.text}"),
        "check_name": sentence(finding.code),
        "fingerprint": _unique(path, finding.fingerprint, number),
        "severity": LEVELS[finding.severity],
        "location": {"path": path, "lines": {"begin": line(finding)}},
    }


def _unique(path: str, fingerprint: str, number: int) -> str:
    """Return a fingerprint that no other finding has: GitLab drops the second of two alike."""
    return hashlib.sha256(f"{path}|{fingerprint}|{number}".encode()).hexdigest()
