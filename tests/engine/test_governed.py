"""What masks leave in use, and what the acceptance data says, as rules see it."""

from __future__ import annotations

from typing import Any

import pytest

from mavframecheck.engine.functions import called, extent
from tests.engine.judged import judge, pack_of, rule
from tests.strategies import START_US, frame

COPTER, ROVER, PX4 = (2, 3), (10, 3), (2, 12)
"""MAV_TYPE and MAV_AUTOPILOT."""


def holds(
    flag: str, message: str, vehicle: tuple[int, int] | None = None, **fields: Any
) -> bool | None:
    """Return whether an expression holds for one message to a vehicle, None when nobody judges it."""
    judged = rule(
        applies={"message": [message]}, detect={"flag": flag}, explain={"text": "it holds"}
    )
    heartbeat = []
    if vehicle is not None:
        kind = {"type": vehicle[0], "autopilot": vehicle[1], "mavlink_version": 3}
        heartbeat = [frame("HEARTBEAT", kind, (1, 1))]
    said = [*heartbeat, frame(message, fields, (1, 191))]
    data = b"".join((START_US + k).to_bytes(8, "big") + one for k, one in enumerate(said))
    report, findings = judge(data, pack=pack_of(judged))
    return bool(findings) if report.runs[0].checked else None


LOCAL, GLOBAL = "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT"


class TestMasks:
    """Groups of fields, by the ignore bits of the catalogue."""

    @pytest.mark.parametrize(
        ("mask", "groups"),
        [(0x0DF8, 1), (0x0DC7, 1), (0x09F8, 2), (0x0000, 5), (0x0FFF, 0), (0x0DFC, 1), (0x0007, 4)],
    )
    @pytest.mark.parametrize("message", [LOCAL, GLOBAL])
    def test_groups_used(self, message: str, mask: int, groups: int) -> None:
        """A group counts that is used in part."""
        assert holds(f"groups_used(type_mask) == {groups}", message, type_mask=mask)

    def test_used_zero(self) -> None:
        """Only what counts is asked."""
        assert holds("used_zero(type_mask)", LOCAL, type_mask=0x0DC7, x=5.0)
        assert not holds("used_zero(type_mask)", LOCAL, type_mask=0x0DC7, vz=-0.1)

    def test_ignored_given(self) -> None:
        """Every group that is ignored as a whole must hold something; NaN is nothing."""
        assert holds("ignored_given(type_mask)", LOCAL, type_mask=0x0007, y=5.0)
        assert not holds("ignored_given(type_mask)", LOCAL, type_mask=0x0007, y=float("nan"))
        assert not holds("ignored_given(type_mask)", LOCAL, type_mask=0x003F, y=5.0)
        assert not holds("ignored_given(type_mask)", LOCAL, type_mask=0, y=5.0)

    def test_array_fields(self) -> None:
        """A quaternion is a group as well."""
        message, q = "SET_ATTITUDE_TARGET", [0.0, 0.0, 0.0, 1.0]
        assert holds("groups_used(type_mask) == 2", message, type_mask=0x80, q=q)
        assert holds("ignored_given(type_mask)", message, type_mask=0x80, q=q)
        assert holds("used_zero(type_mask)", message, type_mask=0x80, q=q)
        assert not holds("used_zero(type_mask)", message, type_mask=0x07, q=q)


class TestAcceptance:
    """The autopilot that a row is about decides."""

    @pytest.mark.parametrize(
        ("vehicle", "says"), [(COPTER, "no"), (PX4, "unknown"), (None, "unknown")]
    )
    def test_listed(self, vehicle: tuple[int, int] | None, says: str) -> None:
        """A value against a set of numbers; PX4's depends on its version."""
        flag = f"listed('child_frames', raw(child_frame_id)) == '{says}'"
        assert holds(flag, "ODOMETRY", vehicle, child_frame_id=1)

    def test_listed_yes(self) -> None:
        """ArduPilot takes BODY_FRD alone."""
        flag = "listed('child_frames', raw(child_frame_id)) == 'yes'"
        assert holds(flag, "ODOMETRY", COPTER, child_frame_id=12)

    def test_takes(self) -> None:
        """The frames that are obeyed, in words."""
        flag = "takes(coordinate_frame) == 'LOCAL_NED (1), BODY_NED (8)'"
        assert holds(flag, LOCAL, PX4)
        assert not holds(flag, LOCAL, ROVER)

    def test_answer_names_the_frame(self) -> None:
        """What the autopilot says, with the frame in it."""
        flag = "answer_to(coordinate_frame) == 'STATUSTEXT: SET_POSITION_TARGET_LOCAL_NED coordinate frame 7 unsupported'"
        assert holds(flag, LOCAL, PX4, coordinate_frame=7)

    def test_message_without_a_frame(self) -> None:
        """COMMAND_LONG is asked about as it is."""
        assert holds("does(frame) == 'refused'", "COMMAND_LONG", COPTER, command=192)
        assert holds("does(frame) == 'obeyed'", "COMMAND_LONG", PX4, command=192)


def test_called() -> None:
    """Families by the name that people use."""
    assert called(["px4", "ardurover", "unknown"]).tolist() == ["PX4", "ArduRover", "the autopilot"]


def test_extent() -> None:
    """Up to the last element that holds."""
    rows = [[True, False, True, False], [False] * 4, [True] * 4]
    assert extent(rows).tolist() == [3, 0, 4]
