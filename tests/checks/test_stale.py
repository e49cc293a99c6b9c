"""Headings and places that go with a gimbal's or camera's pose, and are older than it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.checks.rule_bench import pack_of_files
from tests.engine.judged import Result, judge, run_of
from tests.strategies import START_US, frame

PACK = pack_of_files("MFC419", "MFC122", "MFC123")
VEHICLE_FRAME = 32
Fields = Callable[[float, float], dict[str, Any]]


def heading(t: float) -> float:
    """Return where the vehicle points, rad."""
    return float(0.4 + 1.1 * np.sin(0.35 * t) + 0.5 * np.sin(0.9 * t))


def at(t: float, *frames: bytes) -> bytes:
    """Return records received at `t` s."""
    stamp = (START_US + round(t * 1e6)).to_bytes(8, "big")
    return b"".join(stamp + each for each in frames)


def flight(
    message: str, fields: Fields, yaw: Callable[[float], float] = heading, seconds: float = 40.0
) -> bytes:
    """Return a vehicle that turns and flies north at 10 m/s, and what is said beside it ten times a second."""
    data = at(0, frame("HEARTBEAT", {"type": 2, "autopilot": 12}))
    for k in range(int(seconds * 10)):
        t = k / 10
        boot = {"time_boot_ms": round(t * 1e3)}
        place = {"lat": 474000000 + round(t * 10 * 89.9), "lon": 85000000, "alt": 500000}
        data += at(t, frame("ATTITUDE", {"yaw": yaw(t)} | boot))
        data += at(t, frame("GLOBAL_POSITION_INT", place | boot))
        data += at(t + 0.02, frame(message, fields(t, yaw(t)), (1, 154)))
    return data


def state(delay_s: float = 0.0) -> Fields:
    """Return the attitude that gimbals are told, so old."""
    return lambda t, _: {"q": half(heading(t - delay_s)), "time_boot_us": round(t * 1e6)}


def half(yaw: float) -> list[float]:
    """Return the quaternion of a level vehicle."""
    return [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]


def mount(delay_s: float = 0.0) -> Fields:
    """Return a camera that looks round, with a heading so old."""

    def fields(t: float, _: float) -> dict[str, Any]:
        yaw = 40 * np.sin(0.5 * t)
        north = np.degrees(heading(t - delay_s)) + yaw
        return {"pitch": -20.0, "yaw": yaw, "yaw_absolute": (north + 180) % 360 - 180}

    return fields


def gimbal(delay_s: float = 0.0) -> Fields:
    """Return a gimbal that follows the vehicle, with a heading so old."""
    return lambda t, _: {
        "q": half(0.1),
        "flags": VEHICLE_FRAME,
        "delta_yaw": heading(t - delay_s),
        "time_boot_ms": round(t * 1e3),
    }


SAYS = {
    "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": state,
    "MOUNT_ORIENTATION": mount,
    "GIMBAL_DEVICE_ATTITUDE_STATUS": gimbal,
}


def frozen(say: Fields, since: float, until: float) -> Fields:
    """Return what stays as it was for a while."""
    return lambda t, yaw: say(since if since < t < until else t, yaw)


def always(fields: dict[str, Any]) -> Fields:
    """Return what never changes."""
    return lambda *_: fields


def codes(result: Result) -> list[str]:
    """Return what was found."""
    return [finding.code for finding in result[1]]


@pytest.mark.parametrize("message", SAYS)
@pytest.mark.parametrize("delay_s", [0.7, 1.5, 3.0])
def test_late(message: str, delay_s: float) -> None:
    """A late heading is one finding, and says how late."""
    result = judge(flight(message, SAYS[message](delay_s)), pack=PACK)
    assert codes(result) == ["MFC419"]
    assert f"{delay_s:.1f} s before" in result[1][0].text


@pytest.mark.parametrize("message", SAYS)
@pytest.mark.parametrize("delay_s", [0.0, 0.2])
def test_fresh(message: str, delay_s: float) -> None:
    """One of the moment is a pass, with the latency of a link."""
    result = judge(flight(message, SAYS[message](delay_s)), pack=PACK)
    assert not codes(result)
    assert run_of(result, "MFC419").status == "ran"


@pytest.mark.parametrize(
    ("message", "code"), list(zip(SAYS, ("MFC419", "MFC419", "MFC123"), strict=True))
)
def test_frozen(message: str, code: str) -> None:
    """A heading that stays while the vehicle turns is told once, whatever the camera does."""
    result = judge(flight(message, frozen(SAYS[message](), 12.0, 24.0)), pack=PACK)
    assert codes(result) == [code]
    assert code == "MFC123" or "one and the same heading" in result[1][0].text


def test_a_gimbal_without_heading() -> None:
    """A gimbal that is not told the heading, and says so, has no such pose: however still it stands."""
    for unknown in (0.0, float("nan")):
        told = {"q": half(0.1), "flags": VEHICLE_FRAME, "delta_yaw": unknown}
        result = judge(flight("GIMBAL_DEVICE_ATTITUDE_STATUS", always(told)), pack=PACK)
        assert not codes(result)
        assert run_of(result, "MFC419").status != "ran"


def test_a_fixed_camera() -> None:
    """One without compass says no absolute yaw, or always the same one: nothing follows from that."""
    for north in (float("nan"), 0.0):
        fixed = flight("MOUNT_ORIENTATION", always({"yaw": 0.0, "yaw_absolute": north}))
        assert not codes(judge(fixed, pack=PACK))


def test_straight_on() -> None:
    """Without turns it says what is missing."""
    still = always({"yaw": 3.0, "yaw_absolute": 20.0})
    result = judge(flight("MOUNT_ORIENTATION", still, lambda _: 0.3), pack=PACK)
    assert not codes(result)
    assert "turns too little" in run_of(result, "MFC419").reason


def test_own_drift() -> None:
    """The absolute yaw of a camera by its own gyroscope drifts, and is no delay."""
    say = mount()
    drifting = flight(
        "MOUNT_ORIENTATION",
        lambda t, yaw: {**say(t, yaw), "yaw_absolute": say(t, yaw)["yaw_absolute"] + 0.3 * t},
    )
    assert not codes(judge(drifting, pack=PACK))


def image(t: float, number: int, frozen_after: float) -> dict[str, Any]:
    """Return an image taken every two seconds, placed by a position that stops."""
    then = min(2.0 * number, frozen_after)
    lat = 474000000 + round(then * 10 * 89.9)
    return {"image_index": number, "lat": lat, "lon": 85000000, "time_boot_ms": round(t * 1e3)}


@pytest.mark.parametrize(("frozen_after", "found"), [(10.0, ["MFC419"]), (1e9, [])])
def test_images(frozen_after: float, found: list[str]) -> None:
    """Images that were all taken at one place are told; those where the vehicle was are not."""
    data = flight(
        "CAMERA_IMAGE_CAPTURED", lambda t, _: image(t, int(t // 2), frozen_after), seconds=40
    )
    assert codes(judge(data, pack=PACK)) == found


def test_one_image_again_and_again() -> None:
    """An image that is asked for once more was taken where it was taken."""
    data = flight("CAMERA_IMAGE_CAPTURED", lambda t, _: image(t, 3, 1e9))
    assert not codes(judge(data, pack=PACK))


WRONG = flight("MOUNT_ORIENTATION", mount(1.0)) + flight(
    "CAMERA_IMAGE_CAPTURED", lambda t, _: image(t, int(t // 2), 10.0)
)


@settings(max_examples=6, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, len(WRONG)), min_size=1, max_size=12))
def test_cuts(cuts: list[int]) -> None:
    """Findings do not depend on batches."""
    assert judge(WRONG, cuts, PACK)[1] == judge(WRONG, pack=PACK)[1]
