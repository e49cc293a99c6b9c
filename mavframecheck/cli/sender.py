"""`mavframecheck inspect --sender`: the integration of one sensor, step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from mavframecheck.cli.views import Advance, View
from mavframecheck.report import Context
from mavframecheck.report.escape import sentence

if TYPE_CHECKING:
    from mavframecheck.model.integration import FileIntegration
    from mavframecheck.report.layout import FilePage


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


class Integration(View["FileIntegration"]):
    """The steps for the one sender that the settings name."""

    option = "--sender"

    def read(self, path: str, advance: Advance) -> FileIntegration:
        """Return the verdicts of one recording."""
        from mavframecheck.engine import load_pack
        from mavframecheck.engine.integration import integration_of_file

        return integration_of_file(path, load_pack(()), self.settings, advance)

    def page(self, context: Context) -> FilePage[FileIntegration]:
        """Return the page of verdicts."""
        from mavframecheck.report.integration import StepPage

        return StepPage(context)
