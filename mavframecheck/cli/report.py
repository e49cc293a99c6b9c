"""`mavframecheck report`: recordings as pages to look at."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import click

from mavframecheck.cli.output import complain, drawing, opened, page_context
from mavframecheck.cli.settings import choose, settings_options
from mavframecheck.report.escape import sentence


@click.command()
@click.argument("paths", metavar="PATH...", nargs=-1, required=True)
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    default="report.html",
    show_default=True,
    help="Where to write it. Of several recordings this is the index; the pages lie in a folder beside it.",
)
@settings_options
@click.pass_context
def report(
    ctx: click.Context,
    /,
    paths: tuple[str, ...],
    output: Path,
    *,
    show_settings: bool,  # noqa: ARG001  (an option of `check`)
    **options: Any,
) -> None:
    """Judge recordings, and write a page for each: findings, their proof, the flight, a map.

    PATH is a file, a directory, or - for standard input. 'check --output html=FILE' writes the same
    beside other reports.

    Exit codes: 0 written, whatever was found; 2 wrong usage or a file that cannot be read; 3 nothing
    could be decoded.
    """
    from mavframecheck.cli.audit import FINDINGS, Audit

    chosen = choose(**options)
    audit = Audit(paths, chosen, draw=True)
    context = page_context()._replace(rules=tuple(chosen.pack.rules)).for_a_file()
    opened(output).close()
    deque(drawing(audit.results(), output, context), maxlen=0)
    complain(f"wrote {sentence(str(output))}")
    code = audit.exit_code()
    ctx.exit(0 if code == FINDINGS else code)
