"""A heading of an injected GPS that is 0 at north."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.model import Rule
from tests.engine.judged import Result, judge, run_of
from tests.strategies import START_US, frame

FILE = next((Path(__file__).parents[2] / "rules").glob("*/MFC606-*.toml"))
RULE = msgspec.convert(tomllib.loads(FILE.read_text("utf-8")), Rule)
PACK = Pack((RULE,), {RULE.code: str(FILE)})
THROUGH_NORTH = [35_700, 35_900, 0, 0, 90, 300]


def stream(
    headings: Iterable[int], name: str = "GPS_INPUT", fix: int = 3, version: int = 2
) -> bytes:
    """Return a recording of injected positions, five a second."""
    data = b""
    for number, yaw in enumerate(headings):
        fields = {"fix_type": fix, "lat": 473_977_420, "lon": 85_455_940, "yaw": yaw}
        data += (START_US + 200_000 * number).to_bytes(8, "big")
        data += frame(name, fields, (1, 191), version=version)
    return data


def found(data: bytes, cuts: Iterable[int] = ()) -> Result:
    """Judge a recording with the rule alone."""
    return judge(data, cuts, PACK)


@pytest.mark.parametrize("name", ["GPS_INPUT", "HIL_GPS"])
def test_zero_for_north(name: str) -> None:
    """The heading passes north, and is 0 there."""
    _, (finding,) = found(stream(THROUGH_NORTH, name))
    assert (finding.count, finding.field) == (2, "yaw")


@pytest.mark.parametrize(
    "headings",
    [
        [35_700, 35_900, 36_000, 90, 300],
        [0] * 20,
        [9_000, 9_100, 0, 0, 9_300],
        [35_900, 0, 0, 9_000],
        [0, 0, 100, 200],
        [35_900, 35_950, 0, 0],
    ],
    ids=["36000", "none at all", "lost elsewhere", "turned meanwhile", "begins", "ends"],
)
def test_no_mistake(headings: list[int]) -> None:
    """North as 36000, no heading, or one that is lost for another reason."""
    assert not found(stream(headings))[1]


def test_often_lost_elsewhere() -> None:
    """A receiver that loses its heading now and then may lose it at north too."""
    assert not found(stream([9_000, 0, 9_000, 0, 9_100, *THROUGH_NORTH]))[1]


def test_no_fix() -> None:
    """Without a fix the message says nothing."""
    result = found(stream(THROUGH_NORTH, fix=1))
    assert not result[1]
    assert run_of(result, RULE.code).status == "not-applicable"


def test_version_1() -> None:
    """MAVLink 1 has no such field."""
    assert not found(stream(THROUGH_NORTH, version=1))[1]


@settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, 1500), min_size=1, max_size=8))
def test_cuts(cuts: list[int]) -> None:
    """Findings do not depend on batches."""
    data = stream([*THROUGH_NORTH, 9_000, *THROUGH_NORTH])
    assert found(data, cuts) == found(data)
