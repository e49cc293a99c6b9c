"""`mavframecheck inspect --missions`: which missions went over the link, and what vehicles hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from mavframecheck.cli.output import echo
from mavframecheck.cli.views import Advance, View
from mavframecheck.report import Context

if TYPE_CHECKING:
    from mavframecheck.model.missions import FileMissions, HeldMission
    from mavframecheck.report.layout import FilePage

FORMATS = ("plan", "waypoints")
"""Formats that other programs load."""


class MissionTable(View["FileMissions"]):
    """The missions of recordings."""

    option = "--missions"

    def show(self, paths: tuple[str, ...], form: str, context: Context) -> int:
        """Write the missions of each file, or what the only vehicle holds as a mission file."""
        if form not in FORMATS:
            return super().show(paths, form, context)
        from mavframecheck.cli.files import Files

        files = Files(paths, self.counted)
        for found in list(files.results()):
            echo(iter([_exported(found, form)]))
        return files.exit_code()

    def read(self, path: str, advance: Advance) -> FileMissions:
        """Return the missions of one recording."""
        from mavframecheck.engine.missions import missions_of_file

        return missions_of_file(path, self.settings, advance)

    def page(self, context: Context) -> FilePage[FileMissions]:
        """Return the page of transfers and missions."""
        from mavframecheck.report.missions import MissionPage

        return MissionPage(context)


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
