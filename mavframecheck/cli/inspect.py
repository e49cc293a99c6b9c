"""`mavframecheck inspect`: what the numbers of a recording mean."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

import click

from mavframecheck.cli.contract import ContractText
from mavframecheck.cli.missions import FORMATS as MISSION_FORMATS
from mavframecheck.cli.missions import MissionTable, export_paths
from mavframecheck.cli.options import dialect_option, input_kind_option
from mavframecheck.cli.output import page_context
from mavframecheck.cli.positions import FORMATS, Positions, Wish, position_options
from mavframecheck.cli.sender import Integration, parse_sender
from mavframecheck.cli.views import Clocks, Map, Origins, View
from mavframecheck.report.escape import sentence

_PIPE_WIDTH = 100
"""Columns for a pipe: tables need more room than sentences."""


@click.command()
@click.argument("paths", metavar="LOG...", nargs=-1, required=True)
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", *FORMATS, *MISSION_FORMATS]),
    help="text (default) is for people; json is described in docs/output.md. "
    "Positions: csv (default), jsonl, parquet. Missions: also plan, waypoints.",
)
@click.option(
    "--message",
    "messages",
    metavar="NAME",
    multiple=True,
    help="Show only this message, with every field. Repeatable.",
)
@click.option(
    "--all",
    "every_field",
    is_flag=True,
    help="Show every field, not only those about place, attitude, time and frames.",
)
@click.option(
    "--origins",
    is_flag=True,
    help="Show where local frames begin, where home is and where vehicles were armed.",
)
@click.option(
    "--clocks",
    is_flag=True,
    help="Show whose clock each stamp is, and how it runs: offset, rate, latency, steps.",
)
@click.option(
    "--sender",
    metavar="SYS/COMP",
    callback=parse_sender,
    help="Say how this sender of poses or positions does in each step of integrating a sensor.",
)
@click.option(
    "--contract",
    is_flag=True,
    help="Write what is sent, in which frames and how often, as a contract for 'watch --expect'.",
)
@click.option(
    "--missions",
    is_flag=True,
    help="Show missions, fences and rally points that went over the link, and what vehicles hold.",
)
@position_options
@dialect_option
@input_kind_option
@click.pass_context
def inspect(
    ctx: click.Context,
    /,
    paths: tuple[str, ...],
    form: str | None,
    messages: tuple[str, ...],
    every_field: bool,
    origins: bool,
    clocks: bool,
    sender: int | None,
    contract: bool,
    missions: bool,
    dialect: str,
    input_kind: str | None,
    wish: Wish | None,
) -> None:
    """Show who sends what in a recording, and what each number means.

    LOG is a file, a directory, or - for standard input. Per sender and message: rate, and for each
    field its unit, frame, direction, height reference, clock, range and how much of it is missing.
    With --positions: every position as a record instead. With --origins: where positions count from. With --clocks: the clock behind each stamp.
    With --sender: axes, signs, scale, rotation, clock, delay, covariance, lever arm, resets and rate of one sender.
    With --missions: what was uploaded and downloaded, and what vehicles hold.
    With --contract: a contract for 'watch --expect'.

    Exit codes: 0 done, 2 wrong usage or a file that cannot be read, 3 nothing could be decoded.
    """
    from mavframecheck.engine import Settings

    settings = Settings(dialect=dialect, input_kind=input_kind, sender=sender)
    wanted = {
        "origins": origins,
        "clocks": clocks,
        "sender": sender is not None,
        "missions": missions,
        "contract": contract,
    }
    if (wish is not None) + sum(wanted.values()) > 1:
        views = ", ".join(f"--{view}" for view in wanted)
        raise click.UsageError(f"choose one of --positions, {views}")
    if wish is not None:
        exporter = Positions(settings, _known(messages, dialect), wish)
        ctx.exit(exporter.show(paths, form or "csv"))
    if form in FORMATS:
        raise click.UsageError(f"--format {form} goes with --positions")
    if form in MISSION_FORMATS and not missions:
        raise click.UsageError(f"--format {form} goes with --missions")
    export_paths(paths, form)
    chosen = next((view for view, asked in wanted.items() if asked), "map")
    wanted_messages = _known(messages, dialect) if chosen == "map" else messages
    view = VIEWS[chosen](settings, wanted_messages, every_field=every_field)
    context = page_context()
    if not context.terminal:
        context = context._replace(width=_PIPE_WIDTH)
    ctx.exit(view.show(paths, form or "text", context))


VIEWS: dict[str, type[View[Any]]] = {
    "map": Map,
    "origins": Origins,
    "clocks": Clocks,
    "sender": Integration,
    "contract": ContractText,
    "missions": MissionTable,
}
"""What `inspect` can show of a recording, by name."""


def _known(messages: tuple[str, ...], dialect: str) -> tuple[str, ...]:
    """Return message names as the dialect writes them; an unknown one is a usage error."""
    if not messages:
        return ()
    from mavframecheck.wire import DialectError, load_dialect

    try:
        names = load_dialect(dialect).by_name
    except DialectError as error:
        raise click.UsageError(sentence(str(error))) from error
    for message in messages:
        if message.upper() not in names:
            near = get_close_matches(message.upper(), names, n=3)
            hint = f" Did you mean {' or '.join(near)}?" if near else ""
            raise click.BadParameter(
                f"the dialect has no message called {sentence(message)}.{hint}",
                param_hint="--message",
            )
    return tuple(message.upper() for message in messages)
