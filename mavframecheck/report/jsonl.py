"""`--format jsonl`: one JSON object a line as files are finished; ``type`` tells them apart."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import msgspec

from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import json_text
from mavframecheck.report.plain import plain


def render(results: Iterable[Checked], _context: Context) -> Iterator[bytes]:
    """Yield the findings of each file, then the file: whoever reads it knows all came before."""
    for checked in results:
        for finding in checked.findings:
            yield line("finding", finding)
        for suppressed in checked.suppressed:
            yield line("suppressed", suppressed)
        yield line("file", checked.file)


def line(kind: str, value: msgspec.Struct) -> bytes:
    """Return a struct as a line, with its `kind` under ``type``."""
    return json_text(msgspec.json.encode({"type": kind, **plain(value)})) + b"\n"
