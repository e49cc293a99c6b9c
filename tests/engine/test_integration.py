"""The steps of integrating a sensor: what `check` says of one sender, and nothing passes unseen."""

from __future__ import annotations

import pytest

from mavframecheck.engine import Settings
from mavframecheck.engine.integration import STEPS, integration_of_file
from mavframecheck.model.integration import FileIntegration, StepResult
from samples.make import HERE
from tests.engine.judged import shipped

COMPANION, GCS = 1 << 8 | 191, 255 << 8 | 190


def judged(name: str, sender: int = COMPANION) -> FileIntegration:
    """Return the steps for a sender in a sample."""
    return integration_of_file(str(HERE / name), shipped(), Settings(sender=sender))


def steps(name: str) -> dict[str, StepResult]:
    """Return the steps of the companion by name."""
    return {step.step: step for step in judged(name).steps}


def test_a_good_sensor_fails_nowhere() -> None:
    """What the flight shows passes, what it does not show is said to be missing."""
    found = steps("clean_vision.tlog")
    assert list(found) == [step.name for step in STEPS]
    assert not [step for step in found.values() if step.findings]
    passed = {name for name, step in found.items() if step.verdict == "passed"}
    assert {"axes", "signs", "scale", "covariance", "resets"} <= passed


@pytest.mark.parametrize(
    ("sample", "step", "code"),
    [
        ("vision_in_enu.tlog", "axes", "MFC401"),
        ("vision_height_up.tlog", "signs", "MFC402"),
        ("vision_scaled.tlog", "scale", "MFC508"),
        ("vision_turned_frame.tlog", "rotation", "MFC507"),
        ("odometry_velocity_of_the_world.tlog", "rotation", "MFC407"),
        ("vision_late.tlog", "delay", "MFC813"),
        ("bad_covariance.tlog", "covariance", "MFC502"),
        ("vision_jumps.tlog", "resets", "MFC504"),
    ],
)
def test_a_mistake_fails_its_step_alone(sample: str, step: str, code: str) -> None:
    """One mistake, one failed step."""
    found = steps(sample)
    assert [name for name, each in found.items() if each.verdict == "failed"] == [step]
    assert [finding.code for finding in found[step].findings] == [code]


def test_without_motion_nothing_passes_that_only_motion_shows() -> None:
    """The odometry sample flies one side of the square: north and up, and hardly turns."""
    found = steps("clean_odometry.tlog")
    for name in ("axes", "rotation"):
        assert found[name].verdict == "missing"
        assert any("ODOMETRY: " in reason for reason in found[name].missing)
    assert "north-south and east-west" in " ".join(found["axes"].missing)


def test_other_senders_do_not_count() -> None:
    """A ground station that sends no pose fails nothing in a recording full of faults."""
    found = judged("vision_in_enu.tlog", GCS)
    assert found.heard
    assert {step.verdict for step in found.steps} <= {"nothing", "missing", "passed"}
    assert next(s for s in found.steps if s.step == "axes").verdict == "nothing"


def test_who_is_not_heard() -> None:
    """A sender that is not there has no steps, and those who are there are named."""
    found = judged("clean_vision.tlog", 7 << 8 | 7)
    assert (found.heard, found.steps) == (False, ())
    assert set(found.others) == {"1/1", "1/191", "255/190"}


def test_every_step_names_rules_of_the_pack_or_says_so() -> None:
    """Codes are of the pack, or of rules to come, which then are said to be missing."""
    known = {rule.code for rule in shipped().rules}
    for result, step in zip(judged("clean_vision.tlog").steps, STEPS, strict=True):
        if not known & set(step.codes):
            assert result.missing == ("no rule of this version tells",)
