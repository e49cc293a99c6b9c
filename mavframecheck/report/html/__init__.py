"""`html`: a page for each recording that a person would rather look at than read, and an index of many.

A page is one file: styles, scripts and data are in it, nothing is fetched, and its content security policy
lets nothing else run. Whatever came from a recording is escaped by the templates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import quote

from mavframecheck.report import Checked, Context
from mavframecheck.report.html.index import Entry, index_of
from mavframecheck.report.html.page import page_of


def render(results: Iterable[Checked], context: Context) -> Iterator[str]:
    """Yield the page of the only recording; of several, an index without pages."""
    entries: list[Entry] = []
    only = ""
    for checked in results:
        entries.append(Entry.of(checked))
        only = page_of(checked, context) if len(entries) == 1 else ""
    yield only or index_of(entries, context)


def write(results: Iterable[Checked], path: Path, context: Context) -> Iterator[Checked]:
    """Write the report to `path` while `results` pass by.

    One recording is a page at `path`. For several, `path` is an index, and the pages lie in a folder
    beside it that has its name. OSError when something cannot be written.
    """
    entries: list[Entry] = []
    first = ""
    for checked in results:
        entries.append(Entry.of(checked))
        text = page_of(checked, context)
        if len(entries) == 1:
            first = text
        else:
            if len(entries) == 2:
                entries[0] = _place(first, entries[0], 1, path)
            entries[-1] = _place(text, entries[-1], len(entries), path)
        yield checked
    _save(path, first if len(entries) == 1 else index_of(entries, context))


def _place(text: str, entry: Entry, number: int, path: Path) -> Entry:
    """Write one of several pages; return its entry with the link to it."""
    folder = path.with_suffix("")
    if folder == path:
        folder = path.with_name(f"{path.name}-pages")
    folder.mkdir(exist_ok=True)
    stem = "".join(c if c.isascii() and c.isalnum() else "-" for c in Path(entry.path).stem)
    name = f"{number:03d}-{stem[:60]}.html"
    _save(folder / name, text)
    return entry._replace(link=quote(f"{folder.name}/{name}"))


def _save(path: Path, text: str) -> None:
    path.write_text(text, "utf-8", newline="\n")
