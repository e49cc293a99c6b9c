"""Judging several files: the exit code says how bad the worst finding is."""

from __future__ import annotations

from collections.abc import Sequence

import click

from mavframecheck import engine
from mavframecheck.cli.files import DONE, Advance, Files
from mavframecheck.model import Severity
from mavframecheck.report import Checked
from mavframecheck.report.escape import sentence

FINDINGS = 1


class Audit(Files[Checked]):
    """The files of one `check`."""

    def __init__(
        self,
        paths: Sequence[str],
        pack: engine.Pack,
        settings: engine.Settings,
        *,
        fix: bool = False,
    ) -> None:
        super().__init__(paths, self._judge, missions=True)
        self._fix = fix
        self._pack = pack
        self._settings = settings
        self._worst = -1

    def verdict(self, fail_on: Severity) -> int:
        """Return the exit code once the results are used up: findings count only when all was read."""
        code = self.exit_code()
        return FINDINGS if code == DONE and self._worst >= fail_on.rank else code

    def _judge(self, path: str, advance: Advance | None) -> tuple[Checked, int]:
        if self._fix:
            from mavframecheck.cli.mend import mend_in_place

            mend_in_place(path, self._pack, self._settings)
        try:
            checked = Checked(*engine.check_file(path, self._pack, self._settings, advance))
        except (engine.SettingsError, engine.RuleFileError) as error:
            raise click.UsageError(sentence(str(error))) from error
        self._worst = max([self._worst, *(each.severity.rank for each in checked.findings)])
        return checked, checked.file.messages
