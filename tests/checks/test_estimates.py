"""Poses row by row: jumps, counters, frozen positions."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.model import Rule
from tests.engine.judged import Result, judge
from tests.strategies import START_US, frame

RULES = Path(__file__).parents[2] / "rules"
FILES = [next(RULES.glob(f"*/MFC{number}-*.toml")) for number in (409, 504, 505, 509)]
PACK = Pack(
    tuple(msgspec.convert(tomllib.loads(file.read_text("utf-8")), Rule) for file in FILES),
    {file.name[:6]: str(file) for file in FILES},
)
EVERY_US = 40_000
POSE = "VISION_POSITION_ESTIMATE"


def recording(
    rows: Iterable[dict[str, Any]], version: int = 2, name: str = "VISION_POSITION_ESTIMATE"
) -> bytes:
    """Return poses 25 times a second, and the positions of a vehicle that flies north at 5 m/s."""
    data = b""
    for k, fields in enumerate(rows):
        stamp = (START_US + k * EVERY_US).to_bytes(8, "big")
        if k % 5 == 0:
            at = {"lat": 474_000_000 + 90 * k // 5, "lon": 85_000_000, "alt": 500_000}
            data += stamp + frame("HEARTBEAT", {"type": 2, "autopilot": 3})
            data += stamp + frame("GLOBAL_POSITION_INT", at)
            data += stamp + frame("ATTITUDE", {"yaw": 1.57})
        data += stamp + frame(name, fields, (1, 191), version=version)
    return data


def codes(data: bytes, cuts: Iterable[int] = ()) -> list[tuple[str, int]]:
    """Return code and count of every finding."""
    result: Result = judge(data, cuts, PACK)
    return [(finding.code, finding.count) for finding in result[1]]


def moving(count: int = 100, **jumps: int) -> list[dict[str, Any]]:
    """Return poses that go north at 5 m/s."""
    return [{"x": k * 0.2, "y": 0.01 * (k % 3)} | dict(jumps) for k in range(count)]


def jumping(counted: int = 0) -> list[dict[str, Any]]:
    """Return poses that jump by 3 m in the middle."""
    rows = moving()
    for row in rows[50:]:
        row["y"] += 3.0
        row["reset_counter"] = counted
    return rows


def test_jump() -> None:
    """A jump is one hit; counted it is none."""
    assert codes(recording(jumping())) == [("MFC504", 1)]
    assert codes(recording(jumping(1))) == []


def test_version_1() -> None:
    """MAVLink 1 has no counter that could tell."""
    assert codes(recording(jumping(), version=1)) == []


def test_spike_fast_and_gap() -> None:
    """One wrong pose, a fast vehicle, and a gap are no resets."""
    spike = moving()
    spike[50]["y"] += 3.0
    fast = [{"x": k * 2.0} for k in range(100)]
    held = [{"x": (k // 4) * 0.8} for k in range(100)]
    for rows in (spike, fast, held):
        assert codes(recording(rows)) == []


def test_running_counter() -> None:
    """A counter that counts messages."""
    rows = [{"x": 0.1 * k, "reset_counter": k % 256} for k in range(300)]
    ((code, count),) = codes(recording(rows))
    assert code == "MFC505"
    assert count > 200


def test_several_resets() -> None:
    """Some resets in a flight are what the counter is for."""
    assert codes(recording([{"x": 0.1 * k, "reset_counter": k // 100} for k in range(900)])) == []


def test_frozen() -> None:
    """A position that stays while the vehicle flies on; attitude and stamps go on."""
    rows = moving()[:20] + [{"x": 4.0, "yaw": 0.01 * k, "usec": k} for k in range(100)]
    ((code, count),) = codes(recording(rows))
    assert code == "MFC509"
    assert count > 50


def test_frozen_before_the_vehicle_knew_where_it_was() -> None:
    """The way is counted from the first position that the vehicle says."""
    data = recording([{"x": 4.0, "usec": k} for k in range(120)])
    assert [code for code, _ in codes(data[data.index(b"\xfd", 100) - 8 :])] == ["MFC509"]


def test_frozen_needs_a_vehicle_that_moves() -> None:
    """A pose that stays beside a vehicle that stays is no evidence of anything."""
    stamp = START_US.to_bytes(8, "big")
    at = {"lat": 474_000_000, "lon": 85_000_000, "alt": 500_000}
    data = b"".join(
        stamp + frame("GLOBAL_POSITION_INT", at) + stamp + frame(POSE, {"x": 1.0}, (1, 191))
        for _ in range(60)
    )
    run = next(run for run in judge(data, (), PACK)[0].runs if run.code == "MFC509")
    assert (run.status, run.reason) == ("insufficient-data", "the vehicle hardly moves")


@pytest.mark.parametrize("order", ["wrong", "right"])
def test_setpoints(order: str) -> None:
    """A setpoint that faces east as the vehicle does, in either order."""
    q = [0.706, 0.0, 0.05, 0.706]
    rows = [{"q": [*q[1:], q[0]] if order == "wrong" else q, "type_mask": 7}] * 40
    data = recording([{**row, "target_system": 1} for row in rows], name="SET_ATTITUDE_TARGET")
    found = codes(data)
    assert [code for code, _ in found] == (["MFC409"] if order == "wrong" else [])


ALL = recording(
    jumping()
    + [{"x": 40.0, "y": 1.0, "yaw": 0.01 * k} for k in range(60)]
    + [{"x": 0.1 * k, "reset_counter": k % 256} for k in range(60)]
)
SETPOINTS = recording(
    [{"q": [0.0, 0.05, 0.706, 0.706], "type_mask": 7, "target_system": 1}] * 60,
    name="SET_ATTITUDE_TARGET",
)


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    data=st.sampled_from([ALL, SETPOINTS]),
    shares=st.lists(st.floats(0, 1), min_size=1, max_size=40),
)
def test_cuts(data: bytes, shares: list[float]) -> None:
    """Findings do not depend on batches."""
    cuts = [int(share * len(data)) for share in shares]
    assert judge(data, cuts, PACK)[1] == judge(data, pack=PACK)[1]
