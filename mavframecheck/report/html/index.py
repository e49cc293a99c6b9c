"""The index of a batch: a row for each recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple, Self

from mavframecheck.model import Severity
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.html.frame import fill
from mavframecheck.report.verdict import found
from mavframecheck.report.words import component, duration, plural, utc


class Entry(NamedTuple):
    """A recording in the index."""

    path: str
    link: str | None
    """Of its page, relative to the index."""
    errors: int
    warnings: int
    infos: int
    codes: str
    """Rules that found something, the worst first."""
    vehicles: str
    duration_s: float | None
    duration: str
    began: str
    time_start: float | None
    messages: int
    damaged: int
    """Bytes that belong to no good frame."""

    @classmethod
    def of(cls, checked: Checked) -> Self:
        """Return the row of a recording, without a link."""
        file = checked.file
        counts = Counter(finding.severity for finding in checked.findings)
        worst_first = sorted(checked.findings, key=lambda each: -each.severity.rank)
        autopilots = [component(v) for v in file.vehicles if v.role == "autopilot"]
        return cls(
            path=sentence(file.path),
            link=None,
            errors=counts[Severity.ERROR],
            warnings=counts[Severity.WARNING],
            infos=counts[Severity.INFO],
            codes=", ".join(dict.fromkeys(finding.code for finding in worst_first)),
            vehicles=", ".join(dict.fromkeys(autopilots)),
            duration_s=file.duration_s,
            duration="" if file.duration_s is None else duration(file.duration_s),
            began="" if file.time_start is None else utc(file.time_start),
            time_start=file.time_start,
            messages=file.messages,
            damaged=file.skipped_bytes,
        )


def _common(paths: Sequence[str]) -> str:
    """Return the folder that all recordings lie in, with its separator; empty where they lie apart."""
    folders = {path[: max(path.rfind("/"), path.rfind("\\")) + 1] for path in paths}
    return folders.pop() if len(folders) == 1 else ""


def index_of(entries: Sequence[Entry], context: Context) -> str:
    """Return the page that lists recordings."""
    counts = Counter(
        {
            Severity.ERROR: sum(each.errors for each in entries),
            Severity.WARNING: sum(each.warnings for each in entries),
            Severity.INFO: sum(each.infos for each in entries),
        }
    )
    folder = _common([each.path for each in entries])
    wrong = sum(bool(each.errors or each.warnings) for each in entries)
    total = plural(len(entries), "recording")
    return fill(
        "index.html.j2",
        scripts=("page.js",),
        styles=("page.css",),
        data={},
        title=total,
        folder=folder,
        verdict=f"{wrong} of {total} with errors or warnings: {found(+counts)}.",
        counts={each.value: counts[each] for each in Severity},
        entries=sorted(entries, key=lambda e: (-e.errors, -e.warnings, -e.infos, e.path)),
        version=context.version,
    )
