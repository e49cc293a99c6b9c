"""`mavframecheck inspect --clocks`: whose clock each stamp is, and how it runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mavframecheck.cli.output import echo
from mavframecheck.report import Context

if TYPE_CHECKING:
    from mavframecheck.engine import Settings
    from mavframecheck.model.clocks import FileClocks


class ClockTable:
    """The clocks of recordings."""

    def __init__(self, settings: Settings, _messages: tuple[str, ...]) -> None:
        """Read recordings as `settings` say."""
        self._settings = settings

    def show(
        self, paths: tuple[str, ...], form: str, context: Context, *, every_field: bool
    ) -> int:
        """Write the clocks of each file (`every_field` changes nothing); return the exit code."""
        del every_field
        from mavframecheck.cli.files import Files
        from mavframecheck.report.clocks import render_json, render_text

        files = Files(paths, self._read)
        render = render_json if form == "json" else render_text
        echo(render(files.results(), context))
        return files.exit_code()

    def _read(self, path: str, advance: Callable[[int], None] | None) -> tuple[FileClocks, int]:
        from mavframecheck.engine.clocks import clocks_of_file

        clocks = clocks_of_file(path, self._settings, advance)
        return clocks, clocks.messages
