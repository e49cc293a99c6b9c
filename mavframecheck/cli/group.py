"""The `mavframecheck` command and the table of its subcommands, imported only when used."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from types import TracebackType
from typing import Any

import click

COMMANDS = {
    "check": "Judge recordings and missions; exit 1 on findings.",
    "watch": "Judge links to vehicles while they are up.",
    "inspect": "Show what the numbers of a recording mean: the map of its streams.",
    "report": "Write a page for each recording: what was found, and how we know.",
    "rules": "List the rules.",
    "rule": "Explain one rule.",
    "completion": "Write the script that makes a shell complete this command.",
}
"""Name and one line of help. `mavframecheck.cli.NAME` holds the command, called NAME."""


INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 and the number of the signal."""
COLLECT_AFTER = 200_000
"""Objects made before the garbage collector looks: what start-up makes stays, and looking takes 0.1 s."""


class _Lazy(click.Group):
    """Imports a subcommand when it is run: listing them all must cost nothing."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return super().get_command(ctx, cmd_name)
        command = getattr(import_module(f"mavframecheck.cli.{cmd_name}"), cmd_name)
        return command if isinstance(command, click.Command) else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the subcommand; click itself would leave with 1 on Ctrl-C, the code for findings."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("mavframecheck: interrupted", err=True)
            ctx.exit(INTERRUPTED)

    def main(self, args: Sequence[str] | None = None, *rest: Any, **extra: Any) -> Any:
        """Run the command; as a process of its own (no `args`), also answer for its failures."""
        if args is None:
            gc.set_threshold(COLLECT_AFTER)
            os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's: matrices here are small
            sys.excepthook = _internal_error
        return super().main(args, *rest, **extra)


def _internal_error(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Show the traceback and leave with 2: Python's own 1 would read as "there are findings"."""
    sys.__excepthook__(kind, error, trace)
    sys.stderr.flush()
    os._exit(2)


def _show_versions(ctx: click.Context, _param: click.Parameter, value: bool) -> None:
    if not value or ctx.resilient_parsing:
        return
    from mavframecheck.cli.version import versions

    for line in versions():
        click.echo(line)
    ctx.exit()


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_versions,
    help="Show the versions of the program and of the data by which it judges.",
)
def main() -> None:
    """Find numbers in MAVLink streams that do not mean what somebody thinks.

    Wrong frames, altitude references, units, type masks, time: in recorded logs and in missions.
    """
