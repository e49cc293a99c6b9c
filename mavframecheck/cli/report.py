"""`mavframecheck report`: recordings as pages to look at."""

from __future__ import annotations

from collections import deque
from pathlib import Path

import click

from mavframecheck.cli.options import dialect_option, input_kind_option, load_rules, rules_option
from mavframecheck.cli.output import complain, drawing, opened, page_context
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
@click.option("--preview", is_flag=True, help="Also run rules that are still on trial.")
@dialect_option
@input_kind_option
@rules_option
@click.pass_context
def report(
    ctx: click.Context,
    /,
    paths: tuple[str, ...],
    output: Path,
    preview: bool,
    dialect: str,
    input_kind: str | None,
    directories: tuple[Path, ...],
) -> None:
    """Judge recordings, and write a page for each: findings, their proof, the flight, a map.

    PATH is a file, a directory, or - for standard input. 'check --output html=FILE' writes the same and
    has more options.

    Exit codes: 0 written, 2 wrong usage or a file that cannot be read, 3 nothing could be decoded.
    """
    from mavframecheck.cli.audit import Audit
    from mavframecheck.engine import Settings

    pack = load_rules(directories)
    settings = Settings(preview=preview, dialect=dialect, input_kind=input_kind)
    audit = Audit(paths, pack, settings, draw=True)
    context = page_context()._replace(rules=tuple(pack.rules)).for_a_file()
    opened(output).close()
    deque(drawing(audit.results(), output, context), maxlen=0)
    complain(f"wrote {sentence(str(output))}")
    ctx.exit(audit.exit_code())
