"""What `watch` says as it happens: lines for people, one JSON object a line for programs."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

from mavframecheck.model.live import Change, Event
from mavframecheck.report.escape import terminal
from mavframecheck.report.jsonl import line
from mavframecheck.report.layout import SEVERITY_COLOURS, Page
from mavframecheck.report.words import plural

_INDENT = " " * 9


def json_line(said: Change | Event) -> bytes:
    """Return a change of a finding, or an event, as one JSON object."""
    return line("change" if isinstance(said, Change) else "event", said)


def plain_lines(said: Change | Event, page: Page, *, links: bool) -> Iterator[str]:
    """Yield the lines of a change or an event; `links`: there are several, so say which one.

    That a finding goes on is not worth a line.
    """
    link = f"{terminal(said.link)} " if links else ""
    start = f"{clock(said.time)} {link}"
    if isinstance(said, Event):
        yield from page.wrap(f"{said.what}: {said.text}", start, _INDENT)
        return
    finding = said.finding
    if said.what == "updated":
        return
    if said.what not in ("found", "worse"):
        count = plural(finding.count, "time")
        what = f"{said.what} {finding.code} {finding.subject}: {count} so far"
        yield from page.wrap(what, start, _INDENT)
        return
    title = f"{finding.severity} {finding.code} {finding.subject}"
    first, *rest = page.wrap(f"{title}: {finding.text}", start, _INDENT)
    word = str(finding.severity)
    yield first.replace(word, page.paint(word, SEVERITY_COLOURS[finding.severity]), 1)
    yield from rest
    yield from page.wrap(f"fix: {finding.fix}", _INDENT, f"{_INDENT}     ")


def clock(seconds: float) -> str:
    """Return the time of day, UTC, of a time since 1970."""
    try:
        return f"{datetime.fromtimestamp(seconds, UTC):%H:%M:%S}"
    except (ValueError, OverflowError, OSError):
        return "--:--:--"
