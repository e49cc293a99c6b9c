"""The kinematic judge: what a stream holds is found from motion, and nothing without it."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.checks.motion import attitude, axes, twist
from mavframecheck.checks.motion.judge import frames
from mavframecheck.checks.motion.series import Series
from mavframecheck.engine import Pack
from mavframecheck.geo import permutations
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.alignment import yaw_matrix
from mavframecheck.model import Rule
from mavframecheck.semantics.constants import constant
from tests.checks.motion_bench import flight, recording
from tests.engine.judged import judge, run_of

RULES = Path(__file__).parents[2] / "rules"
FILES = [
    next(RULES.glob(f"*/MFC{number}-*.toml"))
    for number in (401, 402, 403, 404, 405, 406, 407, 409, 421, 507, 508)
]
PACK = Pack(
    tuple(msgspec.convert(tomllib.loads(file.read_text("utf-8")), Rule) for file in FILES),
    {file.name[:6]: str(file) for file in FILES},
)
TRUE = flight()
FRD = frames()[constant("MAV_FRAME.LOCAL_FRD")]
ENU = frames()[constant("MAV_FRAME.LOCAL_ENU")]


def seen(matrix: np.ndarray, delay_s: float = 0.05, noise_m: float = 0.03) -> Series:
    """Return the flight in other axes, a little late and noisy."""
    late = flight(shift_s=delay_s)
    noise = np.random.default_rng(7).normal(0, noise_m, late.place.shape)
    return dataclasses.replace(late, place=(late.place + noise) @ matrix.T)


def fitted(stream: Series, frame: axes.Frame = axes.NED, reference: Series = TRUE) -> axes.Fit:
    """Return the conclusion, which there must be."""
    fit = axes.compare(stream, reference, frame)
    assert isinstance(fit, axes.Fit)
    return fit


@pytest.mark.parametrize("which", range(48))
def test_every_permutation(which: int) -> None:
    """All 47 wrong ones are found and named; the right one is left alone."""
    matrix = permutations.PERMUTATIONS[which]
    fit = fitted(seen(matrix))
    assert np.allclose(fit.matrix, matrix)
    assert (fit.kind == "agrees") == (which == 0)
    if which:
        words = permutations.words(matrix)
        assert (fit.says, fit.name) == (words.sentence, words.name)
        assert fit.residual_m < 0.1
        assert fit.labelled_m > 1


@pytest.mark.parametrize("which", range(48))
def test_free_heading(which: int) -> None:
    """In LOCAL_FRD the four turns about the vertical are right, and 44 are wrong."""
    matrix = permutations.PERMUTATIONS[which]
    legal = any(np.array_equal(matrix, each) for each in permutations.QUARTER_TURNS)
    fit = fitted(seen(matrix @ yaw_matrix(0.6)), FRD)
    assert (fit.kind == "agrees") == legal
    if legal:
        assert abs(fit.residual_m) < 0.1


def test_other_labels() -> None:
    """ENU is right where the label says so, and NED is wrong there."""
    enu = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    assert fitted(seen(enu), ENU).kind == "agrees"
    assert fitted(seen(np.eye(3)), ENU).kind == "permuted"


@pytest.mark.parametrize("yaw_deg", [-170, -90, -40, -15, 15, 25, 55, 90, 130, 180])
def test_heading(yaw_deg: float) -> None:
    """A turned frame is found with its angle, as long as the label says north."""
    turned = seen(yaw_matrix(np.radians(yaw_deg)))
    fit = fitted(turned)
    assert fit.kind == ("quarter" if yaw_deg in (-170, -90, 90, 180) else "turned")
    assert abs(np.angle(np.exp(1j * (fit.yaw - np.radians(yaw_deg))))) < np.radians(2)
    assert fitted(turned, FRD).kind == "agrees"


@settings(max_examples=20, deadline=None)
@given(which=st.integers(0, 47), scale=st.floats(1e-3, 1e3), delay_s=st.floats(0, 1.2))
def test_scale_and_delay(which: int, scale: float, delay_s: float) -> None:
    """Neither scale nor delay hides the axes, and both are measured."""
    matrix = permutations.PERMUTATIONS[which]
    fit = fitted(seen(matrix * scale, delay_s))
    assert np.allclose(fit.matrix, matrix)
    assert fit.scale == pytest.approx(scale, rel=0.03)
    assert fit.delay_s == pytest.approx(delay_s, abs=0.06)


def test_jumps_do_not_matter() -> None:
    """A stream that jumps now and then is compared between its jumps."""
    stream = seen(np.eye(3))
    stream.place[130:] += [7, -3, 1]
    stream.place[260:] += [-20, 0, 0]
    assert fitted(stream).residual_m < 0.1


def test_unrelated_motion() -> None:
    """What does not follow the vehicle is not named."""
    walk = np.cumsum(np.random.default_rng(3).normal(0, 0.3, TRUE.place.shape), axis=0)
    found = axes.compare(dataclasses.replace(TRUE, place=walk), TRUE, axes.NED)
    assert isinstance(found, axes.Undecided)


def test_hover() -> None:
    """Without motion there is no conclusion, but a reason."""
    still = dataclasses.replace(TRUE, place=TRUE.place * 0.001)
    found = axes.compare(seen(np.eye(3)), still, axes.NED)
    assert isinstance(found, axes.Undecided)
    assert "hardly moves" in found.why


def test_straight_line() -> None:
    """North and south alone: what holds North is told, the heading of the rest is not known."""
    line = dataclasses.replace(TRUE, place=TRUE.place * [1, 0, 0])
    stream = dataclasses.replace(line, place=line.place[:, [1, 0, 2]])
    fit = fitted(stream, reference=line)
    assert not fit.yaw_known
    assert not fit.heights_known
    assert fit.says in ("y holds North", "")
    assert fitted(line, reference=line).kind == "agrees"


LIES: list[tuple[str, Callable[[np.ndarray], np.ndarray]]] = [
    (reading.kind, reading.of)
    for reading in attitude.READINGS
    if not (reading.free_yaw or reading.free_mount)
]


@pytest.mark.parametrize(("kind", "of"), LIES)
def test_attitudes(kind: str, of: Callable[[np.ndarray], np.ndarray]) -> None:
    """Every reading is recognised when it was written."""
    stream = dataclasses.replace(TRUE, attitude=of(TRUE.attitude))
    found = attitude.compare(stream, TRUE, free_heading=False, since_s=0.0)
    assert isinstance(found, attitude.Lie)
    assert found.kind == kind
    assert found.left < np.radians(1)


@pytest.mark.parametrize("yaw_deg", [-150, -90, 40, 90, 180])
def test_yaw_offset(yaw_deg: float) -> None:
    """A constant offset is measured, and legal where the heading is free."""
    turned = q4.product(q4.about_z(np.radians(yaw_deg)), TRUE.attitude)
    stream = dataclasses.replace(TRUE, attitude=turned)
    found = attitude.compare(stream, TRUE, free_heading=False, since_s=0.0)
    assert isinstance(found, attitude.Lie)
    assert found.kind == "yaw_offset"
    assert abs(np.angle(np.exp(1j * (found.yaw - np.radians(yaw_deg))))) < 0.01
    free = attitude.compare(stream, TRUE, free_heading=True, since_s=0.0)
    assert isinstance(free, attitude.Lie)
    assert free.kind == "labelled"


@pytest.mark.parametrize("free_heading", [False, True])
@given(
    roll=st.floats(-1.5, 1.5),
    pitch=st.floats(-1.2, 1.2),
    yaw=st.floats(-3, 3),
    noise=st.floats(0, 0.02),
)
@settings(max_examples=15, deadline=None)
def test_turned_sensors(
    roll: float, pitch: float, yaw: float, noise: float, *, free_heading: bool
) -> None:
    """A sensor that leans in the vehicle is never read as the vehicle, and mostly as what it is."""
    mount = q4.quaternion_from_euler(roll, pitch, yaw if free_heading else 0.0)
    shaking = np.random.default_rng(5).normal(0, noise, (len(TRUE.t), 3)).T
    mine = q4.product(TRUE.attitude, q4.product(mount, q4.quaternion_from_euler(*shaking)))
    if np.hypot(roll, pitch) < 0.5:
        return
    found = attitude.compare(
        dataclasses.replace(TRUE, attitude=mine), TRUE, free_heading=free_heading, since_s=0.0
    )
    assert isinstance(found, attitude.Lie)
    assert found.kind != "labelled"
    assert found.left < np.radians(7)


@pytest.mark.parametrize("lean_deg", [35, 50, -70, 140])
def test_leaning_worlds(lean_deg: float) -> None:
    """A world whose z leans is found with its angle; what leans a little is left alone."""
    lean = q4.matrix_from_quaternion(q4.quaternion_from_euler(0.2, np.radians(lean_deg), 0.4))
    fit = fitted(seen(lean))
    z = np.degrees(np.arccos(lean[2, 2]))
    assert (fit.kind, fit.says) == ("tilted", f"its z leans by {z:.0f} degrees")
    assert fitted(seen(q4.matrix_from_quaternion(q4.quaternion_from_euler(0.1, 0, 0)))).kind in (
        "agrees",
        "turned",
    )


def test_level_flight_does_not_tell_roll_from_pitch() -> None:
    """Without tilt, exchanged angles are the same angles."""
    yaw = q4.quaternion_from_euler(0, 0, np.sin(0.3 * TRUE.t))
    level = dataclasses.replace(TRUE, attitude=yaw)
    found = attitude.compare(level, level, free_heading=False, since_s=0.0)
    assert isinstance(found, attitude.Lie)
    assert found.kind == "labelled"
    assert not {"swapped", "body"} & found.told
    assert {"yaw_offset", "yaw_sign", "frames"} <= found.told


def test_without_a_turn_no_yaw_is_told() -> None:
    """A heading that stays could be off or mirrored by any angle."""
    roll, pitch, _ = q4.euler_from_quaternion(TRUE.attitude).T
    straight = dataclasses.replace(TRUE, attitude=q4.quaternion_from_euler(roll, pitch, 0.7))
    found = attitude.compare(straight, straight, free_heading=False, since_s=0.0)
    assert isinstance(found, attitude.Lie)
    assert not {"yaw_offset", "yaw_sign"} & found.told
    assert "swapped" in found.told


@pytest.mark.parametrize("yaw_deg", [-140.0, 0.0, 40.0])
def test_order_of_elements_in_a_free_heading(yaw_deg: float) -> None:
    """The heading of the frame is turned first, the elements are exchanged afterwards."""
    turned = q4.product(q4.about_z(np.radians(yaw_deg)), TRUE.attitude)
    stream = dataclasses.replace(TRUE, attitude=turned[:, [1, 2, 3, 0]])
    found = attitude.compare(stream, TRUE, free_heading=True, since_s=0.0)
    assert isinstance(found, attitude.Lie)
    assert found.kind == "order"


def test_a_velocity_along_the_nose_tells_no_front_left_up() -> None:
    """What never moves sideways reads the same in both."""
    ahead = np.column_stack((np.full(len(TRUE.t), 5.0), np.zeros((len(TRUE.t), 2))))
    yaw = q4.quaternion_from_euler(0, 0, 0.3 * TRUE.t)
    world = q4.turn_by(yaw, ahead)
    place = np.cumsum(world, axis=0) * 0.1
    true = dataclasses.replace(TRUE, attitude=yaw, place=place)
    stream = dataclasses.replace(true, velocity=ahead)
    found = twist.compare(stream, true, true, body=True, yaw=0.0, delay_s=0.0, rate=1.0)
    assert isinstance(found, twist.Twist)
    assert found.kind == "labelled"
    assert "flu" not in found.told
    assert "world" in found.told


@pytest.mark.parametrize("heading", [0.0, 0.7])
@pytest.mark.parametrize("written", ["body", "world", "inverse", "flu", "level flu"])
def test_velocities(written: str, heading: float) -> None:
    """A body velocity is read in the axes in which it was written, whatever heading the stream's world has."""
    own = q4.about_z(-heading)
    lies, way = q4.product(own, TRUE.attitude), q4.turn_by(own, TRUE.velocity)
    level = q4.about_z(q4.euler_from_quaternion(lies)[:, 2])
    given = {
        "body": q4.turn_by(q4.inverse(lies), way),
        "world": way,
        "inverse": q4.turn_by(lies, way),
        "flu": q4.turn_by(q4.inverse(lies), way) * [1, -1, -1],
        "level flu": q4.turn_by(q4.inverse(level), way) * [1, -1, -1],
    }[written]
    stream = dataclasses.replace(TRUE, velocity=given)
    found = twist.compare(stream, TRUE, TRUE, body=True, yaw=-heading, delay_s=0.0, rate=1.0)
    assert isinstance(found, twist.Twist)
    assert found.reading == ("labelled" if written == "body" else written)


def test_a_velocity_in_east_north_up() -> None:
    """A body velocity that was written in east, north, up."""
    stream = dataclasses.replace(TRUE, velocity=TRUE.velocity[:, [1, 0, 2]] * [1, 1, -1])
    found = twist.compare(stream, TRUE, TRUE, body=True, yaw=0.0, delay_s=0.0, rate=1.0)
    assert isinstance(found, twist.Twist)
    assert found.kind == "enu"


def enu(true: Series, k: int) -> dict[str, Any]:
    """Return a vision pose in east, north, up."""
    x, y, z = true.place[k].tolist()
    roll, pitch, yaw = q4.euler_from_quaternion(true.attitude[k]).tolist()
    lies = {"roll": roll, "pitch": -pitch, "yaw": np.pi / 2 - yaw}
    return {"usec": k * 100_000, "x": y, "y": x, "z": -z, **lies}


def ned(true: Series, k: int) -> dict[str, Any]:
    """Return a vision pose as it should be."""
    x, y, z = true.place[k].tolist()
    roll, pitch, yaw = q4.euler_from_quaternion(true.attitude[k]).tolist()
    return {"usec": k * 100_000, "x": x, "y": y, "z": z, "roll": roll, "pitch": pitch, "yaw": yaw}


WRONG = recording("VISION_POSITION_ESTIMATE", enu)


def test_words_of_a_finding() -> None:
    """One mistake makes one finding, in words and numbers."""
    _, findings = judge(WRONG, pack=PACK)
    (finding,) = findings
    assert finding.code == "MFC401"
    assert "x holds East, y holds North, z is up: this is ENU" in finding.text
    assert "GLOBAL_POSITION_INT" in finding.text


def test_clean() -> None:
    """A right pose is silent, and says that it was looked at."""
    result = judge(recording("VISION_POSITION_ESTIMATE", ned), pack=PACK)
    assert not result[1]
    assert run_of(result, "MFC401").status == "ran"
    assert run_of(result, "MFC404").status == "ran"


def test_insufficient() -> None:
    """Too short a flight is no pass."""
    result = judge(recording("VISION_POSITION_ESTIMATE", enu, seconds=3.0), pack=PACK)
    assert not result[1]
    run = run_of(result, "MFC401")
    assert run.status == "insufficient-data"
    assert "hardly moves" in run.reason


@settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, len(WRONG)), min_size=1, max_size=12))
def test_cuts(cuts: list[int]) -> None:
    """Findings do not depend on batches."""
    assert judge(WRONG, cuts, PACK)[1] == judge(WRONG, pack=PACK)[1]


@pytest.mark.parametrize("turning", [0.0, 1.0])
def test_front_left_up_or_north_west_up(turning: float) -> None:
    """On the way north both are one, and neither is said; with turns it is the body's."""
    yaw = q4.quaternion_from_euler(0, 0, turning * 1.5 * np.sin(0.4 * TRUE.t))
    true = dataclasses.replace(TRUE, attitude=yaw)
    given = q4.turn_by(q4.inverse(yaw), true.velocity) * [1, -1, -1]
    stream = dataclasses.replace(true, velocity=given)
    found = twist.compare(stream, true, true, body=False, yaw=0.0, delay_s=0.0, rate=1.0)
    if turning:
        assert isinstance(found, twist.Twist)
        assert found.kind == "flu"
    else:
        assert isinstance(found, str)
        assert "front-left-up" in found
        assert "north-west-up" in found
