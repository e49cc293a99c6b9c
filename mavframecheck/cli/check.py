"""`mavframecheck check`: judge recordings and missions."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from mavframecheck.cli.output import deliver, echo, lines, page_context, parse_outputs
from mavframecheck.cli.settings import choose, settings_options, shown
from mavframecheck.report import DRAWN, FORMATS

if TYPE_CHECKING:
    from mavframecheck.cli.audit import Audit
    from mavframecheck.cli.settings import Chosen

_EXAMPLE = """\
Give a recording or mission, a directory of them, or - for standard input. For example:

  mavframecheck check flight.tlog
  mavframecheck check mission.plan
  mavframecheck check logs/ --fail-on error
  mavframecheck check flight.tlog --select MFC1,MFC302 --format json

'mavframecheck check --help' lists every option.
"""


@click.command()
@click.argument("paths", metavar="PATH...", nargs=-1)
@click.option(
    "--format",
    "form",
    type=click.Choice(list(FORMATS)),
    help="text, concise and statistics are for people, the others are described in docs/output.md."
    "  [default: text; github in GitHub Actions]",
)
@click.option("--statistics", is_flag=True, help="Count findings by rule instead of showing each.")
@click.option(
    "--output",
    "outputs",
    metavar="FORMAT=PATH",
    multiple=True,
    callback=parse_outputs,
    help="Also write a report in this format to this file. Repeatable: one pass gives several.",
)
@settings_options
@click.option(
    "--jobs",
    metavar="N",
    type=click.IntRange(min=0),
    default=1,
    show_default=True,
    help="Judge this many files at once, each in a process of its own; 0: one for each processor.",
)
@click.option(
    "--watch",
    metavar="DIR",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Judge recordings as they appear in this directory and are complete, until Ctrl-C.",
)
@click.option(
    "--fix",
    is_flag=True,
    help="Mend in mission files what is certain, and judge what is left.",
)
@click.option("--diff", is_flag=True, help="Only show what --fix would change.")
@click.option(
    "--plan",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False),
    help="The mission that recordings were meant to fly: tracks are compared with it (MFC416).",
)
@click.option(
    "--dem",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False),
    help="A terrain model (GeoTIFF): legs of missions are compared with the ground (MFC911).",
)
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Say which rules could not judge and why, and list damage and senders in full.",
)
@click.pass_context
def check(
    ctx: click.Context,
    /,
    paths: tuple[str, ...],
    form: str | None,
    statistics: bool,
    outputs: list[tuple[str, Path]],
    verbose: bool,
    show_settings: bool,
    jobs: int,
    watch: Path | None,
    fix: bool,
    diff: bool,
    plan: str | None,
    dem: str | None,
    **options: Any,
) -> None:
    """Judge recordings and missions: files, directories, or - for standard input.

    Exit codes: 0 clean, 1 findings at or above --fail-on, 2 wrong usage or a file that cannot be
    read, 3 nothing could be decoded.
    """
    if show_settings:
        echo(lines(shown(choose(**options))))
        return
    if paths and watch:
        raise click.UsageError("give either PATH or --watch DIR")
    if watch and (fix or diff):
        raise click.UsageError("--fix and --diff are for files that are named, not for --watch")
    if not (paths or watch):
        click.echo(_EXAMPLE, err=True, nl=False)
        ctx.exit(2)
    chosen = choose(plan=plan, dem=dem, **options)
    if diff:
        _show_diff(ctx, paths, chosen)
    form = "statistics" if statistics else form or _default_format()
    draw = bool(DRAWN & {form, *(each for each, _ in outputs)})
    audit = _audit(paths, watch, chosen, jobs or os.cpu_count() or 1, fix=fix, draw=draw)
    context = page_context(verbose=verbose)._replace(
        rules=tuple(chosen.pack.rules), fail_on=chosen.fail_on, remarks=audit.remarks
    )
    deliver(audit.results(), form, outputs, context)
    ctx.exit(audit.exit_code())


def _show_diff(ctx: click.Context, paths: tuple[str, ...], chosen: Chosen) -> NoReturn:
    from mavframecheck.cli.mend import Diffs

    diffs = Diffs(paths, chosen.pack, chosen.settings)
    echo(diffs.results())
    ctx.exit(diffs.verdict())


def _audit(
    paths: tuple[str, ...],
    watch: Path | None,
    chosen: Chosen,
    jobs: int,
    *,
    fix: bool,
    draw: bool,
) -> Audit:
    if watch:
        from mavframecheck.cli.vigil import Vigil

        return Vigil(watch, chosen, draw=draw)
    from mavframecheck.cli.audit import Audit

    return Audit(paths, chosen, jobs, fix=fix, draw=draw)


def _default_format() -> str:
    """Return the format that whoever reads standard output understands best."""
    return "github" if os.environ.get("GITHUB_ACTIONS") == "true" else "text"
