"""Checks that compare what one sensor says with what another one, or the vehicle, does meanwhile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.checks import adsb, flow, gimbal, rangefinder
from mavframecheck.checks.motion import wind
from mavframecheck.checks.motion.series import Series
from mavframecheck.engine.examples import recording
from mavframecheck.geo import quaternions as q4
from mavframecheck.model import Subject
from tests.checks.rule_bench import chopped, pack_of_files, rule_named
from tests.engine.judged import judge, run_of
from tests.strategies import DIALECT, MESSAGES, START_US, frame, packed, shape

CODES = ("MFC122", "MFC418", "MFC419", "MFC319", "MFC320", "MFC414", "MFC415", "MFC510", "MFC612")


@pytest.mark.parametrize("code", CODES)
def test_cuts_do_not_matter(code: str) -> None:
    """The same is found however the recording is cut into batches; and one finding for one mistake."""
    pack = pack_of_files(code)
    for example in rule_named(code).example:
        data = recording(example, DIALECT)
        whole = judge(data, pack=pack)
        assert len(whole[1]) == (example.expect == "bad")
        assert judge(data, chopped(data), pack=pack)[1] == whole[1]


@pytest.mark.parametrize("code", CODES)
def test_nothing_filled_in(code: str) -> None:
    """Messages full of zeros end in no finding and no crash."""
    names = ("HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT", *rule_named(code).applies.message)
    data = b""
    for k in range(40):
        for name in names:
            stamp = (START_US + k * 100_000).to_bytes(8, "big")
            data += stamp + frame(name, {}, (1, 100))
    assert not judge(data, pack=pack_of_files(code))[1]


ALL = (
    *CODES,
    "MFC410",
    "MFC411",
    "MFC412",
    "MFC413",
    "MFC417",
    "MFC322",
    "MFC420",
    "MFC512",
    "MFC609",
    "MFC613",
)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3e38, -3e38, 1e-40])
def test_extremes(value: float) -> None:
    """Whatever floating-point numbers a sender makes, rules end without a warning of numpy's."""
    pack = pack_of_files(*ALL)
    names = {name for rule in pack.rules for name in rule.applies.message}
    names = {name for name in names if not name.startswith("!")} | {
        "ATTITUDE",
        "ATTITUDE_QUATERNION",
    }
    kinds = [kind for kind in MESSAGES.values() if kind.msgname in names]
    data = b""
    for k in range(60):
        armed = frame("HEARTBEAT", {"type": 2, "autopilot": 3, "base_mode": 128, "custom_mode": 4})
        for sent in (
            armed,
            *(packed(kind, filled(kind, value if k % 3 else 0.5, k)) for kind in kinds),
        ):
            data += (START_US + k * 200_000).to_bytes(8, "big") + sent
    assert judge(data, pack=pack)[0].runs


def filled(kind: Any, value: float, k: int) -> dict[str, Any]:
    """Return every floating-point field with a value, and small numbers in the others."""
    fields: dict[str, Any] = {}
    for name in kind.fieldnames:
        letters, count = shape(kind, name)
        one: Any = value if letters in {"float", "double"} else 3 + k % 2
        fields[name] = b"x" if letters == "char" else [one] * count if count else one
    return fields


@settings(max_examples=40, deadline=None)
@given(
    north=st.floats(-9, 9),
    east=st.floats(-9, 9),
    airspeed=st.floats(10, 25),
    spread=st.floats(2.5, 6.2),
)
def test_wind_triangle(north: float, east: float, airspeed: float, spread: float) -> None:
    """The wind comes out of speeds on several headings, and nothing without a wind or on one heading."""
    t = np.arange(0, 60, 0.5)
    yaw = spread * np.sin(t / 8)
    v = airspeed * np.column_stack((np.cos(yaw), np.sin(yaw), 0 * yaw)) + [north, east, 0]
    none = np.full((len(t), 3), np.nan)
    still = np.full((len(t), 4), np.nan)
    lies = q4.quaternion_from_euler(0.2 * np.cos(t), 0.05 + 0 * t, yaw)
    said = Series("WIND", t, none, still, np.tile([north, east, 0.0], (len(t), 1)), t)
    place = Series("GLOBAL_POSITION_INT", t, none, still, v, t)
    found = wind._window(said, place, Series("ATTITUDE", t, none, lies, none, t), 0.0)
    if found is not None:
        assert found.true == pytest.approx([north, east], abs=0.05)
        assert found.apart == pytest.approx(0, abs=0.05)
    elif np.hypot(north, east) > 1:
        fast = np.hypot(v[:, 0], v[:, 1]) > wind.FLIES_MPS
        assert abs(np.exp(1j * yaw[fast]).mean()) > wind.ONE_WAY
    one_way = Series("ATTITUDE", t, none, q4.quaternion_from_euler(0 * t, 0, 0.3), none, t)
    assert wind._window(said, place, one_way, 0.0) is None


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 60), st.floats(-5, 50)), min_size=5, max_size=40))
def test_range_against_height_as_polyfit(pairs: list[tuple[float, float]]) -> None:
    """Slope and correlation are numpy's, however the pairs come."""
    height, range_m = (np.array(column) for column in zip(*pairs, strict=True))
    if np.ptp(height) < 1 or np.ptp(range_m) < 1:
        return
    sensor = rangefinder._Sensor()
    sensor.add(height[:2], range_m[:2])
    sensor.add(height[2:], range_m[2:])
    slope, alike = sensor.fit()
    assert slope == pytest.approx(np.polyfit(height, range_m, 1)[0], abs=1e-6)
    assert alike == pytest.approx(np.corrcoef(height, range_m)[0, 1], abs=1e-6)


@pytest.mark.parametrize("which", range(8))
def test_every_flow(which: int) -> None:
    """Of the eight ways the flow may lie against the gyroscope, the right one leaves nothing."""
    matrix, says = flow._READINGS[which]
    rng = np.random.default_rng(which)
    gyro = rng.normal(0, 1, (200, 2))
    seen = gyro @ matrix.T + rng.normal(0, 0.1, gyro.shape)
    sensor = flow._Sensor(gyro=gyro.T @ gyro, both=seen.T @ gyro, flow=float(np.square(seen).sum()))
    assert min(flow._READINGS, key=lambda each: sensor.left(each[0]))[1] == says
    assert sensor.left(matrix) < 0.05
    assert says == "" if which == 0 else says


@pytest.mark.parametrize("slope", [-1.0, 0.0, 1.0])
def test_gimbal_turns(slope: float) -> None:
    """The turn per turn of the vehicle is found through the wrap, and across a pause nothing is compared."""
    t_us = np.arange(100) * 500_000
    heading = np.linspace(0, 9, 100)
    yaw = slope * heading + 0.4
    one = gimbal._Gimbal()
    wrapped = (np.angle(np.exp(1j * each)) for each in (yaw, heading))
    one.add(t_us, *wrapped)
    assert one.slope == pytest.approx(slope)
    assert one.turned == pytest.approx(9)
    one.add(t_us[-1:] + 60_000_000, np.array([1.0]), np.array([2.0]))
    assert one.turned == pytest.approx(9)


@pytest.mark.parametrize("factor", [*adsb.FACTORS, 1.0, 1.4])
def test_traffic_factors(factor: float) -> None:
    """Every known factor is named; the right scale, and a factor that nobody makes, are left alone."""
    check = adsb.Units(rule_named("MFC319").params, DIALECT)
    sender = adsb.Sender(Subject(1, 191, adsb.MESSAGE))
    way = np.random.default_rng(2).uniform(50, 250, 40)
    sender.add("level", factor * way, way, np.ones(40, np.bool_))
    told = check.told(sender)
    assert (told or {}).get("says") == adsb.FACTORS.get(factor)


def test_a_parked_receiver_may_stand() -> None:
    """A fix that stands at rest is none; one that stands while its own speed says otherwise is one episode."""
    rule = pack_of_files("MFC612")

    def fixes(speed_cms: int, moves: int) -> bytes:
        data = b""
        for k in range(100):
            at = {"lat": 474000000 + moves * k, "lon": 85000000, "fix_type": 3, "vel": speed_cms}
            data += (START_US + k * 200_000).to_bytes(8, "big") + frame("GPS_RAW_INT", at)
        return data

    assert not judge(fixes(30, 0), pack=rule)[1]
    assert not judge(fixes(800, 100), pack=rule)[1]
    assert not judge(fixes(65535, 0), pack=rule)[1]
    (finding,) = judge(fixes(800, 0) + fixes(800, 100), pack=rule)[1]
    assert finding.code == "MFC612"
    assert run_of(judge(fixes(30, 0), pack=rule), "MFC612").status == "ran"
