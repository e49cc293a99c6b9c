"""What reports for people say of a finding: when, where, and by which values it is known."""

from __future__ import annotations

from mavframecheck.model import ByteLocation, FileReport, Finding, MissionLocation
from mavframecheck.report.escape import sentence
from mavframecheck.report.words import elapsed, is_number, scalar


def when(finding: Finding, file: FileReport) -> str:
    """Return how often, time since the start of the recording and UTC, and where in the file."""
    often = f"{finding.count} times" if finding.count > 1 else "once"
    times = [t for t in (finding.time_first, finding.time_last) if t is not None]
    since = _span([elapsed(t - (file.time_start or t)) for t in times], "at ", "from ")
    clock = _clock(finding.utc_first, finding.utc_last)
    when = " ".join(filter(None, (often, since, f"({clock} UTC)" if clock else "")))
    return ", ".join(filter(None, (when, where(finding))))


def _span(ends: list[str], one: str = "", two: str = "") -> str:
    """Return ``a to b`` after the word `two`, or ``a`` after `one` when both are the same."""
    distinct = list(dict.fromkeys(ends))
    word = two if len(distinct) > 1 else one
    return word + " to ".join(distinct) if distinct else ""


def _clock(first: str | None, last: str | None) -> str:
    """Return two UTC times to the second, their common day written once."""
    ends = [
        text.replace("T", " ").removesuffix("Z").split(".")[0] for text in (first, last) if text
    ]
    if len(ends) == 2 and ends[0] != ends[1] and ends[0][:11] == ends[1][:11]:
        ends[1] = ends[1][11:]
    return _span(ends)


def where(finding: Finding) -> str:
    """Return the byte of the first hit, or line and item of a mission."""
    match finding.location:
        case ByteLocation(offset=offset):
            return f"first at byte {offset}" if finding.count > 1 else f"byte {offset}"
        case MissionLocation(line=line, column=column, item=item, command=command):
            parts = (
                f"line {line}" if line is not None else "",
                f"column {column}" if column is not None else "",
                f"item {item}" if item is not None else "",
                command or "",
            )
            return ("first in " if finding.count > 1 else "") + ", ".join(filter(None, parts))
    return ""


def evidence_rows(finding: Finding) -> list[tuple[str, str]]:
    """Return labels and values: expected and observed with their unit, the rest, the remedy."""
    evidence = {key: scalar(value) for key, value in finding.evidence.items() if value is not None}
    unit = evidence.pop("unit", "")
    rows: list[tuple[str, str]] = []
    for key in ("expected", "observed"):
        if key in evidence:
            value = evidence.pop(key)
            rows.append((key, f"{value} {unit}".rstrip() if is_number(value) else value))
    if unit and not any(value.endswith(f" {unit}") for _, value in rows):
        rows.append(("unit", unit))
    rows += [(sentence(key), value) for key, value in evidence.items()]
    if finding.related:
        rows.append(("against", ", ".join(finding.related)))
    return [*rows, ("fix", finding.fix)]
