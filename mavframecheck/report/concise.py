"""`--format concise`: one line a finding, for grep and for editors; the last line is the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from mavframecheck.model import ByteLocation, Finding, MissionLocation
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import SEVERITY_COLOURS, Page
from mavframecheck.report.verdict import Census, judged


def render(results: Iterable[Checked], context: Context) -> Iterator[str]:
    """Yield the findings of each file as it is judged, then what was found and judged in all."""
    page, census = Page(context), Census()
    for checked in census.count(results):
        yield "".join(f"{_line(finding, page)}\n" for finding in checked.findings)
    yield f"{page.bold(census.total)}; {judged(census.files, verbose=True)}\n"


def _line(finding: Finding, page: Page) -> str:
    """Return ``flight.tlog:12172: error MFC302 degrees-in-scaled-field 1/191 ODOMETRY.q: text``."""
    place = sentence(":".join([finding.file, *_position(finding)]))
    severity = page.paint(
        f"{finding.severity} {sentence(finding.code)}", SEVERITY_COLOURS[finding.severity]
    )
    subject = f" {finding.subject}" if finding.subject else ""
    often = f" ({finding.count} times)" if finding.count > 1 else ""
    return f"{place}: {severity} " + sentence(f"{finding.name}{subject}: {finding.text}{often}")


def _position(finding: Finding) -> list[str]:
    """Return the byte in a recording, or line and column in a text file."""
    match finding.location:
        case ByteLocation(offset=offset):
            return [str(offset)]
        case MissionLocation(line=line, column=column):
            return [str(number) for number in (line, column) if number is not None]
    return []
