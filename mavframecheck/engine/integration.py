"""The steps in which a new sensor is integrated, judged for one sender by the rules that `check` runs."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from mavframecheck.engine.check import check_file
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.reading import Progress
from mavframecheck.engine.settings import Settings
from mavframecheck.model import FileReport, Finding
from mavframecheck.model.finding import FileSummary
from mavframecheck.model.integration import FileIntegration, Step, StepResult, Verdict

STEPS = (
    Step("axes", "does each axis hold what its label says?", ("MFC401", "MFC512")),
    Step("signs", "does each axis grow in the right direction?", ("MFC402", "MFC404")),
    Step("scale", "metres, metres a second, radians?", ("MFC308", "MFC310", "MFC322", "MFC508")),
    Step(
        "rotation",
        "is it turned into the frame it names, and its attitude with it?",
        ("MFC403", "MFC405", "MFC406", "MFC407", "MFC408", "MFC409", "MFC421", "MFC507", "MFC511"),
    ),
    Step(
        "clock",
        "whose clock are its stamps, in which unit, and do they run?",
        ("MFC801", "MFC802", "MFC803", "MFC804", "MFC805", "MFC806", "MFC807", "MFC809"),
    ),
    Step("delay", "is a stamp the time of measurement?", ("MFC813",)),
    Step("covariance", "can it be one, and in the right order?", ("MFC501", "MFC502", "MFC503")),
    Step("lever arm", "is the way from the sensor to the vehicle's centre left out?", ("MFC418",)),
    Step("resets", "are jumps announced, and does it go on?", ("MFC504", "MFC505", "MFC509")),
    Step("rate", "does it come often enough, and evenly?", ("MFC510",)),
)
"""After the procedure for a new sensor: what of it a recording can prove."""
_NO_RULE = "no rule of this version tells"


def integration_of_file(
    path: str, pack: Pack, settings: Settings, progress: Progress | None = None
) -> FileIntegration:
    """Judge what the sender in `settings` says in the recording at `path` (``-``: standard input).

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` when the dialect cannot be used.
    """
    sender = settings.sender or 0
    codes = tuple(code for step in STEPS for code in step.codes)
    wanted = msgspec.structs.replace(settings, select=codes)
    report, findings = check_file(path, pack, wanted, progress)
    heard = [f"{each.sysid}/{each.compid}" for each in report.vehicles]
    name = f"{sender >> 8}/{sender & 0xFF}"
    summary = {field: getattr(report, field) for field in FileSummary.__struct_fields__}
    return FileIntegration(
        **summary,
        sender=name,
        heard=name in heard,
        others=tuple(each for each in heard if each != name),
        steps=tuple(step_result(step, report, findings) for step in STEPS) if name in heard else (),
    )


def step_result(step: Step, report: FileReport, findings: Sequence[Finding]) -> StepResult:
    """Return how a step ended: failed by a finding, passed only where every rule of it could tell."""
    found = tuple(each for each in findings if each.code in step.codes)
    runs = tuple(run for run in report.runs if run.code in step.codes)
    missing = tuple(
        dict.fromkeys(r.reason for r in runs if r.reason and r.status != "not-applicable")
    )
    verdict: Verdict = "passed"
    if found:
        verdict = "failed"
    elif missing or not runs:
        verdict = "missing"
    elif all(run.status == "not-applicable" for run in runs):
        verdict = "nothing"
    return StepResult(
        step=step.name,
        question=step.question,
        verdict=verdict,
        missing=missing if runs else (_NO_RULE,),
        findings=found,
        runs=runs,
    )
