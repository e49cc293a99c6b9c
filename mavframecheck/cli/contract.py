"""`mavframecheck inspect --contract`: what a recorded system sends, to compare others with."""

from __future__ import annotations

import click

from mavframecheck.cli.output import echo
from mavframecheck.cli.views import Map
from mavframecheck.report import Context


class ContractText(Map):
    """The contract of one recording, as TOML."""

    option = "--contract"
    goes_with = frozenset({"--all"})  # refused below, with a word on the format

    def show(self, paths: tuple[str, ...], form: str, context: Context) -> int:  # noqa: ARG002
        """Write the contract that the recording shows; return the exit code."""
        from mavframecheck.cli.files import Files
        from mavframecheck.engine.contract import terms, worth_keeping
        from mavframecheck.report.contract import toml

        if form == "json" or self.every_field:
            raise click.UsageError("--contract is TOML: leave out --format and --all")
        if len(paths) != 1:
            raise click.UsageError("--contract is made from one recording")
        files = Files(paths, self.counted)
        for survey in files.results():
            echo(toml(worth_keeping(terms(survey.senders)), survey.path))
        return files.exit_code()
