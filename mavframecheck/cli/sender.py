"""`mavframecheck inspect --sender`: the integration of one sensor, step by step."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from mavframecheck.cli.output import echo
from mavframecheck.report import Context
from mavframecheck.report.escape import sentence

if TYPE_CHECKING:
    from mavframecheck.engine import Settings
    from mavframecheck.model.integration import FileIntegration


def parse_sender(_ctx: click.Context, _param: click.Parameter, value: str | None) -> int | None:
    """Return ``sysid * 256 + compid`` of ``SYS/COMP``: a system and a component, 0 to 255 each."""
    if value is None:
        return None
    parts = value.split("/")
    if len(parts) != 2 or not all(p.isascii() and p.isdigit() and int(p) < 256 for p in parts):
        raise click.BadParameter(
            f"{sentence(value)} is no sender: write SYS/COMP, as in 1/191.", param_hint="--sender"
        )
    return int(parts[0]) << 8 | int(parts[1])


class Integration:
    """The steps for one sender in recordings."""

    def __init__(self, settings: Settings, messages: tuple[str, ...]) -> None:
        """Judge the sender that `settings` name."""
        if messages:
            raise click.UsageError("--message does not go with --sender")
        self._settings = settings

    def show(
        self, paths: tuple[str, ...], form: str, context: Context, *, every_field: bool
    ) -> int:
        """Write the verdicts for each file; return the exit code."""
        from mavframecheck.cli.files import Files
        from mavframecheck.report.integration import render_json, render_text

        if every_field:
            raise click.UsageError("--all does not go with --sender")
        files = Files(paths, self._read)
        render = render_json if form == "json" else render_text
        echo(render(files.results(), context))
        return files.exit_code()

    def _read(
        self, path: str, advance: Callable[[int], None] | None
    ) -> tuple[FileIntegration, int]:
        from mavframecheck.engine import load_pack
        from mavframecheck.engine.integration import integration_of_file

        found = integration_of_file(path, load_pack(()), self._settings, advance)
        return found, found.messages
