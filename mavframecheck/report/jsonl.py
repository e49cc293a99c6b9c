"""`--format jsonl`: one JSON object a line as files are finished; ``type`` tells them apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import msgspec

from mavframecheck.model import FileReport, Finding
from mavframecheck.report import Checked, Context
from mavframecheck.report.plain import plain


def render(results: Iterable[Checked], _context: Context) -> Iterator[bytes]:
    """Yield the findings of each file, then the file: whoever reads it knows all came before."""
    for checked in results:
        for finding in checked.findings:
            yield _line("finding", finding)
        yield _line("file", checked.file)


def _line(kind: str, value: Finding | FileReport) -> bytes:
    return msgspec.json.encode({"type": kind, **plain(value)}) + b"\n"
