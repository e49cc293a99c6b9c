"""`check --fix` and `check --diff`: what is certain in mission files."""

from __future__ import annotations

from collections.abc import Sequence

from mavframecheck import engine
from mavframecheck.cli.audit import FINDINGS
from mavframecheck.cli.files import DONE, Advance, Files
from mavframecheck.cli.output import complain, page_context
from mavframecheck.missions import fixes
from mavframecheck.report.escape import sentence, terminal
from mavframecheck.report.words import plural


class Diffs(Files[str]):
    """What would be changed in the files of one `check --diff`."""

    def __init__(self, paths: Sequence[str], pack: engine.Pack, settings: engine.Settings) -> None:
        super().__init__(paths, self._diff, missions=True)
        self._codes = _codes(pack, settings)
        self._edits = 0

    def verdict(self) -> int:
        """Return the exit code once the results are used up: 1 when there is something to mend."""
        code = self.exit_code()
        return FINDINGS if code == DONE and self._edits else code

    def _diff(self, path: str, _: Advance | None) -> tuple[str, int]:
        mended = fixes.mend(path, self._codes)
        if mended is None or not mended.edits:
            return "", 1
        self._edits += mended.edits
        diff = mended.diff()
        return _harmless(diff) if page_context().terminal else diff, 1


def _harmless(diff: str) -> str:
    """Return a diff that a terminal can show: tabs and line ends are kept, other controls are not."""
    lines = diff.replace("\r", "").split("\n")
    return "\n".join("\t".join(map(terminal, line.split("\t"))) for line in lines)


def mend_in_place(path: str, pack: engine.Pack, settings: engine.Settings) -> None:
    """Mend a mission file and say so; leave a recording alone."""
    mended = fixes.mend(path, _codes(pack, settings))
    if mended is not None and mended.edits:
        fixes.write(mended)
        complain(f"{sentence(path)}: {plural(mended.edits, 'value')} corrected")


def _codes(pack: engine.Pack, settings: engine.Settings) -> frozenset[str]:
    return frozenset(rule.rule.code for rule in engine.chosen_rules(pack, settings))
