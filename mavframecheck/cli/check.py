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
from mavframecheck.cli.output import deliver, page_context, parse_outputs
from mavframecheck.model import Severity
from mavframecheck.report import FORMATS

if TYPE_CHECKING:
    from mavframecheck.engine import Pack, Settings

_EXAMPLE = """\
Give a recording, a directory of them, or - for standard input. For example:

  mavframecheck check flight.tlog
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
    "--output",
    "outputs",
    metavar="FORMAT=PATH",
    multiple=True,
    callback=parse_outputs,
    help="Also write a report in this format to this file. Repeatable: one pass gives several.",
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
    help="What the vehicle is, where the recording does not say.",
)
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
    outputs: list[tuple[str, Path]],
    fail_on: str,
    directories: tuple[Path, ...],
    verbose: bool,
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
    audit = Audit(paths, pack, _settings(pack, **chosen))
    context = page_context(verbose=verbose)._replace(rules=tuple(pack.rules))
    deliver(audit.results(), form, outputs, context)
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
