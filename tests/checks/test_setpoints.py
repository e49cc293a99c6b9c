"""Setpoint streams: offsets that run away, yaws of zero that nobody meant, masks that flicker."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.checks.setpoints import MAX_STREAMS
from mavframecheck.engine import Pack
from mavframecheck.model import Rule
from tests.engine.judged import Result, judge, run_of
from tests.strategies import CUTS, START_US, frame

RULES = Path(__file__).parents[2] / "rules"
VEHICLE, COMPANION, SECOND = (1, 1), (1, 191), (255, 190)
LOCAL, OFFSET, BODY_OFFSET, BODY = 1, 7, 9, 8
POSITION, POSITION_AND_YAW, VELOCITY, NOTHING_OF_YAW_IGNORED = 0x0DF8, 0x09F8, 0x0DC7, 0x01F8
EAST, NORTH = 1.5707963, 0.0
ZERO_YAW, RUNAWAY, FLICKER = "MFC107", "MFC110", "MFC120"


def pack(code: str) -> Pack:
    """Return a shipped rule alone."""
    file = next(RULES.glob(f"*/{code}-*.toml"))
    rule = msgspec.convert(tomllib.loads(file.read_text("utf-8")), Rule)
    return Pack((rule,), {code: str(file)})


PACKS = {code: pack(code) for code in (ZERO_YAW, RUNAWAY, FLICKER)}


class Flight:
    """A recording that grows; `t` is its present, s."""

    def __init__(self) -> None:
        self.data, self.t = b"", 0.0
        self.say("HEARTBEAT", VEHICLE, type=2, autopilot=3, mavlink_version=3)

    def say(self, name: str, sender: tuple[int, int], **fields: Any) -> Flight:
        """Append a message, a tenth of a second later."""
        self.t += 0.1
        stamp = START_US + round(self.t * 1e6)
        self.data += stamp.to_bytes(8, "big") + frame(name, fields, sender)
        return self

    def at(self, x: float, y: float, z: float = -10.0, yaw: float = 0.0) -> Flight:
        """Let the vehicle say where it is and where it points."""
        self.say("LOCAL_POSITION_NED", VEHICLE, x=x, y=y, z=z)
        if math.isfinite(x):
            self.say("GLOBAL_POSITION_INT", VEHICLE, lat=round(x * 90), lon=round(y * 90))
        return self.say("ATTITUDE", VEHICLE, yaw=yaw)

    def go(
        self,
        x: float,
        y: float,
        *,
        yaw: float = 0.0,
        mask: int = POSITION_AND_YAW,
        coordinate_frame: int = LOCAL,
        sender: tuple[int, int] = COMPANION,
        z: float = -10.0,
        **more: float,
    ) -> Flight:
        """Send a setpoint."""
        known = {"x": x, "y": y, "z": z, "yaw": yaw, "type_mask": mask}
        return self.say(
            "SET_POSITION_TARGET_LOCAL_NED",
            sender,
            **{"target_system": 1, "coordinate_frame": coordinate_frame, **known, **more},
        )

    def judged(self, code: str, cuts: Any = ()) -> Result:
        """Judge what was recorded so far."""
        return judge(self.data, cuts, PACKS[code])

    def count(self, code: str) -> int:
        """Return how many findings a rule has."""
        return len(self.judged(code)[1])


def streamed_place() -> Flight:
    """Return a flight in which a place is streamed in an offset frame."""
    flight = Flight()
    for k in range(8):
        flight.at(15 + 3 * k, 5 + 2 * k).go(20, 20, mask=POSITION, coordinate_frame=OFFSET)
        flight.t += 0.5
    return flight


def forgotten_yaw() -> Flight:
    """Return a flight whose first leg is flown nose first, the next two with a yaw of 0."""
    flight = Flight().at(0, 0).go(0, 30, yaw=EAST)
    flight.t += 5
    flight.at(0, 30).go(-30, 30)
    flight.t += 5
    return flight.at(-30, 30).go(-30, 0)


def flickering() -> Flight:
    """Return setpoints that give a yaw every other time."""
    flight = Flight()
    for k in range(12):
        flight.go(5, 5, yaw=1.0, mask=POSITION if k % 2 else POSITION_AND_YAW)
    return flight


class TestRunawayOffset:
    """A position in an offset frame, sent again and again."""

    def test_streamed_place_is_one_finding(self) -> None:
        """The vehicle chases its own target: once, with the way it was led."""
        _, findings = streamed_place().judged(RUNAWAY)
        assert [finding.count for finding in findings] == [8]
        assert "repeated 8 times while the vehicle moved 25.2 m" in findings[0].text

    def test_place_of_the_vehicle(self) -> None:
        """Sent once, an offset equal to where the vehicle is far from the origin meant: stay."""
        flight = Flight().at(40, -30).go(40.5, -30, mask=POSITION, coordinate_frame=BODY_OFFSET)
        assert flight.count(RUNAWAY) == 1

    @pytest.mark.parametrize("coordinate_frame", [OFFSET, BODY_OFFSET])
    def test_a_nudge_is_quiet(self, coordinate_frame: int) -> None:
        """An offset that is sent three times within a moment, then flown."""
        flight = Flight().at(40, -30)
        for _ in range(3):
            flight.go(5, 0, z=0.0, mask=POSITION, coordinate_frame=coordinate_frame)
        flight.at(45, -30)
        assert flight.count(RUNAWAY) == 0

    def test_offsets_that_shrink_are_quiet(self) -> None:
        """A target that is tracked: the offset is measured anew each time."""
        flight = Flight()
        for k in range(10):
            flight.at(k, 0).go(10 - k, 0, z=0.0, mask=POSITION, coordinate_frame=BODY_OFFSET)
        assert flight.count(RUNAWAY) == 0

    def test_other_frames_and_velocities_are_quiet(self) -> None:
        """The same stream in LOCAL_NED, and as a velocity, is what these are for."""
        flight = Flight()
        for k in range(8):
            flight.at(15 + 3 * k, 5).go(60, 20, mask=POSITION)
            flight.go(60, 20, mask=VELOCITY, coordinate_frame=OFFSET, vx=3.0)
        assert flight.count(RUNAWAY) == 0

    def test_without_positions_it_cannot_tell(self) -> None:
        """Silence of the vehicle is no pass."""
        flight = Flight()
        for _ in range(8):
            flight.go(20, 20, mask=POSITION, coordinate_frame=OFFSET)
        result = flight.judged(RUNAWAY)
        assert not result[1]
        assert run_of(result, RUNAWAY).status == "insufficient-data"

    def test_old_positions_do_not_count(self) -> None:
        """Where the vehicle was a minute ago says nothing."""
        flight = Flight().at(40, -30)
        flight.t += 60
        flight.go(40, -30, mask=POSITION, coordinate_frame=OFFSET)
        assert flight.count(RUNAWAY) == 0

    def test_what_the_autopilot_sends_is_quiet(self) -> None:
        """An autopilot that leads another vehicle is not judged."""
        flight = Flight()
        for k in range(8):
            flight.at(15 + 3 * k, 5)
            flight.go(20, 20, mask=POSITION, coordinate_frame=OFFSET, sender=VEHICLE)
        assert flight.count(RUNAWAY) == 0


class TestZeroYaw:
    """A yaw of exactly 0 that counts."""

    def test_forgotten_after_legs_nose_first(self) -> None:
        """Once, with the courses."""
        _, findings = forgotten_yaw().judged(ZERO_YAW)
        assert len(findings) == 1
        assert "towards 180 deg, 270 deg" in findings[0].text

    def test_nothing_of_yaw_ignored(self) -> None:
        """Yaw and yaw rate both count and are 0, while the vehicle points east."""
        flight = Flight().at(0, 0, yaw=EAST)
        for _ in range(5):
            flight.go(10, 0, mask=NOTHING_OF_YAW_IGNORED)
        _, findings = flight.judged(ZERO_YAW)
        assert [finding.count for finding in findings] == [5]
        assert "points to 90 deg" in findings[0].text

    def test_force_bit_for_the_yaw_bit(self) -> None:
        """Bit 512 where 1024 was meant."""
        flight = Flight().at(0, 0, yaw=EAST).go(10, 0, mask=0x0BF8)
        assert "bit 512" in flight.judged(ZERO_YAW)[1][0].text

    def test_global_setpoints(self) -> None:
        """The same over latitude and longitude, near the equator where a metre is 90 units."""
        flight = Flight()
        legs = [(0, 0, 0, 30, EAST), (0, 30, -30, 30, NORTH), (-30, 30, -30, 0, NORTH)]
        for x, y, to_x, to_y, yaw in legs:
            flight.at(x, y)
            flight.say(
                "SET_POSITION_TARGET_GLOBAL_INT",
                COMPANION,
                target_system=1,
                lat_int=to_x * 90,
                lon_int=to_y * 90,
                alt=20.0,
                yaw=yaw,
                type_mask=POSITION_AND_YAW,
                coordinate_frame=6,
            )
            flight.t += 5
        assert flight.count(ZERO_YAW) == 1

    def test_always_north_is_quiet(self) -> None:
        """Who never gives another yaw may want north."""
        flight = Flight().at(0, 0, yaw=EAST)
        for x, y in [(0, 30), (-30, 30), (-30, 0), (0, 0)]:
            flight.go(x, y)
            flight.t += 5
            flight.at(x, y)
        assert flight.count(ZERO_YAW) == 0

    def test_legs_to_the_north_are_quiet(self) -> None:
        """Nose first all the way, two legs of it to the north."""
        flight = Flight().at(0, 0).go(0, 30, yaw=EAST)
        for x in (30, 60):
            flight.t += 5
            flight.at(x - 30, 30, yaw=EAST).go(x, 30)
        assert flight.count(ZERO_YAW) == 0

    def test_short_ways_have_no_direction(self) -> None:
        """Setpoints close by, as in a hover, are no legs."""
        flight = Flight().at(0, 0).go(0, 30, yaw=EAST)
        for k in range(10):
            flight.at(0, 30).go(-1, 30 + 0.1 * k)
        assert flight.count(ZERO_YAW) == 0

    def test_body_frames_and_ignored_yaws_are_quiet(self) -> None:
        """Zero in a frame of the body means: hold the heading."""
        flight = Flight().at(0, 0, yaw=EAST)
        flight.go(0, 0, mask=0x01C7, coordinate_frame=BODY, vx=1.0)
        flight.go(10, 0, mask=POSITION)
        assert flight.count(ZERO_YAW) == 0

    def test_without_attitude_it_is_quiet(self) -> None:
        """Nothing is known of where the vehicle points or is."""
        flight = Flight()
        for _ in range(5):
            flight.go(10, 0, mask=NOTHING_OF_YAW_IGNORED)
        assert flight.count(ZERO_YAW) == 0


class TestFlickeringYaw:
    """The yaw ignore bit comes and goes."""

    def test_every_other_setpoint_is_one_finding(self) -> None:
        """Eleven switches, one finding."""
        _, findings = flickering().judged(FLICKER)
        assert [finding.count for finding in findings] == [11]

    def test_two_senders_are_two_streams(self) -> None:
        """Each for itself is steady."""
        flight = Flight()
        for _ in range(6):
            flight.go(5, 5).go(5, 5, mask=POSITION, sender=SECOND)
        assert flight.count(FLICKER) == 0

    def test_once_is_quiet(self) -> None:
        """A yaw that is given once, and taken back, is two switches."""
        flight = Flight()
        for mask in (POSITION, POSITION, POSITION_AND_YAW, POSITION, POSITION):
            flight.go(5, 5, mask=mask)
        assert flight.count(FLICKER) == 0

    def test_seldom_is_quiet(self) -> None:
        """A switch every eight seconds."""
        flight = Flight()
        for k in range(12):
            flight.go(5, 5, mask=POSITION if k % 2 else POSITION_AND_YAW)
            flight.t += 8
        assert flight.count(FLICKER) == 0

    def test_kinds_in_turn_are_quiet(self) -> None:
        """Positions with a yaw and velocities without one."""
        flight = Flight()
        for k in range(12):
            flight.go(5, 5, mask=VELOCITY if k % 2 else POSITION_AND_YAW)
        assert flight.count(FLICKER) == 0


@pytest.mark.parametrize(
    ("code", "flight"),
    [(RUNAWAY, streamed_place()), (ZERO_YAW, forgotten_yaw()), (FLICKER, flickering())],
    ids=[RUNAWAY, ZERO_YAW, FLICKER],
)
@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=CUTS)
def test_cuts(code: str, flight: Flight, cuts: list[int]) -> None:
    """The report is the same however the bytes arrive."""
    assert flight.judged(code, cuts) == flight.judged(code)


@settings(max_examples=15, deadline=None)
@given(
    steps=st.lists(
        st.tuples(
            st.sampled_from([0.0, 5.0, 20.0, float("nan"), float("inf")]),
            st.sampled_from([POSITION, POSITION_AND_YAW, VELOCITY, 0, 0xFFFF]),
            st.sampled_from([LOCAL, OFFSET, BODY_OFFSET, 99]),
            st.booleans(),
        ),
        max_size=20,
    ),
    cuts=CUTS,
)
@pytest.mark.parametrize("code", list(PACKS))
def test_any_setpoints(code: str, steps: list[tuple[float, int, int, bool]], cuts: Any) -> None:
    """Whatever is sent, with and without the vehicle's word: no crash, and cuts do not matter."""
    flight = Flight()
    for number, mask, coordinate_frame, says in steps:
        if says:
            flight.at(number, 3.0, yaw=1.0)
        flight.go(number, 1.0, mask=mask, coordinate_frame=coordinate_frame)
    assert flight.judged(code, cuts) == flight.judged(code)


def test_many_streams_are_bounded() -> None:
    """More targets than are followed: the first ones are judged, the others left alone."""
    flight = Flight()
    for target in range(MAX_STREAMS + 1):
        for sender in (COMPANION, SECOND):
            flight.go(5, 5, target_system=target % 256, sender=sender)
    assert flight.count(FLICKER) == 0
