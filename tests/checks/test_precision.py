"""Positions that went through 32-bit floats."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.model import Rule
from tests.engine.judged import Result, judge, run_of
from tests.strategies import START_US, frame

FILE = next((Path(__file__).parents[2] / "rules").glob("*/MFC313-*.toml"))
RULE = msgspec.convert(tomllib.loads(FILE.read_text("utf-8")), Rule)
PACK = Pack((RULE,), {RULE.code: str(FILE)})
COMPANION = (1, 191)
ZURICH, DARWIN, SAO_TOME = (47.397742, 8.545594), (-12.42, 130.89), (0.37, 6.71)

Place = tuple[int, int]


def track(start: tuple[float, float], count: int = 60, seed: int = 1) -> list[Place]:
    """Return places, degE7, some metres apart."""
    steps = np.random.default_rng(seed).normal(0, 2e-5, (count, 2)).cumsum(axis=0)
    return [(int(a), int(b)) for a, b in np.round((np.array(start) + steps) * 1e7).tolist()]


def rounded(places: Iterable[Place]) -> list[Place]:
    """Return places after degrees in a 32-bit float."""
    return [(_through(lat), _through(lon)) for lat, lon in places]


def _through(value: int) -> int:
    return round(float(np.float32(value * 1e-7)) * 1e7)


def cut_off(places: Iterable[Place]) -> list[Place]:
    """Return places after degrees in a 32-bit float, cast to an integer."""
    return [
        (int(float(np.float32(a * 1e-7)) * 1e7), int(float(np.float32(b * 1e-7)) * 1e7))
        for a, b in places
    ]


def product(places: Iterable[Place]) -> list[Place]:
    """Return places after a product of 32-bit floats."""
    return [(int(np.float32(a)), int(np.float32(b))) for a, b in places]


def setpoints(
    places: Iterable[Place], mask: int = 0x0DF8, sender: tuple[int, int] = COMPANION
) -> bytes:
    """Return a recording of setpoints, ten a second."""
    data = b""
    for number, (lat, lon) in enumerate(places):
        fields = {
            "lat_int": lat,
            "lon_int": lon,
            "alt": 20.0,
            "type_mask": mask,
            "coordinate_frame": 6,
        }
        data += (START_US + 100_000 * number).to_bytes(8, "big")
        data += frame("SET_POSITION_TARGET_GLOBAL_INT", {**fields, "target_system": 1}, sender)
    return data


def found(data: bytes, cuts: Iterable[int] = ()) -> Result:
    """Judge a recording with the rule alone."""
    return judge(data, cuts, PACK)


@pytest.mark.parametrize("way", [rounded, cut_off, product])
@pytest.mark.parametrize("start", [ZURICH, DARWIN])
def test_through_floats(way: object, start: tuple[float, float]) -> None:
    """Each way through single precision is found, with the step it leaves."""
    places = {rounded: rounded, cut_off: cut_off, product: product}[way](track(start))  # type: ignore[index]
    _, (finding,) = found(setpoints(places))
    assert (finding.severity, finding.count) == ("warning", len(places))
    assert run_of(found(setpoints(places)), RULE.code).status == "ran"
    assert 0.1 < float(str(finding.evidence["step_m"])) < 1.7


@pytest.mark.parametrize("start", [ZURICH, DARWIN, SAO_TOME])
@pytest.mark.parametrize("seed", range(5))
def test_full_precision(start: tuple[float, float], seed: int) -> None:
    """Integers that kept their precision are no finding."""
    assert not found(setpoints(track(start, 400, seed)))[1]


def test_typed_by_hand() -> None:
    """Few decimals are not few bits."""
    places = [(473_977_000 + 1000 * k, 85_450_000 + 1000 * k) for k in range(40)]
    assert not found(setpoints(places))[1]


def test_every_grid_holds_plain_fractions() -> None:
    """Multiples of 1/32 degree prove nothing."""
    places = [(470_000_000 + 312_500 * k, 90_000_000 + 312_500 * k) for k in range(30)]
    report, findings = found(setpoints(places))
    assert not findings
    assert run_of((report, findings), RULE.code).status == "insufficient-data"


def test_one_place_again_and_again() -> None:
    """One value that happens to lie on the grid is no proof."""
    result = found(setpoints(rounded(track(ZURICH, 1)) * 500))
    assert not result[1]
    assert run_of(result, RULE.code).status == "insufficient-data"


def test_near_the_equator() -> None:
    """Where every value survives, nothing can be decided."""
    result = found(setpoints(rounded(track(SAO_TOME))))
    assert not result[1]
    assert run_of(result, RULE.code).status == "insufficient-data"


def test_a_stretch_in_between() -> None:
    """The finding covers the stretch that went through floats."""
    places = track(ZURICH, 90)
    _, (finding,) = found(setpoints([*places[:30], *rounded(places[30:60]), *places[60:]]))
    assert 30 <= finding.count <= 33


def test_ignored_and_unset() -> None:
    """Positions that the mask ignores, and zeros, do not count."""
    result = found(setpoints(rounded(track(ZURICH)), mask=0x0DFF) + setpoints([(0, 0)] * 50))
    assert not result[1]
    assert run_of(result, RULE.code).status == "not-applicable"


def test_autopilot() -> None:
    """What an autopilot does is information."""
    _, (finding,) = found(setpoints(rounded(track(ZURICH)), sender=(1, 1)))
    assert finding.severity == "info"


@settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, 9000), min_size=1, max_size=12))
def test_cuts(cuts: list[int]) -> None:
    """Findings do not depend on batches."""
    places = track(ZURICH, 120)
    data = setpoints([*places[:40], *rounded(places[40:80]), *places[80:]])
    assert found(data, cuts) == found(data)
