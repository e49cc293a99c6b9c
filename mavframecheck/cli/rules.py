"""`mavframecheck rules`: the list of rules."""

from __future__ import annotations

from pathlib import Path

import click

from mavframecheck.cli.options import load_rules, rules_option
from mavframecheck.cli.output import echo, lines, page_context


@click.command()
@rules_option
@click.option("--format", "form", type=click.Choice(["text", "json"]), default="text")
def rules(directories: tuple[Path, ...], form: str) -> None:
    """List the rules: code, name, severity, status, summary."""
    from mavframecheck.report.rules import listing, listing_json

    pack = load_rules(directories)
    if form == "json":
        echo([listing_json(pack.rules)])
    else:
        echo(lines(listing(pack.rules, page_context())))
