"""What is said of one sender is about that sender: others, right or wrong, change neither findings nor verdicts."""

from __future__ import annotations

import pytest

from mavframecheck.engine import Settings
from mavframecheck.engine.examples import recording
from mavframecheck.engine.integration import STEPS, integration_of_file
from mavframecheck.model.integration import StepResult
from tests.checks.motion_bench import recording as recording_of
from tests.checks.rule_bench import RULES, pack_of_files, rule_named
from tests.checks.test_motion import enu, ned
from tests.engine.judged import judge, run_of, shipped
from tests.strategies import DIALECT

OF_STEPS = {code for step in STEPS for code in step.codes}
OF_SENDERS = ("MFC410", "MFC412", "MFC413", "MFC414", "MFC415", "MFC417", "MFC419", "MFC420")
OF_SENSORS = ("MFC122", "MFC309", "MFC313", "MFC319", "MFC320", "MFC606", "MFC612", "MFC812")
CODES = sorted({*OF_STEPS, *OF_SENDERS, *OF_SENSORS})
CHECKED = [code for code in CODES if rule_named(code).detect.check]
NOBODY = 7 << 8 | 7


@pytest.mark.parametrize("code", CHECKED)
def test_verdicts(code: str) -> None:
    """Asked about the sender that is wrong the same is found; asked about another the rule does not apply."""
    pack = pack_of_files(code)
    for example in rule_named(code).example:
        data = recording(example, DIALECT)
        whole = judge(data, pack=pack)
        other = judge(data, pack=pack, sender=NOBODY)
        assert not other[1]
        assert run_of(other, code).status == "not-applicable"
        for finding in whole[1]:
            assert finding.sysid is not None
            assert finding.compid is not None
            sender = finding.sysid << 8 | finding.compid
            assert finding in judge(data, pack=pack, sender=sender)[1]


def test_steps_are_judged() -> None:
    """The steps are covered by the test above, but for rules of expressions."""
    assert len(CHECKED) >= 35
    assert len(list(RULES.glob("*/*.toml"))) > len(CHECKED)


RIGHT, WRONG = 1 << 8 | 192, 1 << 8 | 191


@pytest.fixture(name="two", scope="module")
def _two(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return a flight with two cameras: one in east-north-up, one right."""
    file = tmp_path_factory.mktemp("two") / "two.tlog"
    file.write_bytes(recording_of("VISION_POSITION_ESTIMATE", enu, second=ned))
    return str(file)


def steps(file: str, sender: int) -> dict[str, StepResult]:
    """Return the steps of a sender by name."""
    found = integration_of_file(file, shipped(), Settings(sender=sender))
    return {step.step: step for step in found.steps}


def test_two_cameras(two: str) -> None:
    """The wrong one fails; the right one passes where it would alone."""
    wrong, right = steps(two, WRONG), steps(two, RIGHT)
    assert wrong["axes"].verdict == "failed"
    assert {finding.compid for step in wrong.values() for finding in step.findings} == {191}
    assert not [step for step in right.values() if step.findings]
    for name in ("axes", "signs", "scale", "covariance", "resets"):
        assert right[name].verdict in ("passed", "nothing"), name
    assert right["axes"].verdict == "passed"


def test_the_vehicle_is_another_sender(two: str) -> None:
    """An autopilot that is asked for is not judged by what cameras send it."""
    assert not [step for step in steps(two, 1 << 8 | 1).values() if step.verdict == "failed"]
