"""`mavframecheck inspect --contract`: what a recorded system sends, to compare others with."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from mavframecheck.cli.output import echo
from mavframecheck.report import Context

if TYPE_CHECKING:
    from mavframecheck.engine import Settings
    from mavframecheck.model.survey import FileSurvey


class ContractText:
    """The contract of one recording, as TOML."""

    def __init__(self, settings: Settings, messages: tuple[str, ...]) -> None:
        """Read the recording as `settings` say."""
        if messages:
            raise click.UsageError("--message does not go with --contract")
        self._settings = settings

    def show(
        self, paths: tuple[str, ...], form: str, context: Context, *, every_field: bool
    ) -> int:
        """Write the contract that the recording shows; return the exit code."""
        from mavframecheck.cli.files import Files
        from mavframecheck.engine.contract import terms, worth_keeping
        from mavframecheck.report.contract import toml

        del context
        if form == "json" or every_field:
            raise click.UsageError("--contract is TOML: leave out --format and --all")
        if len(paths) != 1:
            raise click.UsageError("--contract is made from one recording")
        files = Files(paths, self._read)
        for survey in files.results():
            echo(toml(worth_keeping(terms(survey.senders)), survey.path))
        return files.exit_code()

    def _read(self, path: str, advance: Callable[[int], None] | None) -> tuple[FileSurvey, int]:
        from mavframecheck.engine.survey import survey_file

        survey = survey_file(path, self._settings, (), advance)
        return survey, survey.messages
