"""`inspect --sender`: the steps of integrating a sensor, with a verdict each, as text and as JSON."""

from __future__ import annotations

from collections.abc import Iterator

from mavframecheck.model.integration import FileIntegration, StepResult, Verdict
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import FilePage
from mavframecheck.report.words import extent, shortened

_WORDS: dict[Verdict, str] = {
    "passed": "passed",
    "failed": "FAILED",
    "missing": "not told",
    "nothing": "not judged",
}
_COLOURS: dict[Verdict, str] = {"passed": "green", "failed": "red", "missing": "yellow"}
_WIDTH = 12
MOST_OTHERS = 12


class StepPage(FilePage[FileIntegration]):
    """Writes verdicts for one context."""

    def file(self, found: FileIntegration) -> Iterator[str]:
        """Yield the head, and each step."""
        yield self.bold(sentence(found.path))
        yield from self.wrap(extent(found), "  ", "    ")
        for note in found.notes:
            yield from self.wrap(f"note: {note}", "  ", "    ")
        if not found.heard:
            others = shortened(list(found.others), MOST_OTHERS) or "nobody"
            yield from self.wrap(f"{found.sender} says nothing here; heard: {others}", "  ", "    ")
            return
        yield ""
        yield self.paint(f"{found.sender}", "cyan")
        for step in found.steps:
            yield from self._step(step)

    def _step(self, step: StepResult) -> Iterator[str]:
        word = _WORDS[step.verdict]
        painted = self.paint(word, _COLOURS[step.verdict]) if step.verdict in _COLOURS else word
        start = f"  {step.step:{_WIDTH}}"
        line = f"{start}{word:{_WIDTH + 2}}{step.question}"
        yield line.replace(word, painted, 1)
        indent = " " * len(start)
        for finding in step.findings:
            yield from self.wrap(f"{finding.code}: {finding.text}", indent, indent + "  ")
        for reason in step.missing:
            yield from self.wrap(reason, indent, indent + "  ")
