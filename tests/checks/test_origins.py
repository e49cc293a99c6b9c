"""Moved origins and homes, leaps of position, and targets that count from the wrong origin."""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.model import Finding, Rule
from tests.engine.judged import Result, judge, run_of
from tests.vehicle.test_origins import LAT, MOVED, Say, V, Vehicle, px4, recorded

FILES = sorted((Path(__file__).parents[2] / "rules" / "origin").glob("*.toml"))
RULES = [msgspec.convert(tomllib.loads(file.read_text("utf-8")), Rule) for file in FILES]
PACK = Pack(tuple(RULES), {rule.code: rule.name for rule in RULES})
Ned = tuple[float, float, float]


def judged(says: list[Say]) -> Result:
    """Judge a recording with the whole family."""
    return judge(recorded(says), pack=PACK)


def found(says: list[Say], code: str) -> list[Finding]:
    """Return what one rule says of a recording."""
    return [finding for finding in judged(says)[1] if finding.code == code]


def targets(t: float, at: Ned, count: int = 5, system: int = 1) -> list[Say]:
    """Return local setpoints of a companion, five a second."""
    fields = {**dict(zip("xyz", at, strict=True)), "target_system": system}
    fields |= {"coordinate_frame": 1, "type_mask": 0x0DF8}
    name = "SET_POSITION_TARGET_LOCAL_NED"
    return [(t + 0.2 * k, name, fields, (1, 191)) for k in range(count)]


def item(t: float, at: Ned) -> list[Say]:
    """Return a mission item in the local frame."""
    fields = {"x": round(at[0] * 1e4), "y": round(at[1] * 1e4), "z": at[2], "frame": 1}
    return [(t, "MISSION_ITEM_INT", {**fields, "command": 16, "target_system": 1}, (1, 191))]


def elsewhere(north: float, east: float, up: float = 0) -> Vehicle:
    """Return the vehicle with another origin."""
    lat, lon = px4(north, east, V.lat, V.lon)
    return V._replace(lat=lat, lon=lon, alt=V.alt + up)


NEW = elsewhere(60, 40, 6)
RESTARTED: list[Say] = [
    *V.beats(0, 60),
    *V.origin(0),
    *V.flight(1, 40_000, 15),
    *targets(5, (15, 0, -12)),
    *NEW.flight(20, 2000, 30),
    *NEW.origin(25),
]


def test_old_origin_after_a_restart() -> None:
    (finding,) = found([*RESTARTED, *targets(40, (75, 40, -18), 12)], "MFC703")
    assert finding.count == 12
    assert finding.evidence["x_meant"] == pytest.approx(15, abs=0.1)
    assert finding.evidence["z_meant"] == pytest.approx(-12, abs=0.1)


def test_items_on_the_old_origin() -> None:
    (finding,) = found([*RESTARTED, *item(40, (75, 40, -18))], "MFC703")
    assert finding.message_name == "MISSION_ITEM_INT"


@pytest.mark.parametrize("at", [(15, 0, -12), (0, 0, -12), (-60, -40, -6), (200, 200, -12)])
def test_new_origin_after_a_restart(at: Ned) -> None:
    """Also far from the vehicle, and where the old origin was."""
    assert not found([*RESTARTED, *targets(40, at)], "MFC703")


def test_later_targets_are_not_judged() -> None:
    """Only the first target tells: the vehicle follows, and then everything is near it."""
    says = [*RESTARTED, *targets(40, (10, 0, -12)), *targets(44, (75, 40, -18))]
    assert not found(says, "MFC703")


def test_no_position_no_verdict() -> None:
    says = [*V.beats(0, 30), *targets(5, (15, 0, -12))]
    report, findings = judged(says)
    assert not findings
    assert run_of((report, findings), "MFC703").status == "insufficient-data"


def test_time_to_notice_a_move() -> None:
    """A stream in the old frame goes on for a second, and then is right."""
    shifted = elsewhere(12, -9, 3)
    fly: list[Say] = [*V.beats(0, 40), *V.flight(0, 40_000, 15, (15, 15, -16)), *V.origin(0)]
    fly += [*shifted.flight(15, 55_000, 15, (3, 24, -13)), *shifted.origin(15)]
    late = targets(5, (15, 15, -16), 54)
    assert not found([*fly, *late, *targets(16, (3, 24, -13), 40)], "MFC703")
    assert found([*fly, *late, *targets(16, (15, 15, -16), 40)], "MFC703")


def test_leap_on_the_ground_or_seen_too_late() -> None:
    """Before arming, and after a pause, nothing says that a position leapt."""
    shifted = elsewhere(30, 0)
    leap: list[Say] = [*V.flight(0, 40_000, 10), *shifted.flight(10, 50_000, 5, (-30, 0, -12))]
    pause: list[Say] = [*V.flight(0, 40_000, 10), *shifted.flight(20, 60_000, 5, (-30, 0, -12))]
    assert not found([*V.beats(0, 30, 0), *leap], "MFC702")
    assert not found([*V.beats(0, 30), *pause], "MFC702")
    assert found([*V.beats(0, 1, 0), *V.beats(1, 30), *leap], "MFC702")


def test_fast_flight_is_no_leap() -> None:
    """25 m/s, and positions that come once a second."""
    says: list[Say] = [*V.beats(0, 1, 0), *V.beats(1, 30)]
    for k in range(30):
        pair = V.pair(k, 40_000 + 1000 * k, (25.0 * k, 10.0 * k, -50))
        says += [
            (t, name, {**fields, "vx": 25 if name[0] == "L" else 2500}, who)
            for t, name, fields, who in pair
        ]
    codes = {finding.code for finding in judged(says)[1]}
    assert not codes & {"MFC701", "MFC702", "MFC709"}


def test_two_vehicles() -> None:
    """A target for the second one that is counted from the origin of the first one."""
    lat, lon = px4(30, 40, V.lat, V.lon)
    other = Vehicle(system=2, lat=lat, lon=lon)
    both: list[Say] = [*V.beats(0, 30), *other.beats(0.1, 30)]
    both += [*V.flight(0, 40_000, 20), *other.flight(0.05, 40_000, 20)]
    (finding,) = found([*both, *targets(5, (35, 42, -12), system=2)], "MFC705")
    assert (finding.severity, finding.evidence["other_system"]) == ("warning", 1)
    alike: list[Say] = []
    for t, at in ((5, (10, 5, -12)), (9, (20, 5, -12))):
        alike += [*targets(t, at), *targets(t + 0.1, at, system=2)]
    (finding,) = found([*both, *alike], "MFC705")
    assert (finding.severity, finding.evidence["shared"]) == ("info", 2)
    apart = [*targets(5, (10, 5, -12)), *targets(5.1, (-10, -30, -12), system=2)]
    assert not found([*both, *apart], "MFC705")


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(cuts=st.lists(st.integers(0, 100_000), min_size=1, max_size=10))
def test_pieces(cuts: list[int]) -> None:
    """Findings of the family do not depend on where a recording is cut."""
    says = [*RESTARTED, *targets(40, (75, 40, -18), 12), *item(45, (1, 2, -3))]
    says += [*MOVED.ask(50), *MOVED.origin(51), *V._replace(lat=LAT + 1e-3).home(52)]
    data = recorded(says)
    assert judge(data, cuts, PACK) == judge(data, pack=PACK)
