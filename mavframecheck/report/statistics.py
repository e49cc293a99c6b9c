"""`--statistics`: which rule found how much, in how many recordings, sent by whom; no finding itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import SEVERITY_COLOURS, Page
from mavframecheck.report.verdict import Census, judged
from mavframecheck.report.words import plural, shortened

_MOST_SENDERS = 6


def render(results: Iterable[Checked], context: Context) -> Iterator[str]:
    """Yield the table once the last file is judged."""
    page, census = Page(context), Census()
    for checked in results:
        census.add(checked)
    lines = [*by_rule(census, page), page.bold(census.total), judged(census.files, verbose=True)]
    yield "".join(f"{line}\n" for line in lines)


def by_rule(census: Census, page: Page) -> Iterator[str]:
    """Yield two lines a rule that found something, the worst and most frequent first."""
    rules = sorted(
        census.rules.items(),
        key=lambda item: (-item[1].severity.rank, -len(item[1].files), item[0]),
    )
    for code, count in rules:
        severity = page.paint(f"{count.severity:8}", SEVERITY_COLOURS[count.severity])
        yield f"{severity} {sentence(code)} {sentence(count.name)}"
        senders = shortened(sorted(count.senders, key=_number), _MOST_SENDERS)
        by = f", sent by {senders}" if senders else ""
        files = f"{len(count.files)} of {plural(len(census.files), 'file')}"
        yield from page.wrap(f"{plural(count.findings, 'finding')} in {files}{by}", "    ")


def _number(sender: str) -> tuple[int, str]:
    """Return a key that puts 2/1 before 10/1."""
    system, _, component = sender.partition("/")
    return int(system), component.zfill(3)
