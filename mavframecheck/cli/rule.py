"""`mavframecheck rule CODE`: one rule, explained from its file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavframecheck.cli.options import complete_codes, load_rules, rules_option
from mavframecheck.cli.output import echo, lines, page_context
from mavframecheck.model import Rule

if TYPE_CHECKING:
    from mavframecheck.engine import Pack


@click.command()
@click.argument("code", shell_complete=complete_codes)
@rules_option
@click.option("--format", "form", type=click.Choice(["text", "json"]), default="text")
def rule(code: str, directories: tuple[Path, ...], form: str) -> None:
    """Explain the rule with this CODE or name."""
    from mavframecheck.report.rules import explanation, explanation_json

    found = _find(code, load_rules(directories))
    if form == "json":
        echo([explanation_json(found)])
    else:
        echo(lines(explanation(found, page_context())))


def _find(wanted: str, pack: Pack) -> Rule:
    for each in pack.rules:
        if wanted.upper() == each.code or wanted.lower() == each.name:
            return each
    from mavframecheck.engine import similar

    known = [word for each in pack.rules for word in (each.code, each.name)]
    raise click.UsageError(f"no rule is called '{wanted}'. {similar(wanted, known)}")
