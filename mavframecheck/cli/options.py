"""What the options of several commands mean, and the usage errors they raise."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import click

from mavframecheck.report.escape import sentence

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from mavframecheck.engine import Pack

Value: TypeAlias = float | str | bool

rules_option = click.option(
    "--rules",
    "directories",
    metavar="DIR",
    multiple=True,
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Also use the rule files in this directory. Repeatable.",
)

DIALECT_HELP = "MAVLink dialect of the recording."
dialect_option = click.option(
    "--dialect",
    metavar="NAME|FILE.xml",
    default="ardupilotmega",
    show_default=True,
    help=DIALECT_HELP,
)
input_kind_option = click.option(
    "--input-kind",
    type=click.Choice(["tlog", "raw", "pcap", "pcapng"]),
    help="Read files as this, whatever their content looks like.",
)


def load_rules(directories: Sequence[Path]) -> Pack:
    """Return the shipped rules and those in `directories`; a bad rule file is a usage error."""
    from mavframecheck.engine import RuleFileError, load_pack

    try:
        return load_pack(directories)
    except RuleFileError as error:
        raise click.UsageError(sentence(str(error))) from error


def complete_codes(
    _ctx: click.Context, _param: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Return the shipped rules whose code or name begins with what a shell wants completed."""
    from click.shell_completion import CompletionItem

    beginning = incomplete.lower()
    return [
        CompletionItem(word, help=rule.summary)
        for rule in load_rules(()).rules
        for word in (rule.code, rule.name)
        if word.lower().startswith(beginning)
    ]


def listed(values: Iterable[str]) -> list[str]:
    """Return what is separated by commas, or given several times."""
    return [word.strip() for value in values for word in value.split(",") if word.strip()]


def selected(option: str, values: Iterable[str], pack: Pack) -> tuple[str, ...]:
    """Return the codes and prefixes in `values`; names count."""
    from mavframecheck.engine import SettingsError, selectors

    try:
        return selectors(listed(values), pack)
    except SettingsError as error:
        raise click.BadParameter(sentence(str(error)), param_hint=option) from error


def overrides(assignments: Iterable[str], pack: Pack) -> dict[str, dict[str, Value]]:
    """Return code to parameter to value, from ``CODE.param=value`` typed like the rule's own."""
    result: dict[str, dict[str, Value]] = {}
    for assignment in assignments:
        code, name, value = _assigned(assignment, pack)
        result.setdefault(code, {})[name] = value
    return result


def _assigned(assignment: str, pack: Pack) -> tuple[str, str, Value]:
    from mavframecheck.engine import SettingsError, parameter

    target, equals, text = assignment.partition("=")
    code, dot, name = target.strip().partition(".")
    if not (equals and dot):
        message = f"'{sentence(assignment)}' is not CODE.param=value"
        raise click.BadParameter(message, param_hint="--set")
    try:
        code, value = parameter(code, name, text.strip(), pack)
    except SettingsError as error:
        raise click.BadParameter(sentence(str(error)), param_hint="--set") from error
    return code, name, value
