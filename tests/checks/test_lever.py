"""Lever arms: the part of a stream's way that turns with the vehicle, and nothing that only looks like it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.checks.motion import axes, lever
from mavframecheck.checks.motion.series import Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.alignment import robust_solution
from tests.checks.motion_bench import flight, recording
from tests.checks.rule_bench import pack_of_files
from tests.engine.judged import judge, run_of
from tests.strategies import START_US, frame

PACK = pack_of_files("MFC418")
ARM = np.array([0.45, -0.2, -0.1])


def turning(seconds: float = 40.0, shift_s: float = 0.0) -> Series:
    """Return the made-up flight with a nose that goes round once in 12 s."""
    true = flight(seconds, shift_s)
    roll, pitch, _ = q4.euler_from_quaternion(true.attitude).T
    yaw = 2 * np.pi * (true.t - shift_s) / 12 + 0.8 * np.sin(0.9 * (true.t - shift_s))
    return dataclasses.replace(true, attitude=q4.quaternion_from_euler(roll, pitch, yaw))


TRUE = turning()


def carried(arm: np.ndarray, noise_m: float = 0.02, shift_s: float = 0.0) -> Series:
    """Return the way of what sits `arm` beside the vehicle."""
    late = turning(shift_s=shift_s)
    noise = np.random.default_rng(3).normal(0, noise_m, late.place.shape)
    return dataclasses.replace(late, place=late.place + q4.turn_by(late.attitude, arm) + noise)


def judged(stream: Series, reference: Series = TRUE, frame: axes.Frame = axes.NED) -> lever.Lever:
    """Return the conclusion, which there must be."""
    fit = axes.compare(stream, reference, frame)
    assert isinstance(fit, axes.Fit)
    found = lever.compare(stream, reference, reference, fit)
    assert isinstance(found, lever.Lever)
    return found


@pytest.mark.parametrize("shift_s", [0.0, 0.12, 0.4])
@pytest.mark.parametrize("arm", [(0.45, -0.2, -0.1), (-1.2, 0.0, 0.3), (0.0, 0.6, 0.0)])
def test_arms(arm: tuple[float, float, float], shift_s: float) -> None:
    """An arm is measured to centimetres, however late the stream comes."""
    found = judged(carried(np.array(arm), shift_s=shift_s))
    assert found.there
    assert np.allclose(found.arm, arm[:2], atol=0.05)


def test_words() -> None:
    """A part that is none is not named."""
    assert judged(carried(ARM)).says.startswith("0.4")
    assert " m forward and 0." in judged(carried(ARM)).says
    assert judged(carried(np.array([-1.2, 0.0, 0.5]))).says.endswith(" m back")


@pytest.mark.parametrize(
    "of",
    [
        lambda s: s.place,
        lambda s: s.place + np.array([0.5, -0.3, 0.1]),
        lambda s: s.place * 1.06,
        lambda s: s.place + np.column_stack((0.02 * s.t, -0.01 * s.t, 0 * s.t)),
        lambda s: s.place + np.random.default_rng(1).normal(0, 0.3, s.place.shape),
        lambda s: q4.turn_by(q4.about_z(0.12), s.place),
    ],
    ids=["right", "elsewhere", "longer", "drifting", "noisy", "turned"],
)
def test_no_arm(of: Callable[[Series], np.ndarray]) -> None:
    """Offsets of the world, scale, drift, noise and headings are none."""
    assert not judged(dataclasses.replace(TRUE, place=of(TRUE))).there


def test_a_vehicle_that_flies_along_its_nose() -> None:
    """At one speed an arm ahead and a delay are the same: none is told, and a short one would not show."""
    t = np.arange(0, 60, 0.1)
    place = np.column_stack((60 * np.sin(0.25 * t), -60 * np.cos(0.25 * t), 0 * t))
    lies = q4.quaternion_from_euler(0.2 + 0 * t, 0 * t, 0.25 * t)
    true = dataclasses.replace(TRUE, t=t, place=place, attitude=lies, velocity=0 * place, stamp=t)
    late = q4.turn_by(lies, [-0.6, 0, 0])
    found = judged(dataclasses.replace(true, place=place + late), true)
    assert not found.there
    assert found.shows_m > 1


def test_straight_on() -> None:
    """Without a turn it says what is missing."""
    still = dataclasses.replace(TRUE, attitude=q4.quaternion_from_euler(0 * TRUE.t, 0, 0.3))
    fit = axes.compare(still, still, axes.NED)
    assert isinstance(fit, axes.Fit)
    assert "hardly turns" in str(lever.compare(still, still, still, fit))


def test_unknowns_of_which_nothing_is_said() -> None:
    """They could be anything; the others are as by least squares."""
    dice = np.random.default_rng(4)
    columns = np.concatenate((dice.normal(size=(90, 2, 2)), np.zeros((90, 2, 1))), axis=2)
    solution = robust_solution(columns, columns @ [2.0, -1.0, 0.0], 90)
    assert np.allclose(solution.values, [2, -1, 0])
    assert solution.errors[2] > 10
    assert (solution.errors[:2] < 1e-3).all()


def vision(arm: np.ndarray) -> Callable[[Series, int], dict[str, Any]]:
    """Return the fields of a pose of what sits `arm` beside the vehicle."""

    def fields(true: Series, k: int) -> dict[str, Any]:
        x, y, z = (true.place[k] + q4.turn_by(true.attitude[k], arm)).tolist()
        lies = q4.euler_from_quaternion(true.attitude[k]).tolist()
        angles = dict(zip(("roll", "pitch", "yaw"), lies, strict=True))
        return {"usec": k * 100_000, "x": x, "y": y, "z": z, **angles}

    return fields


LONG = np.array([1.2, 0.0, 0.0])
WRONG = recording("VISION_POSITION_ESTIMATE", vision(LONG))


def told(name: str, value: float) -> bytes:
    """Return a parameter as the autopilot says it."""
    fields = {"param_id": name.encode(), "param_value": value, "param_type": 9}
    return START_US.to_bytes(8, "big") + frame("PARAM_VALUE", fields)


NOT_FED = told("EK3_SRC1_POSXY", 3) + told("EK3_SRC1_POSZ", 1)


def test_finding() -> None:
    """One mistake makes one finding, that says where the sensor sits."""
    ((finding,), run) = (judge(WRONG, pack=PACK)[1], run_of(judge(WRONG, pack=PACK), "MFC418"))
    assert "m forward of the vehicle's point of reference" in finding.text
    assert finding.severity == "info"
    assert run.status == "ran"


def test_clean() -> None:
    """No arm is no finding, and a pass only where the reference is not made from the stream."""
    right = recording("VISION_POSITION_ESTIMATE", vision(0 * LONG))
    fed, free = judge(right, pack=PACK), judge(NOT_FED + right, pack=PACK)
    assert not fed[1]
    assert not free[1]
    assert "may be made from it" in run_of(fed, "MFC418").reason
    assert run_of(free, "MFC418").status == "ran"


def test_told_to_the_autopilot() -> None:
    """Where a parameter says where the sensor sits, its own position is right."""
    result = judge(told("VISO_POS_X", 1.2) + WRONG, pack=PACK)
    assert not result[1]
    assert "told where the sensor sits" in run_of(result, "MFC418").reason


def test_without_a_position() -> None:
    """A pose that is nowhere is left alone."""
    empty = recording(
        "VISION_POSITION_ESTIMATE", lambda *_: dict.fromkeys(("x", "y", "z"), float("nan"))
    )
    assert not judge(empty, pack=PACK)[1]


@settings(max_examples=6, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, len(WRONG)), min_size=1, max_size=12))
def test_cuts(cuts: list[int]) -> None:
    """Findings do not depend on batches."""
    assert judge(WRONG, cuts, PACK)[1] == judge(WRONG, pack=PACK)[1]
