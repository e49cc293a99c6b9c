"""Turning rates in another unit: found where the vehicle turns, whatever the mounting, and nowhere else."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.geo import quaternions as q4
from tests.checks.rule_bench import pack_of_files
from tests.engine.judged import Result, judge, run_of
from tests.strategies import START_US, frame

PACK = pack_of_files("MFC322", "MFC308", "MFC317")
DEG = 180 / np.pi
NAMES = ("xgyro", "ygyro", "zgyro")
SPEEDS = ("rollspeed", "pitchspeed", "yawspeed")
Fields = Callable[[np.ndarray], dict[str, Any]]
"""Fields of a message by the rates of the body, rad/s."""


def flight(
    message: str, fields: Fields, turning: float = 1.0, attitude: float = 1.0, seconds: float = 30.0
) -> bytes:
    """Return a vehicle that turns at up to 35 deg/s times `turning`, and what is said of it ten times a second."""
    t = np.arange(0, seconds, 0.1)
    yaw, roll = 0.8 * np.sin(0.7 * t) * turning, 0.1 * np.sin(0.9 * t) * turning
    lies = q4.quaternion_from_euler(roll, 0 * t, yaw)
    turn = q4.product(q4.inverse(lies[:-1]), lies[1:])
    rates = 2 * turn[:, 1:] * np.sign(turn[:, :1]) / 0.1
    data = b""
    for k, body in enumerate(rates):
        boot = {"time_boot_ms": 100 * k}
        said = dict(zip(SPEEDS, (body * attitude).tolist(), strict=True))
        frames = [frame("ATTITUDE", {"roll": roll[k], "yaw": yaw[k], **said, **boot})]
        if message != "ATTITUDE":
            frames.append(frame(message, fields(body), (1, 1)))
        if k % 10 == 0:
            frames.append(frame("HEARTBEAT", {"type": 2, "autopilot": 3}))
        for each in frames:
            data += (START_US + 100_000 * k).to_bytes(8, "big") + each
    return data


def scaled(factor: float, whole: bool = False, names: tuple[str, ...] = NAMES) -> Fields:
    """Return rates times a factor."""

    def fields(body: np.ndarray) -> dict[str, Any]:
        values = (body * factor).round().astype(int) if whole else body * factor
        return {"fields_updated": 63, **dict(zip(names, values.tolist(), strict=True))}

    return fields


def highres(factor: float) -> Fields:
    """Return a gyroscope in rad/s times a factor."""
    return scaled(factor)


def imu(factor: float) -> Fields:
    """Return a gyroscope in whole numbers, rad/s times a factor."""
    return lambda body: {k: v for k, v in scaled(factor, True)(body).items() if k in NAMES}


def hil(factor: float) -> Fields:
    """Return the rates of a simulated vehicle."""
    return lambda body: (
        {k: v for k, v in scaled(factor, names=SPEEDS)(body).items() if k in SPEEDS}
        | {"attitude_quaternion": [1.0, 0.0, 0.0, 0.0]}
    )


def codes(result: Result) -> list[str]:
    """Return what was found."""
    return [finding.code for finding in result[1]]


WRONG = [
    ("HIGHRES_IMU", highres(DEG), "deg/s"),
    ("HIGHRES_IMU", highres(1 / DEG), "rad/s, turned from degrees once too often"),
    ("HIL_SENSOR", highres(1 / DEG), "rad/s, turned from degrees once too often"),
    ("HIL_STATE_QUATERNION", hil(DEG), "deg/s"),
    ("SCALED_IMU", imu(DEG), "deg/s"),
    ("SCALED_IMU2", imu(DEG * 100), "hundredths of deg/s"),
    ("SCALED_IMU3", imu(DEG * 1000), "thousandths of deg/s"),
]


@pytest.mark.parametrize(("message", "fields", "holds"), WRONG)
def test_units(message: str, fields: Fields, holds: str) -> None:
    """Each is named, in one finding."""
    result = judge(flight(message, fields, turning=0.9), pack=PACK)
    assert codes(result) == ["MFC322"]
    assert f"they look like {holds}" in result[1][0].text


@pytest.mark.parametrize(
    ("message", "fields"),
    [
        ("HIGHRES_IMU", highres(1.0)),
        ("SCALED_IMU2", imu(1000.0)),
        ("HIL_STATE_QUATERNION", hil(1.0)),
    ],
)
def test_right_units(message: str, fields: Fields) -> None:
    """They are a pass."""
    result = judge(flight(message, fields), pack=PACK)
    assert not codes(result)
    assert run_of(result, "MFC322").status == "ran"


def test_radians_in_thousandths() -> None:
    """Whole radians a second show where the vehicle turns fast enough for them."""
    fast = flight("SCALED_IMU", imu(1.0), turning=4.0)
    assert codes(judge(fast, pack=PACK)) == ["MFC322"]
    assert not codes(judge(flight("SCALED_IMU", imu(1.0), turning=0.5), pack=PACK))


def test_a_sensor_that_lies_on_its_side() -> None:
    """How it is mounted does not matter."""
    turned = q4.matrix_from_quaternion(q4.quaternion_from_euler(1.2, 0.4, -2.0))

    def aside(factor: float) -> Fields:
        return lambda body: scaled(factor)(turned @ body)

    for factor, found in ((1.0, []), (DEG, ["MFC322"])):
        data = flight("HIGHRES_IMU", aside(factor), turning=0.9)
        assert codes(judge(data, pack=PACK)) == found


def test_more_than_gyroscopes_measure() -> None:
    """Beyond 35 rad/s there is one finding, of the rule about degrees."""
    assert codes(judge(flight("HIGHRES_IMU", highres(DEG), turning=2.0), pack=PACK)) == ["MFC308"]


def test_a_sensor_that_is_not_there() -> None:
    """Zeros are no unit."""
    assert not codes(judge(flight("SCALED_IMU3", imu(0.0)), pack=PACK))


def test_a_vehicle_that_stands() -> None:
    """Noise has no unit; it says what is missing."""
    dice = np.random.default_rng(2)
    noise = flight("HIGHRES_IMU", lambda _: scaled(1.0)(dice.normal(0, 0.5, 3)), turning=0.0)
    result = judge(noise, pack=PACK)
    assert not codes(result)
    assert "hardly turns" in run_of(result, "MFC322").reason


def test_an_attitude_with_wrong_rates() -> None:
    """ATTITUDE is judged by its own angles, and nothing by its rates then."""
    result = judge(flight("HIGHRES_IMU", highres(1.0), 0.9, attitude=DEG), pack=PACK)
    assert [finding.message_name for finding in result[1]] == ["ATTITUDE"]
    assert "not those of its angles" in run_of(result, "MFC322").reason


def test_without_attitude() -> None:
    """Nothing to compare with is no pass."""
    data = b""
    for k in range(60):
        fields = scaled(DEG)(np.array([0.1, 0.2, 0.3 * np.sin(k / 10)]))
        stamp = (START_US + 100_000 * k).to_bytes(8, "big")
        data += stamp + frame("HIGHRES_IMU", fields) + stamp
        data += frame("HEARTBEAT", {"type": 2, "autopilot": 3})
    result = judge(data, pack=PACK)
    assert not codes(result)
    assert "no ATTITUDE" in run_of(result, "MFC322").reason


BAD = flight("HIGHRES_IMU", highres(DEG), turning=0.9)


@settings(max_examples=6, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, len(BAD)), min_size=1, max_size=12))
def test_cuts(cuts: list[int]) -> None:
    """Findings do not depend on batches."""
    assert judge(BAD, cuts, PACK)[1] == judge(BAD, pack=PACK)[1]
