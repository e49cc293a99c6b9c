"""What was found and how much was judged, in a line: silence must not read as a pass."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

from mavframecheck.model import FileReport, Finding, RuleRun, Severity, Subject
from mavframecheck.model.finding import MISSION_KINDS
from mavframecheck.report import Checked
from mavframecheck.report.words import autopilot, plural, shortened

_MOST_AUTOPILOTS = 4
_ORDER = ("ran", "insufficient-data", "not-applicable")
"""A rule that ends differently on different streams counts as the first of these."""


class Census:
    """Counts over all files of a run, taken while they go by."""

    def __init__(self) -> None:
        self.files: list[FileReport] = []
        self.severities: Counter[Severity] = Counter()
        self.suppressed = 0
        self.rules: dict[str, RuleCount] = {}
        """By code, in the order met."""

    def add(self, checked: Checked) -> None:
        """Count one file."""
        self.files.append(checked.file)
        self.suppressed += len(checked.suppressed)
        for finding in checked.findings:
            self.severities[finding.severity] += 1
            count = self.rules.setdefault(finding.code, RuleCount(finding.name, finding.severity))
            count.add(finding, checked.file.path)

    def count(self, results: Iterable[Checked]) -> Iterator[Checked]:
        """Yield `results`, counted."""
        for checked in results:
            self.add(checked)
            yield checked

    @property
    def total(self) -> str:
        """What was found in all files: ``3 files: 2 errors``."""
        return f"{plural(len(self.files), 'file')}: {found(self.severities, self.suppressed)}"


class RuleCount:
    """What one rule found in all files."""

    def __init__(self, name: str, severity: Severity) -> None:
        self.name = name
        self.severity = severity
        """The worst that it found."""
        self.findings = 0
        self.files: set[str] = set()
        self.senders: set[str] = set()
        """``system/component`` of those who sent what it found."""

    def add(self, finding: Finding, path: str) -> None:
        """Count a finding in the file at `path`."""
        self.findings += 1
        self.severity = max(self.severity, finding.severity, key=lambda each: each.rank)
        self.files.add(path)
        if finding.sysid is not None:
            self.senders.add(str(Subject(finding.sysid, finding.compid)))


def found(severities: Counter[Severity], suppressed: int = 0) -> str:
    """Return ``2 errors, 1 warning``, or that there is nothing; and how much was set aside."""
    counts = [
        f"{severities[severity]} info"
        if severity is Severity.INFO
        else plural(severities[severity], severity)
        for severity in Severity
        if severities[severity]
    ]
    aside = [f"{suppressed} suppressed"] if suppressed else []
    return ", ".join([*(counts or ["no findings"]), *aside])


def judged(files: Sequence[FileReport], *, verbose: bool = False) -> str:
    """Return how much was judged, and by what idea of the vehicle; `verbose` says all there is to say."""
    ends = Counter(verdicts(chain.from_iterable(file.runs for file in files)).values())
    idle = ends["not-applicable"] + ends["insufficient-data"]
    parts = [
        f"{plural(ends['ran'], 'rule')} ran",
        f"{ends['not-applicable']} not applicable",
        f"{ends['insufficient-data']} insufficient"
        + (" (see --verbose)" if idle and not verbose else ""),
        *_read(files),
        _vehicles(files),
    ]
    return ", ".join(parts)


def _read(files: Sequence[FileReport]) -> Iterator[str]:
    """Yield how much was read of recordings, and of missions."""
    missions = [file for file in files if file.kind in MISSION_KINDS]
    recordings = [file for file in files if file.kind not in MISSION_KINDS]
    if missions:
        yield plural(sum(file.messages for file in missions), "mission item")
    if recordings:
        checksums = sum(file.bad_crc for file in recordings)
        yield plural(sum(file.messages for file in recordings), "frame")
        yield from [plural(checksums, "bad checksum")] if checksums else []
        yield f"{plural(sum(file.skipped_bytes for file in recordings), 'byte')} skipped"


def verdicts(runs: Iterable[RuleRun]) -> dict[str, str]:
    """Return code to how the rule ended where it came furthest."""
    return {code: run.status for code, run in furthest(runs).items()}


def furthest(runs: Iterable[RuleRun]) -> dict[str, RuleRun]:
    """Return code to the run of the rule that came furthest."""
    best: dict[str, RuleRun] = {}
    for run in runs:
        best[run.code] = min(best.get(run.code, run), run, key=_order)
    return best


def _order(run: RuleRun) -> int:
    return _ORDER.index(run.status)


def _vehicles(files: Sequence[FileReport]) -> str:
    speakers = [vehicle for file in files for vehicle in file.vehicles]
    known = sorted({autopilot(each) for each in speakers if each.role == "autopilot"})
    if known:
        return shortened(known, _MOST_AUTOPILOTS)
    if speakers and all(each.role == "gcs" for each in speakers):
        return "no vehicle in this log" if len(files) == 1 else "no vehicle in these logs"
    return "unknown autopilot"
