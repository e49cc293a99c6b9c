"""`html`: a page for each recording that a person would rather look at than read, and an index of many.

A page is one file: styles, scripts and data are in it, nothing is fetched, and its content security policy
lets nothing else run. Whatever came from a recording is escaped by the templates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from mavframecheck.report import Checked, Context
from mavframecheck.report.html.index import Entry, index
from mavframecheck.report.html.page import page


def render(results: Iterable[Checked], context: Context) -> Iterator[str]:
    """Yield the page of the only recording; of several, an index without pages."""
    entries: list[Entry] = []
    only = None
    for number, checked in enumerate(results):
        entries.append(Entry.of(checked, None))
        only = page(checked, context) if not number else None
    yield only if only is not None else index(entries, context)


def write(results: Iterable[Checked], path: Path, context: Context) -> Iterator[Checked]:
    """Write the report to `path` while `results` pass by; they lose what was only kept to be drawn.

    One recording is a page at `path`. For several, `path` is an index, and the pages lie in a folder
    beside it that has its name. OSError when something cannot be written.
    """
    entries: list[Entry] = []
    first = ""
    for number, checked in enumerate(results):
        if not number:
            first = page(checked, context)
            entries.append(Entry.of(checked, None))
        else:
            if number == 1:
                entries[0] = _add(first, entries[0], 0, path, context)
            entries.append(
                _add(page(checked, context), Entry.of(checked, None), number, path, context)
            )
        yield checked._replace(detail=None)
    _write(path, first if len(entries) == 1 else index(entries, context))


def _add(text: str, entry: Entry, number: int, path: Path, context: Context) -> Entry:
    """Write one of several pages; return its entry with a link."""
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    stem = "".join(c if c.isalnum() and c.isascii() else "-" for c in Path(entry.path).stem)[:60]
    name = f"{number + 1:03d}-{stem}.html"
    _write(folder / name, text)
    _ = context
    return entry._replace(link=f"{folder.name}/{name}")


def _write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8", newline="\n")
