"""Options of the commands that judge: which rules run, and what to assume."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from mavframecheck.cli.options import dialect_option, overrides, rules_option, selected
from mavframecheck.model import Severity

if TYPE_CHECKING:
    from mavframecheck.engine import Pack, Settings

FAMILIES = ("px4", "arducopter", "arduplane", "ardurover", "ardusub")
_OPTIONS = (
    click.option(
        "--select",
        metavar="CODES",
        multiple=True,
        help="Run only these codes, prefixes or names: MFC1,MFC302. Repeatable.",
    ),
    click.option("--ignore", metavar="CODES", multiple=True, help="Leave these out. Repeatable."),
    click.option(
        "--fail-on",
        type=click.Choice([severity.value for severity in Severity]),
        default=Severity.WARNING.value,
        show_default=True,
        help="Exit 1 when a finding is at least this bad.",
    ),
    click.option("--preview", is_flag=True, help="Also run rules that are still on trial."),
    click.option(
        "--autopilot",
        type=click.Choice(FAMILIES),
        help="What the vehicle is, where the recording does not say.",
    ),
    dialect_option,
    click.option(
        "--set",
        "assignments",
        metavar="CODE.param=value",
        multiple=True,
        help="Change a parameter of a rule ('mavframecheck rule CODE' lists them). Repeatable.",
    ),
    rules_option,
)


def judging_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that `engine_settings` takes, and --fail-on and --rules."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def engine_settings(
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
