"""`mavframecheck watch`: judge links to vehicles while they are up."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from mavframecheck.cli.output import echo, lines
from mavframecheck.cli.settings import choose, judging_options, shown
from mavframecheck.model import Severity

_EXAMPLE = """\
Give a link, or several. For example:

  mavframecheck watch udpin:0.0.0.0:14551
  mavframecheck watch /dev/ttyUSB0,57600 --record flight.tlog
  mavframecheck watch --follow flight.tlog --plain

'mavframecheck watch --help' lists every option; docs/ground-station.md tells how to sit beside
QGroundControl or Mission Planner.
"""
_UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def _seconds(_ctx: click.Context, _param: click.Parameter, text: str | None) -> float | None:
    """Return the length of time in `text`, s."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d+(?:\.\d+)?)(s|min|h)", text)
    if match is None:
        raise click.BadParameter(f"'{text}' is not a length of time such as 60s, 5min or 1h")
    return float(match[1]) * _UNITS[match[2]]


@click.command()
@click.argument("links", metavar="LINK...", nargs=-1)
@click.option(
    "--follow",
    "files",
    metavar="FILE",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Watch a tlog that another program is writing. Repeatable.",
)
@click.option(
    "--relay",
    metavar="LINK",
    help="Pass every byte on to this link, and back: to stand between vehicle and ground station.",
)
@click.option(
    "--record",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write what is received to this tlog; with several links, to one for each.",
)
@click.option(
    "--for",
    "length_s",
    metavar="TIME",
    callback=_seconds,
    help="Stop after this time: 60s, 5min, 1h.",
)
@click.option(
    "--exit-on",
    type=click.Choice([severity.value for severity in Severity]),
    help="Stop at the first finding that is at least this bad.",
)
@click.option(
    "--expect",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Compare with this contract, as 'inspect --contract' writes it; exit 1 where it is broken.",
)
@click.option(
    "--notify",
    metavar="LINK",
    help="Send findings as STATUSTEXT to this ground station: udpout:HOST:PORT or tcp:HOST:PORT.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "jsonl"]),
    default="text",
    show_default=True,
    help="jsonl is for programs, and described in docs/output.md.",
)
@click.option("--plain", is_flag=True, help="Write lines instead of a screen.")
@judging_options
@click.pass_context
def watch(
    ctx: click.Context,
    /,
    links: tuple[str, ...],
    files: tuple[Path, ...],
    relay: str | None,
    record: Path | None,
    length_s: float | None,
    exit_on: str | None,
    expect: Path | None,
    notify: str | None,
    form: str,
    plain: bool,
    show_settings: bool,
    **options: Any,
) -> None:
    """Judge links to vehicles while they are up. Nothing is sent to them.

    LINK is udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT, or a serial port with
    its speed: /dev/ttyUSB0,57600 or COM3,57600. Ctrl-C ends the watch.

    Exit codes: 0 clean, 1 findings at or above --fail-on, 2 wrong usage or a link that cannot be had,
    3 nothing could be decoded.
    """
    if show_settings:
        echo(lines(shown(choose(**options))))
        return
    if not links and not files:
        click.echo(_EXAMPLE, err=True, nl=False)
        ctx.exit(2)
    if relay is not None and len(links) != 1:
        raise click.UsageError("--relay stands behind one link: name one")
    if notify is not None and not notify.startswith(("udpout:", "tcp:")):
        raise click.UsageError("--notify sends to udpout:HOST:PORT or tcp:HOST:PORT")
    from mavframecheck.cli.watching import Wishes, watched

    chosen = choose(**options)
    wishes = Wishes(
        links=links,
        files=files,
        relay=relay,
        record=record,
        length_s=length_s,
        exit_on=None if exit_on is None else Severity(exit_on),
        expect=expect,
        notify=notify,
        fail_on=chosen.fail_on,
    )
    form = "plain" if plain and form == "text" else form
    ctx.exit(watched(wishes, chosen.pack, chosen.settings, form=form))
