"""`--format json`: one document, described in `docs/output.md` and `docs/report.schema.json`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import msgspec

from mavframecheck.model import Report
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import json_text
from mavframecheck.report.plain import plain


def render(results: Iterable[Checked], context: Context) -> Iterator[bytes]:
    """Yield the whole report when the last file is judged."""
    checked = tuple(results)
    report = Report(
        version=context.version,
        files=tuple(each.file for each in checked),
        findings=tuple(finding for each in checked for finding in each.findings),
        suppressed=tuple(one for each in checked for one in each.suppressed),
    )
    yield document(report)


def listing(files: Iterable[object], context: Context) -> Iterator[bytes]:
    """Yield what was found in each file, as one document, when the last one is read."""
    yield document({"version": context.version, "files": tuple(files)})


def document(value: object) -> bytes:
    """Return `value` as an indented JSON document with a line end."""
    return json_text(msgspec.json.format(msgspec.json.encode(plain(value)), indent=2)) + b"\n"
