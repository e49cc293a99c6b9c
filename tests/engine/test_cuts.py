"""Findings do not depend on where a recording is cut into batches (DESIGN law 2), for any rule."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine.examples import recording
from mavframecheck.model import Rule
from mavframecheck.sources import Kind
from samples.make import HERE
from tests.engine.judged import Result, judge, pack_of, rule, shipped
from tests.strategies import CUTS, DIALECT, START_US, broken, frame, unknown

SAMPLES = sorted(path for path in HERE.iterdir() if path.suffix in {".tlog", ".raw"})
few = settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow], deadline=None)


@functools.cache
def whole(sample: Path) -> Result:
    """Judge a sample in one piece."""
    return judge(sample.read_bytes(), kind=kind_of(sample))


def kind_of(sample: Path) -> Kind:
    """Return what a sample is, by its name."""
    return Kind.TLOG if sample.suffix == ".tlog" else Kind.RAW


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.name)
@settings(few, max_examples=3)
@given(cuts=st.lists(st.integers(0, 100_000), min_size=1, max_size=6))
def test_samples(sample: Path, cuts: list[int]) -> None:
    """The whole report of a sample is the same however its bytes arrive."""
    assert judge(sample.read_bytes(), cuts, kind=kind_of(sample)) == whole(sample)


@pytest.mark.parametrize("one", shipped().rules, ids=lambda one: one.code)
@few
@given(cuts=CUTS, order=st.randoms(use_true_random=False))
def test_every_rule(one: Rule, cuts: list[int], order: Any) -> None:
    """All examples of a rule in one recording, some of them twice, judged by it alone."""
    examples = [recording(example, DIALECT) for example in one.example] * 2
    order.shuffle(examples)
    data = b"".join(examples)
    pack = pack_of(one)
    assert judge(data, cuts, pack) == judge(data, pack=pack)


HOME = {"latitude": 473977420, "longitude": 85455940, "altitude": 488_000}
POSITION = {"lat": 473977420, "lon": 85455940, "alt": 500_000, "relative_alt": 12_000}
SENDERS = st.sampled_from([(1, 1), (2, 1), (255, 190), (1, 191), (1, 5), (3, 7), (3, 1)])
TARGETS = st.sampled_from([0, 1, 2, 3, 9])


def heartbeat(draw: st.DrawFn) -> dict[str, Any]:
    """Return who somebody says it is, which may change."""
    return {
        "type": draw(st.sampled_from([2, 6, 18, 1])),
        "autopilot": draw(st.sampled_from([3, 8, 12])),
    }


def setpoint(draw: st.DrawFn) -> dict[str, Any]:
    """Return a setpoint with one of several mistakes, or none."""
    return {
        "target_system": draw(TARGETS),
        "x": draw(st.sampled_from([0.0, float("nan"), 5.0])),
        "type_mask": draw(st.sampled_from([0x0DF8, 0x0DC7, 0xFFFF, 0x0E00, 0])),
        "coordinate_frame": draw(st.sampled_from([0, 1, 5, 8, 9, 20, 99])),
    }


def global_setpoint(draw: st.DrawFn) -> dict[str, Any]:
    """Return a global setpoint in degrees, scaled degrees or nothing of the sort."""
    return {
        "target_system": draw(TARGETS),
        "lat_int": draw(st.sampled_from([47, 473977420, 0, 2**31 - 1])),
        "lon_int": draw(st.sampled_from([8, 85455940, 0])),
        "type_mask": 0x0DF8,
        "coordinate_frame": draw(st.sampled_from([0, 1, 3, 6])),
    }


def odometry(draw: st.DrawFn) -> dict[str, Any]:
    """Return odometry, which names no target."""
    return {
        "q": draw(st.sampled_from([[1.0, 0, 0, 0], [0.5, 0, 0, 0], [0.0] * 4])),
        "frame_id": draw(st.sampled_from([1, 20, 16])),
        "pose_covariance": draw(st.sampled_from([[0.0] * 21, [-1.0] * 21])),
    }


def command(draw: st.DrawFn) -> dict[str, Any]:
    """Return a command with a location."""
    return {
        "target_system": draw(TARGETS),
        "command": draw(st.sampled_from([16, 179, 192, 195])),
        "param5": draw(st.sampled_from([47.397742, 473977420.0])),
        "param6": draw(st.sampled_from([8.545594, 85455940.0])),
    }


SAYINGS: dict[str, Callable[[st.DrawFn], dict[str, Any]]] = {
    "HEARTBEAT": heartbeat,
    "SET_POSITION_TARGET_LOCAL_NED": setpoint,
    "SET_POSITION_TARGET_GLOBAL_INT": global_setpoint,
    "ODOMETRY": odometry,
    "COMMAND_LONG": command,
    "COMMAND_ACK": lambda draw: {"command": draw(st.sampled_from([16, 179, 192]))},
    "HOME_POSITION": lambda _: HOME,
    "GLOBAL_POSITION_INT": lambda _: POSITION,
    "STATUSTEXT": lambda draw: {
        "severity": draw(st.integers(0, 7)),
        "text": draw(st.sampled_from([b"ArduCopter V4.5.7", b"PX4 v1.15.4", b"hello"])),
    },
}
STEPS_S = st.sampled_from([0.0, 0.01, 0.1, 1.0, 4.9, 12.0, 31.0, 61.0, -0.02, -2.0, -70.0, 1e9])


@st.composite
def traffic(draw: st.DrawFn) -> bytes:
    """Return a recording of several vehicles that say things in any order, with gaps and leaps of time."""
    t_us, data = START_US, b""
    for seq in range(draw(st.integers(1, 25))):
        t_us += round(draw(STEPS_S) * 1e6)
        name = draw(st.sampled_from(sorted(SAYINGS)))
        one = frame(name, SAYINGS[name](draw), draw(SENDERS), draw(st.sampled_from([seq, 0])))
        one = draw(st.sampled_from([one] * 8 + [broken(one), unknown(seq), b"rubbish"]))
        data += (t_us % 2**63).to_bytes(8, "big") + one
    return data


IN_CONTEXT = rule(
    applies={"message": ["ODOMETRY"]},
    detect={"flag": "raw(q)[0] < 1", "worst": "vehicle.relative_alt"},
    severity_when=[{"if": "vehicle.autopilot == 'px4'", "severity": "info"}],
    explain={"text": "{vehicle.autopilot} {vehicle.relative_alt} {home.alt_msl} {sender.role}"},
)
"""It waits for context, and judges without it where none comes."""


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(data=traffic(), cuts=st.lists(st.integers(0, 3000), min_size=1, max_size=12))
def test_any_traffic(data: bytes, cuts: list[int]) -> None:
    """Several vehicles, roles that change, context before, after, late or never, clocks that leap."""
    pack = pack_of(*shipped().rules, IN_CONTEXT)
    assert judge(data, cuts, pack) == judge(data, pack=pack)


def said(t_s: float, name: str, fields: dict[str, Any], sender: tuple[int, int]) -> bytes:
    """Return a record of a message."""
    stamp = (START_US + round(t_s * 1e6)).to_bytes(8, "big")
    return stamp + frame(name, fields, sender, round(t_s) % 256)


def test_rows_of_one_stream_are_judged_in_order() -> None:
    """The first row never learns whom it is about, the second does at once: it must not overtake."""
    vehicle, crooked = {"type": 2, "autopilot": 3}, {"q": [0.5, 0, 0, 0]}
    records = [
        said(0, "HEARTBEAT", vehicle, (1, 1)),
        said(0, "HEARTBEAT", vehicle, (2, 1)),
        said(1, "HOME_POSITION", HOME, (3, 1)),
        said(2, "ODOMETRY", crooked, (3, 7)),
        said(3, "HEARTBEAT", vehicle, (3, 1)),
        said(4, "GLOBAL_POSITION_INT", POSITION, (3, 1)),
        said(5, "ODOMETRY", crooked, (3, 7)),
        said(70, "HEARTBEAT", vehicle, (1, 1)),
        said(71, "HEARTBEAT", vehicle, (1, 1)),
    ]
    data, pack = b"".join(records), pack_of(IN_CONTEXT)
    edges = [sum(map(len, records[:k])) for k in range(len(records))]
    assert judge(data, edges, pack) == judge(data, pack=pack)
    (finding,) = judge(data, edges, pack)[1]
    assert (finding.count, finding.time_first) == (2, START_US * 1e-6 + 2)
