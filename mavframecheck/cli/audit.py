"""Judging several files: the exit code says how bad the worst finding is."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from mavframecheck import engine
from mavframecheck.cli.files import DONE, FAILED, Advance, Files
from mavframecheck.cli.output import complain
from mavframecheck.cli.progress import Progress
from mavframecheck.cli.settings import Chosen
from mavframecheck.geo.terrain import TerrainError
from mavframecheck.report import Checked, Remark
from mavframecheck.report.escape import sentence
from mavframecheck.report.words import plural

if TYPE_CHECKING:
    from mavframecheck.engine.baseline import Baseline, Judged
    from mavframecheck.engine.policy import Policy

FINDINGS = 1


class Audit(Files[Checked]):
    """The files of one `check`."""

    usage_errors = (
        *Files.usage_errors,
        engine.SettingsError,
        engine.RuleFileError,
        TerrainError,
    )

    def __init__(
        self,
        paths: Sequence[str],
        chosen: Chosen,
        jobs: int = 1,
        *,
        fix: bool = False,
        draw: bool = False,
    ) -> None:
        judge = partial(_judge, chosen.pack, chosen.settings, fix, draw)
        super().__init__(paths, judge, missions=True)
        self._chosen = chosen
        self._jobs = jobs
        self._worst = -1
        self._unwritten = False

    def results(self) -> Iterator[Checked]:
        """Yield each file less what the user has set aside; then say which settings are of no use."""
        policy = self._chosen.policy
        for checked in super().results():
            result = checked
            if policy is not None:
                counting, aside = policy.apply(checked.file, checked.findings)
                result = checked._replace(findings=counting, suppressed=aside)
            self._worst = max([self._worst, *(each.severity.rank for each in result.findings)])
            yield result
        if policy is not None and not self._interrupted:
            self._finish(policy)

    def exit_code(self) -> int:
        """Return the exit code once the results are used up: findings count only when all was read."""
        code = super().exit_code()
        if code == DONE and self._unwritten:
            return FAILED
        return FINDINGS if code == DONE and self._worst >= self._chosen.fail_on.rank else code

    def outcomes(self, files: Sequence[str]) -> Generator[tuple[str, Any]]:
        """Judge one file after the other, or several at once; standard input only here."""
        if self._jobs == 1 or len(files) < 2 or "-" in files:
            yield from super().outcomes(files)
            return
        from mavframecheck.engine.jobs import read_files

        outcomes = read_files(files, self._read, self._jobs)
        yield from Progress(len(files)).together(outcomes, files)

    def _finish(self, policy: Policy) -> None:
        for text in policy.remarks():
            self.remarks.append(Remark(text))
            complain(sentence(text))
        if self._chosen.baseline is not None:
            self._write(self._chosen.baseline, policy.judged)

    def _write(self, baseline: Baseline, judged: Judged) -> None:
        """Write the baseline if all was seen that it is about."""
        self._unwritten = True
        if self._unreadable:
            complain("the baseline is not written: not every file could be read")
            return
        try:
            entries = baseline.write(judged)
        except OSError as error:
            complain(sentence(f"{baseline.file}: cannot be written: {error.strerror}"))
        else:
            self._unwritten = False
            complain(sentence(f"{baseline.file}: now {plural(entries, 'known finding')}"))


def _judge(
    pack: engine.Pack,
    settings: engine.Settings,
    fix: bool,
    draw: bool,
    path: str,
    advance: Advance | None,
) -> tuple[Checked, int]:
    """Judge one file, in whatever process; `fix` first mends what is certain, `draw` keeps what is drawn."""
    if fix:
        from mavframecheck.cli.mend import mend_in_place

        mend_in_place(path, pack, settings)
    if draw:
        file, findings, detail = engine.draw_file(path, pack, settings, advance)
        return Checked(file, findings, detail=detail), file.messages
    checked = Checked(*engine.check_file(path, pack, settings, advance))
    return checked, checked.file.messages
