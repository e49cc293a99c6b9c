"""Setpoints beside the motion that followed: in which axes they are taken, and when that cannot be told."""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.checks.motion import Response, response
from mavframecheck.checks.motion.holds import Hold
from mavframecheck.checks.motion.response import Answer, Motion, Sample
from mavframecheck.engine import Pack
from mavframecheck.engine.examples import recording
from mavframecheck.geo import permutations
from mavframecheck.geo import quaternions as q4
from mavframecheck.wire import Place
from tests.checks.motion_bench import flight
from tests.checks.rule_bench import chopped, pack_of_files, rule_named
from tests.engine.judged import judge, run_of
from tests.strategies import DIALECT

NOWHERE = Place(0, None, 0, 0)
HOLD = Hold(
    447, 1, "SET_POSITION_TARGET_LOCAL_NED", 1, 0xDC7, np.zeros(8), 0, 5, NOWHERE, NOWHERE, 20
)
VELOCITIES = [(3, 0, 0), (0, -3, -0.5), (-2, 1, 0), (1, 2, 1.0)]


def samples(matrix: np.ndarray, what: str, noise: float = 0.03) -> list[Sample]:
    """Return what was asked for in other axes, and what was done."""
    rng = np.random.default_rng(11)
    return [
        Sample(what, matrix @ np.array(v, float), np.array(v) + rng.normal(0, noise, 3), HOLD)
        for v in VELOCITIES
    ]


@pytest.mark.parametrize("which", range(48))
def test_every_permutation(which: int) -> None:
    """All 47 wrong ones are told with their words; the right one agrees."""
    matrix = permutations.PERMUTATIONS[which]
    answer = response.along_axes(samples(matrix, "velocity"))
    assert isinstance(answer, Answer)
    assert answer.kind in (("axes",) if which else ("agrees", "turned"))
    if which:
        assert answer.says == permutations.words(matrix).sentence
        assert answer.left < 0.1


def test_body_axes_have_their_own_words() -> None:
    """Left for right is said in words of the body."""
    answer = response.along_axes(samples(np.diag([1.0, -1, -1]), "body velocity"))
    assert isinstance(answer, Answer)
    assert answer.says == "x holds Forward, y holds Left, z is up"


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_what_does_not_follow_tells_nothing(seed: int) -> None:
    """Motion that has nothing to do with the setpoints is never called another frame with a small rest."""
    rng = np.random.default_rng(seed)
    found = [Sample("velocity", np.array(v, float), rng.normal(0, 2, 3), HOLD) for v in VELOCITIES]
    answer = response.along_axes(found)
    assert (
        isinstance(answer, str)
        or answer.kind in ("undecided", "agrees", "turned")
        or answer.left < 0.6
    )


def test_too_few() -> None:
    assert "fewer than 3" in str(response.along_axes(samples(np.eye(3), "velocity")[:2]))
    assert "fewer than 3" in str(response.of_yaw([]))
    assert "fewer than two" in str(response.of_yaw_rate([]))


@pytest.mark.parametrize(
    ("kind", "sign", "turn_deg"),
    [
        ("agrees", 1, 3),
        ("sign", -1, 0),
        ("offset", 1, 90),
        ("offset", 1, -140),
        ("sign and offset", -1, 90),
    ],
)
def test_yaw(kind: str, sign: float, turn_deg: float) -> None:
    """Sign, offset and both are told apart, with the angle."""
    asked = np.array([0.3, 1.5, -2.8, -1.0])
    done = sign * asked + np.radians(turn_deg) + 2 * np.pi
    pairs = zip(asked, done, strict=True)
    answer = response.of_yaw([Sample("yaw", np.array([a]), np.array([d]), HOLD) for a, d in pairs])
    assert isinstance(answer, Answer)
    assert answer.kind == kind
    if "offset" in kind:
        assert np.degrees(answer.yaw) == pytest.approx(turn_deg)


@pytest.mark.parametrize(("sign", "kind"), [(1.0, "agrees"), (-1.0, "sign"), (0.1, "undecided")])
def test_yaw_rate(sign: float, kind: str) -> None:
    found = [Sample("yaw rate", np.array([a]), np.array([sign * a]), HOLD) for a in (0.4, -0.3)]
    answer = response.of_yaw_rate(found)
    assert isinstance(answer, Answer)
    assert answer.kind == kind


def test_velocity_is_of_the_vehicles_clock() -> None:
    """A simulation that runs five times faster goes five times further in a second of the recording."""
    true = flight()
    fast = dataclasses.replace(true, t=true.t / 5)
    slow, quick = Motion(true, true, 1.0), Motion(fast, fast, 5.0)
    assert quick.velocity(2.0, 3.0) == pytest.approx(slow.velocity(10.0, 15.0))
    yaw = q4.euler_from_quaternion(true.attitude)[100, 2]
    assert slow.yaws(10.0, 10.5)[0] == pytest.approx(yaw, abs=0.05)


@pytest.mark.parametrize("code", ["MFC410", "MFC412", "MFC413", "MFC417", "MFC420", "MFC512"])
def test_cuts_do_not_matter(code: str) -> None:
    """The same is found however the recording is cut into batches; and one finding for one mistake."""
    pack = pack_of_files(code)
    data = recording(rule_named(code).example[0], DIALECT)
    whole = judge(data, pack=pack)
    assert len(whole[1]) == 1
    assert judge(data, chopped(data), pack=pack)[1] == whole[1]


def test_without_the_mode_nothing_is_told() -> None:
    """A vehicle that is not in a mode that obeys, or says no mode, is no judge of setpoints."""
    rule = rule_named("MFC417")
    example = rule.example[0]
    steps = [each for each in example.step if each.message != "HEARTBEAT"]
    silent = recording(msgspec.structs.replace(example, step=steps), DIALECT)
    result = judge(silent, pack=Pack((rule,), {"MFC417": "here"}))
    assert not result[1]
    assert run_of(result, "MFC417").status == "insufficient-data"


def test_a_yaw_that_is_not_followed_is_no_pass() -> None:
    """There may be good reasons; so nothing is found, and it is said that nothing was told."""
    asked, done = (0.0, 1.5, 3.0, -1.5), (0.7, 0.1, -2.0, 2.4)
    pairs = zip(asked, done, strict=True)
    found = [Sample("yaw", np.array([a]), np.array([d]), HOLD) for a, d in pairs]
    answer = response.of_yaw(found)
    assert isinstance(answer, Answer)
    assert answer.kind == "undecided"
    check = Response(rule_named("MFC417").params, DIALECT)
    check._holds.senders.add(HOLD.sender)
    check._told = [(found, "yaw", answer)]
    assert not list(check.finish())
    assert check.verdict().checked == 0
    assert "yaw: the vehicle does not follow it" in check.verdict().insufficient
    right = [Sample("yaw", np.array([a]), np.array([a]), HOLD) for a in asked]
    check._told.append((right, "yaw", response.of_yaw(right)))
    assert check.verdict().checked
    assert "does not follow" in check.verdict().partly
