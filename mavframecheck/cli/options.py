"""What the options of several commands mean, and the usage errors they raise."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import click

from mavframecheck.model import Rule
from mavframecheck.report.escape import sentence
from mavframecheck.report.words import setting

if TYPE_CHECKING:
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

dialect_option = click.option(
    "--dialect",
    metavar="NAME|FILE.xml",
    default="ardupilotmega",
    show_default=True,
    help="MAVLink dialect of the recording.",
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


def selected(option: str, values: Iterable[str], pack: Pack) -> tuple[str, ...]:
    """Return the codes and prefixes in `values` (separated by commas, or several); names count."""
    words = [word.strip() for value in values for word in value.split(",") if word.strip()]
    return tuple(_selector(option, word, pack) for word in words)


def _selector(option: str, word: str, pack: Pack) -> str:
    if any(rule.code.startswith(word.upper()) for rule in pack.rules):
        return word.upper()
    for rule in pack.rules:
        if rule.name == word.lower():
            return rule.code
    known = [text for rule in pack.rules for text in (rule.code, rule.name)]
    raise click.BadParameter(
        f"no rule has the code or prefix '{word}'. {similar(word, known)}", param_hint=option
    )


def overrides(assignments: Iterable[str], pack: Pack) -> dict[str, dict[str, Value]]:
    """Return code to parameter to value, from ``CODE.param=value`` typed like the rule's own."""
    result: dict[str, dict[str, Value]] = {}
    for assignment in assignments:
        target, equals, text = assignment.partition("=")
        code, dot, name = target.strip().partition(".")
        if not (equals and dot):
            raise _bad_set(f"'{assignment}' is not CODE.param=value")
        rule = _rule(code, pack)
        result.setdefault(rule.code, {})[name] = _typed(rule, name, text.strip())
    return result


def _rule(code: str, pack: Pack) -> Rule:
    rule = pack.by_code.get(code.upper())
    if rule is None:
        adjustable = [each.code for each in pack.rules if each.params]
        raise _bad_set(
            f"there is no rule {code}. {similar(code.upper(), adjustable)} Rules with parameters: {', '.join(adjustable) or 'none'}."
        )
    return rule


def _typed(rule: Rule, name: str, text: str) -> Value:
    """Return `text` as the type that the parameter has in the rule file."""
    if name not in rule.params:
        known = ", ".join(f"{key}={setting(value)}" for key, value in rule.params.items())
        raise _bad_set(f"{rule.code} has no parameter '{name}'. It has: {known or 'none'}.")
    kind = type(rule.params[name])
    try:
        return _BOOLEANS[text.lower()] if kind is bool else _finite(kind(text))
    except (KeyError, ValueError):
        raise _bad_set(f"{rule.code}.{name} takes {_KINDS[kind]}, not '{text}'.") from None


_BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}


def _finite(value: Value) -> Value:
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError
    return value


def _bad_set(message: str) -> click.BadParameter:
    return click.BadParameter(message, param_hint="--set")


def similar(word: str, known: Iterable[str]) -> str:
    """Return a sentence that names what the user may have meant, and where the list is."""
    from difflib import get_close_matches

    folded = {text.lower(): text for text in known}
    close = [folded[match] for match in get_close_matches(word.lower(), folded, cutoff=0.5)]
    meant = f"Did you mean {' or '.join(close)}? " if close else ""
    return f"{meant}'mavframecheck rules' lists them."
