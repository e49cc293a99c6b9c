"""`mavframecheck inspect --missions`: which missions went over the link, and what vehicles hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from mavframecheck.cli.output import echo
from mavframecheck.report import Context

if TYPE_CHECKING:
    from mavframecheck.engine import Settings
    from mavframecheck.model.missions import FileMissions, HeldMission

FORMATS = ("plan", "waypoints")
"""Formats that other programs load."""


class MissionTable:
    """The missions of recordings."""

    def __init__(self, settings: Settings, messages: tuple[str, ...]) -> None:
        """Read recordings as `settings` say."""
        if messages:
            raise click.UsageError("--message does not go with --missions")
        self._settings = settings

    def show(
        self, paths: tuple[str, ...], form: str, context: Context, *, every_field: bool
    ) -> int:
        """Write the missions of each file; return the exit code."""
        from mavframecheck.cli.files import Files
        from mavframecheck.report.missions import render_json, render_text

        if every_field:
            raise click.UsageError("--all does not go with --missions")
        files = Files(paths, self._read)
        if form in FORMATS:
            for found in list(files.results()):
                echo(iter([_exported(found, form)]))
            return files.exit_code()
        render = render_json if form == "json" else render_text
        echo(render(files.results(), context))
        return files.exit_code()

    def _read(self, path: str, advance: Callable[[int], None] | None) -> tuple[FileMissions, int]:
        from mavframecheck.engine.missions import missions_of_file

        found = missions_of_file(path, self._settings, advance)
        return found, found.messages


def export_paths(paths: tuple[str, ...], form: str | None) -> None:
    """Refuse several files where one mission file is to be written."""
    if form in FORMATS and len(paths) != 1:
        raise click.UsageError(f"--format {form} writes the mission of one recording")


def _exported(found: FileMissions, form: str) -> bytes:
    """Return what the only vehicle holds as a mission file."""
    from mavframecheck.report.json import document
    from mavframecheck.report.missions import plan, waypoints

    held = _of_one_vehicle(found)
    return waypoints(held).encode() if form == "waypoints" else document(plan(held))


def _of_one_vehicle(found: FileMissions) -> list[HeldMission]:
    held = [each for each in found.held if each.items]
    systems = sorted({each.system for each in held})
    if len(systems) != 1:
        holders = (
            f"systems {', '.join(map(str, systems))} hold some" if systems else "none is known"
        )
        raise click.UsageError(f"one mission is to be written, and {holders}: see --missions alone")
    return held
