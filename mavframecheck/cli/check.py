"""`mavframecheck check`: judge recordings and missions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mavframecheck.cli.options import (
    dialect_option,
    input_kind_option,
    load_rules,
    overrides,
    rules_option,
    selected,
)
from mavframecheck.cli.output import echo, page_context
from mavframecheck.model import Severity
from mavframecheck.report import FORMATS, load

if TYPE_CHECKING:
    from mavframecheck.engine import Pack, Settings

_EXAMPLE = """\
Give a recording or mission, a directory of them, or - for standard input. For example:

  mavframecheck check flight.tlog
  mavframecheck check mission.plan
  mavframecheck check logs/ --fail-on error
  mavframecheck check flight.tlog --select MFC1,MFC302 --format json

'mavframecheck check --help' lists every option.
"""
_FAMILIES = ("px4", "arducopter", "arduplane", "ardurover", "ardusub")


@click.command()
@click.argument("paths", metavar="PATH...", nargs=-1)
@click.option(
    "--format",
    "form",
    type=click.Choice(list(FORMATS)),
    default="text",
    show_default=True,
    help="text is for people; json and jsonl are described in docs/output.md.",
)
@click.option(
    "--select",
    metavar="CODES",
    multiple=True,
    help="Run only these codes, prefixes or names: MFC1,MFC302. Repeatable.",
)
@click.option("--ignore", metavar="CODES", multiple=True, help="Leave these out. Repeatable.")
@click.option(
    "--fail-on",
    type=click.Choice([severity.value for severity in Severity]),
    default=Severity.WARNING.value,
    show_default=True,
    help="Exit 1 when a finding is at least this bad.",
)
@click.option("--preview", is_flag=True, help="Also run rules that are still on trial.")
@click.option(
    "--autopilot",
    type=click.Choice(_FAMILIES),
    help="What the vehicle is, where a recording does not say; in mission files whatever they say.",
)
@click.option(
    "--fix",
    is_flag=True,
    help="Mend in mission files what is certain, and judge what is left.",
)
@click.option("--diff", is_flag=True, help="Only show what --fix would change.")
@dialect_option
@input_kind_option
@click.option(
    "--set",
    "assignments",
    metavar="CODE.param=value",
    multiple=True,
    help="Change a parameter of a rule ('mavframecheck rule CODE' lists them). Repeatable.",
)
@rules_option
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
    form: str,
    fail_on: str,
    directories: tuple[Path, ...],
    verbose: bool,
    fix: bool,
    diff: bool,
    **chosen: Any,
) -> None:
    """Judge recordings and missions: files, directories, or - for standard input.

    Exit codes: 0 clean, 1 findings at or above --fail-on, 2 wrong usage or a file that cannot be
    read, 3 nothing could be decoded.
    """
    if not paths:
        click.echo(_EXAMPLE, err=True, nl=False)
        ctx.exit(2)
    from mavframecheck.cli.audit import Audit

    pack = load_rules(directories)
    settings = _settings(pack, **chosen)
    if diff:
        from mavframecheck.cli.mend import Diffs

        diffs = Diffs(paths, pack, settings)
        echo(diffs.results())
        ctx.exit(diffs.verdict())
    audit = Audit(paths, pack, settings, fix=fix)
    context = page_context(verbose=verbose)._replace(rules=tuple(pack.rules))
    echo(load(form)(audit.results(), context))
    ctx.exit(audit.verdict(Severity(fail_on)))


def _settings(
    pack: Pack,
    select: tuple[str, ...],
    ignore: tuple[str, ...],
    assignments: tuple[str, ...],
    **rest: Any,
) -> Settings:
    """Return the settings of the engine, every code and parameter known to exist."""
    from mavframecheck.engine import Settings

    return Settings(
        select=selected("--select", select, pack),
        ignore=selected("--ignore", ignore, pack),
        overrides=overrides(assignments, pack),
        **rest,
    )
