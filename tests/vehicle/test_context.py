"""Who is who, whom a message is about, and what is known of each vehicle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mavframecheck.vehicle import NAMES, Context
from mavframecheck.vehicle.roles import (
    version_from_banner,
    version_from_flight_sw,
    version_text,
)
from mavframecheck.wire import Batch, Table
from tests.strategies import START_US, frame, read

COPTER = {"type": 2, "autopilot": 3}
PX4 = {"type": 2, "autopilot": 12}
GCS = {"type": 6, "autopilot": 8}
COMPUTER = {"type": 18, "autopilot": 8}
HOME = {"latitude": 473977420, "longitude": 85455940, "altitude": 488_000}
AT = {"lat": 473977420, "lon": 85455940, "alt": 500_000, "relative_alt": 12_000, "hdg": 9000}

Said = tuple[str, dict[str, Any], tuple[int, int]]
SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"


def batches(*said: Said, each: bool = False, step_s: float = 0.1) -> list[Batch]:
    """Return messages as one batch, or each in a batch of its own."""
    pieces = []
    for k, (name, fields, sender) in enumerate(said):
        stamp = (START_US + round(k * step_s * 1e6)).to_bytes(8, "big")
        pieces.append(stamp + frame(name, fields, sender, k % 256))
    return read(pieces if each else [b"".join(pieces)], stamped=True).batches


def context_of(*said: Said, each: bool = False, assumed: str | None = None) -> Context:
    """Return what is known after some messages."""
    context = Context(assumed)
    for batch in batches(*said, each=each):
        context.update(batch)
        context.settle()
    return context


def seen(
    name: str, message: str, *said: Said, assumed: str | None = None, step_s: float = 0.1
) -> list[Any]:
    """Return a context name for all rows of a message, unknown ones as None."""
    context, found = Context(assumed), []
    for batch in batches(*said, step_s=step_s):
        context.update(batch)
        if message in batch.tables:
            column = context.lookup(name, batch.tables[message])
            words = column.words.tolist()
            found += [w if k else None for w, k in zip(words, column.known.tolist())]
        context.settle()
    return found


def about(message: str, *said: Said) -> list[int]:
    """Return the system that each row of a message is about."""
    context = Context()
    (batch,) = (b for b in batches(*said) if len(b))
    context.update(batch)
    table: Table = batch.tables[message]
    return context.about(table).tolist()  # type: ignore[no-any-return]


class TestRoles:
    """By heartbeat, else by the convention of ids."""

    @pytest.mark.parametrize(
        ("sender", "role"),
        [
            ((1, 1), "autopilot"),
            ((7, 1), "autopilot"),
            ((255, 0), "gcs"),
            ((255, 1), "gcs"),
            ((1, 190), "gcs"),
            ((1, 191), "companion"),
            ((1, 100), "camera"),
            ((1, 154), "gimbal"),
            ((1, 156), "adsb"),
            ((1, 42), "unknown"),
        ],
    )
    def test_by_convention(self, sender: tuple[int, int], role: str) -> None:
        assert seen("sender.role", "ATTITUDE", ("ATTITUDE", {}, sender)) == [role]

    @pytest.mark.parametrize(
        ("heartbeat", "role"), [(COPTER, "autopilot"), (GCS, "gcs"), (COMPUTER, "companion")]
    )
    def test_by_heartbeat(self, heartbeat: dict[str, int], role: str) -> None:
        """From the row behind it on: who speaks before is who the ids suggest."""
        one: Said = ("ATTITUDE", {}, (9, 42))
        said: list[Said] = [one, ("HEARTBEAT", heartbeat, (9, 42)), one]
        assert seen("sender.role", "ATTITUDE", *said) == ["unknown", role]

    def test_a_role_may_change(self) -> None:
        one: Said = ("ATTITUDE", {}, (9, 1))
        said: list[Said] = [
            *(("HEARTBEAT", COPTER, (9, 1)), one, ("HEARTBEAT", GCS, (9, 1)), one),
        ]
        assert seen("sender.role", "ATTITUDE", *said) == ["autopilot", "gcs"]
        assert context_of(*said, each=True).role(9 * 256 + 1) == "gcs"


class TestIdentity:
    """Family, type and version."""

    @pytest.mark.parametrize(
        ("mav_type", "autopilot", "family"),
        [
            (2, 12, "px4"),
            (2, 3, "arducopter"),
            (1, 3, "arduplane"),
            (10, 3, "ardurover"),
            (12, 3, "ardusub"),
        ],
    )
    def test_family(self, mav_type: int, autopilot: int, family: str) -> None:
        said: Said = ("HEARTBEAT", {"type": mav_type, "autopilot": autopilot}, (1, 1))
        context = context_of(said)
        assert context.last("vehicle.autopilot", 1) == family
        assert context.last("vehicle.type", 1) == mav_type
        assert context.last("vehicle.autopilot", 2) is None

    def test_a_ground_station_is_no_vehicle(self) -> None:
        assert context_of(("HEARTBEAT", GCS, (255, 190))).last("vehicle.autopilot", 255) is None

    @pytest.mark.parametrize(
        ("text", "version"),
        [
            (b"ArduCopter V4.5.7 (2a3dc4b7)", 4_005_007),
            (b"ArduPlane V4.6.0-beta1", 4_006_000),
            (b"APM:Copter V3.2.1 (36b405fb)", 3_002_001),
            (b"ArduRover V4.4.0", 4_004_000),
            (b"PX4 v1.15.4", 1_015_004),
            (b"Frame: QUAD/X", None),
            (b"\xff\xfe V4.5", None),
        ],
    )
    def test_version_in_a_banner(self, text: bytes, version: int | None) -> None:
        assert version_from_banner(text) == version
        said: list[Said] = [
            ("HEARTBEAT", COPTER, (1, 1)),
            ("STATUSTEXT", {"severity": 6, "text": text}, (1, 1)),
        ]
        assert context_of(*said).last("vehicle.version", 1) == version

    def test_version_in_autopilot_version(self) -> None:
        """One byte each for major, minor, patch and type."""
        said: list[Said] = [
            ("HEARTBEAT", PX4, (1, 1)),
            ("AUTOPILOT_VERSION", {"flight_sw_version": 0x010F04FF}, (1, 1)),
        ]
        assert context_of(*said).last("vehicle.version", 1) == 1_015_004
        assert version_from_flight_sw(0) is None
        assert version_text(1_015_004) == "1.15.4"
        assert version_text(None) is None

    def test_what_others_say_of_versions_is_not_the_vehicles(self) -> None:
        said: list[Said] = [
            ("HEARTBEAT", COPTER, (1, 1)),
            ("STATUSTEXT", {"text": b"ArduCopter V4.5.7"}, (1, 191)),
            ("HOME_POSITION", HOME, (255, 190)),
        ]
        context = context_of(*said)
        assert context.last("vehicle.version", 1) is None
        assert context.last("home.lat", 255) is None

    def test_a_family_to_assume(self) -> None:
        """--autopilot: where no heartbeat tells; one that tells wins from then on."""
        one: Said = (SETPOINT, {"target_system": 1}, (1, 191))
        assert seen("vehicle.autopilot", SETPOINT, one, assumed="px4") == ["px4"]
        told = [one, ("HEARTBEAT", COPTER, (1, 1)), one]
        assert seen("vehicle.autopilot", SETPOINT, *told, assumed="px4") == ["px4", "arducopter"]
        assert seen("vehicle.autopilot", SETPOINT, one) == [None]


class TestAbout:
    """Whom a message is about (DESIGN law 5)."""

    def test_the_target_first(self) -> None:
        said: list[Said] = [
            ("HEARTBEAT", COPTER, (1, 1)),
            ("HEARTBEAT", COPTER, (2, 1)),
            (SETPOINT, {"target_system": 2}, (1, 191)),
            (SETPOINT, {"target_system": 7}, (1, 191)),
        ]
        assert about(SETPOINT, *said) == [2, 7]

    def test_an_autopilot_speaks_of_itself(self) -> None:
        """Even where it names a target: an answer to a ground station is not about that."""
        said: list[Said] = [
            ("HEARTBEAT", COPTER, (1, 1)),
            ("COMMAND_ACK", {"target_system": 255}, (1, 1)),
        ]
        assert about("COMMAND_ACK", *said) == [1]

    def test_the_autopilot_that_shares_the_system_id(self) -> None:
        said: list[Said] = [
            ("HEARTBEAT", COPTER, (1, 1)),
            ("HEARTBEAT", COPTER, (2, 1)),
            ("ODOMETRY", {}, (2, 191)),
        ]
        assert about("ODOMETRY", *said) == [2]

    def test_the_only_autopilot(self) -> None:
        said: list[Said] = [("HEARTBEAT", COPTER, (1, 1)), (SETPOINT, {}, (255, 190))]
        assert about(SETPOINT, *said) == [1]

    def test_the_one_that_is_heard_later(self) -> None:
        said: list[Said] = [(SETPOINT, {}, (255, 190)), ("HEARTBEAT", COPTER, (1, 1))]
        assert about(SETPOINT, *said) == [1]

    def test_one_of_several_is_nobody(self) -> None:
        said: list[Said] = [
            ("HEARTBEAT", COPTER, (1, 1)),
            ("HEARTBEAT", COPTER, (2, 1)),
            (SETPOINT, {}, (255, 190)),
        ]
        assert about(SETPOINT, *said) == [-1]

    def test_nobody(self) -> None:
        assert about(SETPOINT, (SETPOINT, {}, (255, 190))) == [-1]


class TestColumns:
    """What rows see."""

    VEHICLE: Said = ("HEARTBEAT", COPTER, (1, 1))
    ROW: Said = (SETPOINT, {"target_system": 1}, (1, 191))

    def test_position_in_si(self) -> None:
        said = (self.VEHICLE, ("GLOBAL_POSITION_INT", AT, (1, 1)), self.ROW)
        assert seen("vehicle.lat", SETPOINT, *said) == [pytest.approx(47.397742)]
        assert seen("vehicle.relative_alt", SETPOINT, *said) == [pytest.approx(12.0)]
        assert seen("vehicle.yaw", SETPOINT, *said) == [pytest.approx(math.pi / 2)]

    def test_no_position_yet(self) -> None:
        """0, 0 is what a vehicle says before it has a fix."""
        said = (self.VEHICLE, ("GLOBAL_POSITION_INT", AT | {"lat": 0, "lon": 0}, (1, 1)), self.ROW)
        assert seen("vehicle.lat", SETPOINT, *said) == [None]

    def test_home_and_its_substitute(self) -> None:
        """HOME_POSITION, else height minus relative height; never that of another vehicle."""
        position: Said = ("GLOBAL_POSITION_INT", AT, (1, 1))
        assert seen("home.alt_msl", SETPOINT, self.VEHICLE, position, self.ROW) == [488.0]
        home: Said = ("HOME_POSITION", HOME | {"altitude": 400_000}, (1, 1))
        assert seen("home.alt_msl", SETPOINT, self.VEHICLE, position, home, self.ROW) == [400.0]
        other: Said = ("HOME_POSITION", HOME, (2, 1))
        second: Said = ("HEARTBEAT", COPTER, (2, 1))
        assert seen("home.alt_msl", SETPOINT, self.VEHICLE, second, other, self.ROW) == [None]

    def test_two_vehicles(self) -> None:
        said: list[Said] = [
            self.VEHICLE,
            ("HEARTBEAT", PX4, (2, 1)),
            (SETPOINT, {"target_system": 2}, (255, 190)),
            (SETPOINT, {"target_system": 1}, (255, 190)),
            (SETPOINT, {"target_system": 3}, (255, 190)),
        ]
        assert seen("vehicle.autopilot", SETPOINT, *said) == ["px4", "arducopter", None]

    def test_a_position_that_went_stale(self) -> None:
        said = (self.VEHICLE, ("GLOBAL_POSITION_INT", AT, (1, 1)), self.ROW)
        assert seen("vehicle.lat", SETPOINT, *said, step_s=29.0) != [None]
        assert seen("vehicle.lat", SETPOINT, *said, step_s=31.0) == [None]

    def test_answers_come_after_the_command(self) -> None:
        ack: Said = ("COMMAND_ACK", {"command": 22, "result": 4}, (1, 1))
        command: Said = ("COMMAND_LONG", {"command": 22, "target_system": 1}, (255, 190))
        other: Said = ("COMMAND_LONG", {"command": 16, "target_system": 1}, (255, 190))
        said = (self.VEHICLE, ack, command, other, ack)
        assert seen("answer.result", "COMMAND_LONG", *said) == [4.0, None]
        late = (self.VEHICLE, command, ack)
        assert seen("answer.result", "COMMAND_LONG", *late, step_s=5.5) == [None]

    def test_every_name_can_be_asked_for(self) -> None:
        """Of a row about nobody each is unknown, but for the role of who sent it; each says what is missing."""
        (batch, *_) = batches((SETPOINT, {}, (255, 190)))
        for name, entry in NAMES.items():
            context = Context()
            context.update(batch)
            column = context.lookup(name, batch.tables[SETPOINT])
            assert column.known.tolist() == [name == "sender.role"], name
            assert entry.meaning
            assert entry.missing or name == "sender.role"
        with pytest.raises(KeyError):
            Context().lookup("vehicle.colour", batch.tables[SETPOINT])


def test_texts_are_bounded() -> None:
    """A hostile log with a new text in each message does not fill the memory."""
    said: list[Said] = [("HEARTBEAT", COPTER, (1, 1))]
    said += [("STATUSTEXT", {"severity": 2, "text": b"%d" % k}, (1, 1)) for k in range(3000)]
    context = context_of(*said)
    assert len(context._words["text"]) <= 2000


def test_words_of_a_batch_are_not_those_of_the_next() -> None:
    """Lists of texts grow: what was looked up before keeps its meaning."""
    context = Context()
    first, second = (
        b
        for b in batches(("HEARTBEAT", COPTER, (1, 1)), ("HEARTBEAT", PX4, (2, 1)), each=True)
        if len(b)
    )
    context.update(first)
    context.settle()
    known = context.lookup("vehicle.autopilot", first.tables["HEARTBEAT"])
    context.update(second)
    again = context.lookup("vehicle.autopilot", second.tables["HEARTBEAT"])
    assert known.known.tolist() == [True]
    assert known.words.tolist() == ["arducopter"]
    assert np.asarray(again.words).tolist() == ["px4"]
