"""`--format jsonl`: one JSON object a line as files are finished; ``type`` tells them apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import msgspec

from mavframecheck.model import FileReport, Finding, Suppressed
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import json_text
from mavframecheck.report.plain import plain


def render(results: Iterable[Checked], _context: Context) -> Iterator[bytes]:
    """Yield the findings of each file, then the file: whoever reads it knows all came before."""
    for checked in results:
        for finding in checked.findings:
            yield _line("finding", finding)
        for suppressed in checked.suppressed:
            yield _line("suppressed", suppressed)
        yield _line("file", checked.file)


def _line(kind: str, value: Finding | FileReport | Suppressed) -> bytes:
    return json_text(msgspec.json.encode({"type": kind, **plain(value)})) + b"\n"
