"""`--format text`: for people, at 80 columns or piped.

A file is a head (what was read, who spoke), its findings by stream with the worst first, and the
verdict: what was found and how much was judged. Silence must not read as a pass.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, groupby

from mavframecheck.model import (
    FileReport,
    Finding,
    MissionLocation,
    Subject,
)
from mavframecheck.model.finding import MISSION_KINDS
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import SEVERITY_COLOURS, Page
from mavframecheck.report.told import evidence_rows, when
from mavframecheck.report.verdict import Census, found, judged
from mavframecheck.report.words import (
    component,
    intended,
    plural,
    what_was_read,
)

_MOST_COMPONENTS = 12
"""Components listed in the head of a file: a hostile log has hundreds."""
_WIDEST_LABEL = 16


def render(results: Iterable[Checked], context: Context) -> Iterator[str]:
    """Yield each file as it is judged, then, when there were several, all of them together."""
    page = Page(context)
    census = Census()
    for checked in results:
        gap = [""] if census.files else []
        census.add(checked)
        yield from _lines(chain(gap, _file(checked, page)))
    if len(census.files) > 1:
        yield from _lines(_all(census, page))
    if not census.files:
        yield "nothing was judged\n"


def _all(census: Census, page: Page) -> Iterator[str]:
    """Yield which rule found something in how many files, and the verdict on all of them."""
    from mavframecheck.report.statistics import by_rule

    yield ""
    yield from by_rule(census, page)
    yield page.bold(census.total)
    yield from _judged(census.files, page)


def _lines(lines: Iterable[str]) -> Iterator[str]:
    """Yield one piece of output: a file appears whole, and a pipe is written to once."""
    yield "".join(f"{line}\n" for line in lines)


def _file(checked: Checked, page: Page) -> Iterator[str]:
    file, findings = checked.file, checked.findings
    yield from _head(file, page)
    yield from _findings(file, findings, page)
    if page.context.verbose:
        yield from _damage(file, page)
        yield from _not_judged(file, page)
        yield from _set_aside(checked, page)
    yield ""
    counts = Counter(finding.severity for finding in findings)
    yield page.bold(found(counts, len(checked.suppressed))) + page.dim(_hint(findings))
    yield from _judged([file], page)


# ---- head of a file ----


def _head(file: FileReport, page: Page) -> Iterator[str]:
    yield page.bold(sentence(file.path))
    yield from page.wrap(what_was_read(file), "  ", "    ")
    if file.kind in MISSION_KINDS:
        yield from (f"  for {intended(vehicle)}" for vehicle in file.vehicles)
        yield from _notes(file, page)
        return
    speakers = file.vehicles if page.context.verbose else file.vehicles[:_MOST_COMPONENTS]
    ids = [f"{vehicle.sysid}/{vehicle.compid}" for vehicle in speakers]
    column = max((len(text) for text in ids), default=0) + 2
    for text, vehicle in zip(ids, speakers):
        yield from page.wrap(component(vehicle), f"  {text:{column}}", " " * (column + 2))
    if len(file.vehicles) > len(speakers):
        yield f"  and {plural(len(file.vehicles) - len(speakers), 'more sender')} (--verbose)"
    yield from _notes(file, page)


def _notes(file: FileReport, page: Page) -> Iterator[str]:
    for note in file.notes:
        yield from page.wrap(f"note: {note}", "  ", "    ")


# ---- findings ----


def _findings(file: FileReport, findings: Sequence[Finding], page: Page) -> Iterator[str]:
    """Yield the findings stream by stream; the stream with the worst finding comes first."""
    streams = {stream: list(group) for stream, group in groupby(_sorted(findings), key=_stream)}
    for stream, group in sorted(streams.items(), key=lambda item: _rank(item[1][0])):
        yield ""
        yield page.bold(sentence(str(stream)) or "the file as a whole")
        for number, finding in enumerate(group):
            if number:
                yield ""
            yield from _finding(finding, file, page)


def _sorted(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings by stream, within it the worst first, then in order of time or line."""

    def key(finding: Finding) -> tuple[int, int, str, int, bool, float, int]:
        stream = _number(finding.sysid), _number(finding.compid), finding.message_name or ""
        time = finding.time_first is None, finding.time_first or 0.0
        return *stream, _rank(finding), *time, _line(finding)

    return sorted(findings, key=key)


def _line(finding: Finding) -> int:
    location = finding.location
    return (location.line or 0) if isinstance(location, MissionLocation) else 0


def _number(component: int | None) -> int:
    """Return an id that sorts: what has none comes first."""
    return -1 if component is None else component


def _rank(finding: Finding) -> int:
    return -finding.severity.rank


def _stream(finding: Finding) -> Subject:
    return Subject(finding.sysid, finding.compid, finding.message_name)


def _finding(finding: Finding, file: FileReport, page: Page) -> Iterator[str]:
    yield from _title(finding, page)
    yield from page.wrap(when(finding, file), "    ", style="dim")
    yield from page.wrap(finding.text, "    ")
    rows = evidence_rows(finding)
    column = min(max(len(label) for label, _ in rows), _WIDEST_LABEL) + 2
    for label, value in rows:
        yield from page.labelled(label, value, column)


def _title(finding: Finding, page: Page) -> Iterator[str]:
    """Yield ``error MFC302 degrees-in-scaled-field, lat_int``, coloured after it is wrapped."""
    sure = "" if finding.confidence == "high" else f" ({finding.confidence} confidence)"
    field = f", {finding.field}" if finding.field else ""
    first, *rest = page.wrap(f"{finding.severity} {finding.code} {finding.name}{field}{sure}", "  ")
    plain = f"{finding.severity} {sentence(finding.code)}"
    yield first.replace(plain, page.paint(plain, SEVERITY_COLOURS[finding.severity]), 1)
    yield from rest


# ---- verdict ----


def _hint(findings: Sequence[Finding]) -> str:
    """Return how to learn more of the worst finding."""
    if not findings:
        return ""
    return f" (mavframecheck rule {sentence(min(findings, key=_rank).code)} explains)"


def _judged(files: Sequence[FileReport], page: Page) -> Iterator[str]:
    """Yield the last line, in one piece where a program may read it."""
    line = judged(files, verbose=page.context.verbose)
    yield from page.wrap(line) if page.context.terminal else (line,)


# ---- what --verbose adds ----


def _damage(file: FileReport, page: Page) -> Iterator[str]:
    if not file.damage:
        return
    yield ""
    yield page.bold("damage")
    for each in file.damage:
        place = f"bytes {each.offset} to {each.offset + each.length - 1} ({each.length})"
        yield from page.wrap(f"{place}: {each.reason}", "  ", "    ")
    if file.damage_total > len(file.damage):
        yield f"  and {plural(file.damage_total - len(file.damage), 'more range')}"


def _not_judged(file: FileReport, page: Page) -> Iterator[str]:
    """Yield what was not looked at, in whole or (a rule that ran, with a reason) in part."""
    idle = [run for run in file.runs if run.status != "ran" or run.reason]
    if not idle:
        return
    yield ""
    yield page.bold("not judged")
    for run in idle:
        subject = f" for {run.subject}" if run.subject else ""
        status = run.status.replace("-", " ")
        reason = f": {run.reason}" if run.reason else ""
        yield from page.wrap(f"{run.code} {status}{subject}{reason}", "  ", "    ")


def _set_aside(checked: Checked, page: Page) -> Iterator[str]:
    if not checked.suppressed:
        return
    yield ""
    yield page.bold("suppressed")
    for each in checked.suppressed:
        what = f"{each.finding.code} {each.finding.name}, {each.finding.subject}".rstrip(", ")
        yield from page.wrap(f"{what}: {each.reason} ({each.by})", "  ", "    ")
