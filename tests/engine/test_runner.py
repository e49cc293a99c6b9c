"""Rules over rows: who is judged, context that comes late or never, and how each rule ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mavframecheck.model import Finding, Rule, Severity
from mavframecheck.sources import Kind
from mavframecheck.vehicle.history import LATE_FRAMES
from tests.engine.judged import Result, judge, pack_of, rule, run_of, shipped
from tests.strategies import START_US, frame

COPTER = {"type": 2, "autopilot": 3}
PX4 = {"type": 2, "autopilot": 12}
HOME = {"latitude": 473977420, "longitude": 85455940, "altitude": 488_000}
SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
VEHICLE, COMPANION, GCS = (1, 1), (1, 191), (255, 190)

Said = tuple[float, str, dict[str, Any], tuple[int, int]]


def tlog(*said: Said) -> bytes:
    """Return messages as a recording; times in seconds from its start."""
    return b"".join(
        (START_US + round(t * 1e6)).to_bytes(8, "big") + frame(name, fields, sender, k)
        for k, (t, name, fields, sender) in enumerate(said)
    )


def judged(one: Rule, *said: Said, **settings: Any) -> Result:
    """Judge messages by one rule."""
    return judge(tlog(*said), pack=pack_of(one), **settings)


def ended(one: Rule, *said: Said, **settings: Any) -> tuple[str, int]:
    """Return how the rule ended and how many rows it looked at."""
    run = run_of(judged(one, *said, **settings), "MFC999")
    return run.status, run.checked


TILTED: Said = (0.0, "ATTITUDE", {"roll": 2.0}, VEHICLE)
LEVEL: Said = (1.0, "ATTITUDE", {"roll": 0.0}, VEHICLE)


def test_a_finding() -> None:
    """Words, place and time of the first hit."""
    report, (found,) = judged(rule(), TILTED, LEVEL)
    assert (found.code, found.text, found.fix) == ("MFC999", "roll is 2.0", "Do not.")
    assert (found.sysid, found.compid, found.message_name, found.field) == (1, 1, "ATTITUDE", None)
    assert found.time_first == START_US * 1e-6
    assert run_of((report, (found,)), "MFC999").checked == 2


class TestStatus:
    """A verdict has three values: silence must not read as a pass (DESIGN law 6)."""

    def test_ran(self) -> None:
        assert ended(rule(), LEVEL) == ("ran", 1)

    def test_not_applicable(self) -> None:
        result = judged(rule(), (0.0, "HEARTBEAT", COPTER, VEHICLE))
        run = run_of(result, "MFC999")
        assert (run.status, run.reason) == (
            "not-applicable",
            "no ATTITUDE that the rule is about",
        )

    def test_nothing_that_when_lets_through(self) -> None:
        one = rule(detect={"when": "raw(yaw) > 0"})
        assert ended(one, LEVEL) == ("not-applicable", 0)

    def test_insufficient_data(self) -> None:
        """It was about these rows, and what it needed never came."""
        one = rule(detect={"flag": "raw(roll) > home.alt_msl"})
        run = run_of(judged(one, TILTED, LEVEL), "MFC999")
        assert (run.status, run.checked) == ("insufficient-data", 0)
        assert "HOME_POSITION" in run.reason

    def test_some_rows_not_judged(self) -> None:
        """It ran, and says what it left out."""
        one = rule(
            applies={"message": [SETPOINT], "from": ["!autopilot"]},
            detect={"flag": "raw(x) > home.alt_msl"},
            explain={"text": "x"},
        )
        said: list[Said] = [
            (0.0, "HEARTBEAT", COPTER, VEHICLE),
            (0.1, "HOME_POSITION", HOME, VEHICLE),
            (0.2, SETPOINT, {"target_system": 1}, COMPANION),
            (0.3, SETPOINT, {"target_system": 9}, COMPANION),
        ]
        run = run_of(judged(one, *said), "MFC999")
        assert (run.status, run.checked) == ("ran", 1)
        assert run.reason.startswith("1 rows not judged: ")

    def test_every_rule_has_exactly_one_verdict(self) -> None:
        report, _ = judge(tlog(TILTED))
        assert [run.code for run in report.runs] == [each.code for each in shipped().rules]


class TestLateContext:
    """What comes after the row it decides about."""

    ABOVE = rule(detect={"flag": "raw(roll) * 1000 > home.alt_msl"})
    HEARD: Said = (0.0, "HEARTBEAT", COPTER, VEHICLE)

    def test_late(self) -> None:
        said = (self.HEARD, TILTED, (30.0, "HOME_POSITION", HOME, VEHICLE))
        assert len(judged(self.ABOVE, *said)[1]) == 1

    def test_too_late(self) -> None:
        said = (self.HEARD, TILTED, (61.0, "HOME_POSITION", HOME, VEHICLE))
        assert ended(self.ABOVE, *said) == ("insufficient-data", 0)

    @pytest.mark.parametrize(
        ("between", "status"), [(LATE_FRAMES - 1, "ran"), (LATE_FRAMES, "insufficient-data")]
    )
    def test_too_many_frames_later(self, between: int, status: str) -> None:
        """The bound for recordings without stamps."""
        filler = frame("SYSTEM_TIME", {}) * between
        data = b"".join(
            frame(name, fields, sender) for _, name, fields, sender in (self.HEARD, TILTED)
        )
        data += filler + frame("HOME_POSITION", HOME)
        assert (
            run_of(judge(data, [100], pack_of(self.ABOVE), kind=Kind.RAW), "MFC999").status
            == status
        )
        cuts = list(range(0, len(data), 50_000))
        assert (
            run_of(judge(data, cuts, pack_of(self.ABOVE), kind=Kind.RAW), "MFC999").status == status
        )

    def test_the_queue_is_bounded(self) -> None:
        """Rows that wait for what never comes are let go."""
        data = frame("HEARTBEAT", COPTER) + frame("ATTITUDE", {"roll": 2.0}) * (3 * LATE_FRAMES)
        result = judge(data, list(range(0, len(data), 100_000)), pack_of(self.ABOVE), kind=Kind.RAW)
        run = run_of(result, "MFC999")
        assert (run.status, run.checked) == ("insufficient-data", 0)

    def test_words_wait_too(self) -> None:
        """A rule that only speaks of context is judged without it in the end, not never."""
        one = rule(explain={"text": "on {vehicle.autopilot}"})
        assert judged(one, TILTED)[1][0].text == "on unknown"
        late = (TILTED, (5.0, "HEARTBEAT", PX4, VEHICLE))
        assert judged(one, *late)[1][0].text == "on px4"


class TestWhom:
    """Rules say who must have sent, and to whom."""

    def told(
        self, one: Rule, sender: tuple[int, int] = COMPANION, **settings: Any
    ) -> tuple[str, int]:
        said: list[Said] = [
            (0.0, "HEARTBEAT", COPTER, VEHICLE),
            (0.1, SETPOINT, {"target_system": 1}, sender),
        ]
        return ended(one, *said, **settings)

    def about(self, **applies: Any) -> Rule:
        """Return a rule on setpoints."""
        return rule(
            applies={"message": [SETPOINT], **applies},
            detect={"flag": "raw(x) > 1"},
            explain={"text": "x"},
        )

    def test_senders(self) -> None:
        assert self.told(self.about(**{"from": ["companion"]})) == ("ran", 1)
        assert self.told(self.about(**{"from": ["companion"]}), GCS)[0] == "not-applicable"
        assert self.told(self.about(**{"from": ["!autopilot"]}), VEHICLE)[0] == "not-applicable"

    def test_autopilots(self) -> None:
        assert self.told(self.about(autopilot=["arducopter"])) == ("ran", 1)
        assert self.told(self.about(autopilot=["px4"]))[0] == "not-applicable"
        assert self.told(self.about(autopilot=["!px4"])) == ("ran", 1)

    def test_an_assumed_autopilot(self) -> None:
        """--autopilot fills in where the recording does not say, and does not overrule it."""
        one = self.about(autopilot=["px4"])
        setpoint: Said = (0.0, SETPOINT, {"target_system": 1}, COMPANION)
        assert ended(one, setpoint)[0] == "insufficient-data"
        assert ended(one, setpoint, autopilot="px4") == ("ran", 1)
        assert ended(one, setpoint, autopilot="arducopter")[0] == "not-applicable"
        assert self.told(one, autopilot="px4")[0] == "not-applicable"

    def test_frames(self) -> None:
        said = [
            (0.0, SETPOINT, {"coordinate_frame": f, "target_system": 1}, COMPANION)
            for f in (1, 8, 9)
        ]
        assert ended(self.about(frame=["LOCAL_NED"]), *said) == ("ran", 1)
        assert ended(self.about(frame=["body"]), *said)[1] == 2

    def test_commands(self) -> None:
        one = rule(
            applies={"message": ["COMMAND_LONG"], "command": ["NAV_TAKEOFF"]},
            detect={"flag": "raw(param7) > 1"},
            explain={"text": "x"},
        )
        said = [
            (0.0, "COMMAND_LONG", {"command": c, "target_system": 1}, GCS) for c in (22, 16, 22)
        ]
        assert ended(one, *said) == ("ran", 2)


class TestSeverity:
    """The first condition that holds on the first hit wins."""

    ONE = rule(
        severity_when=[
            {"if": "vehicle.autopilot == 'px4'", "severity": "info"},
            {"if": "raw(roll) > 1.5", "severity": "warning"},
        ]
    )

    @pytest.mark.parametrize(
        ("heartbeat", "roll", "severity"),
        [
            (PX4, 2.0, Severity.INFO),
            (COPTER, 2.0, Severity.WARNING),
            (COPTER, 1.2, Severity.ERROR),
        ],
    )
    def test_severity_when(
        self, heartbeat: dict[str, int], roll: float, severity: Severity
    ) -> None:
        said: list[Said] = [
            (0.0, "HEARTBEAT", heartbeat, VEHICLE),
            (0.1, "ATTITUDE", {"roll": roll}, VEHICLE),
        ]
        (found,) = judged(self.ONE, *said)[1]
        assert found.severity is severity


def test_parameters_can_be_set() -> None:
    one = rule(detect={"flag": "raw(roll) > most_rad"}, params={"most_rad": 1.0})
    assert len(judged(one, TILTED)[1]) == 1
    assert not judged(one, TILTED, overrides={"MFC999": {"most_rad": 3.0}})[1]


def test_named_expressions_use_those_before_them() -> None:
    one = rule(let={"twice": "raw(roll) * 2", "more": "twice + 1"}, detect={"flag": "more > 4.5"})
    assert len(judged(one, TILTED, LEVEL)[1]) == 1


class TestReport:
    """One finding per message, field or group."""

    def found(self, report: str) -> list[Finding]:
        one = rule(
            applies={"message": [], "tag": {"ignore_field": "!"}, "report": report},
            detect={"flag": "used(value) and any_nan(value)"},
            explain={"text": "{field}"},
        )
        nan = float("nan")
        fields = {"x": nan, "y": nan, "vx": nan, "type_mask": 0, "target_system": 1}
        return list(judged(one, (0.0, SETPOINT, fields, COMPANION))[1])

    def test_per_field(self) -> None:
        assert [f.field for f in self.found("field")] == ["vx", "x", "y"]

    def test_per_group(self) -> None:
        assert len(self.found("group")) == 2

    def test_per_message(self) -> None:
        assert len(self.found("message")) == 1


def test_a_truncated_field_is_judged_like_any_other() -> None:
    """Frame 0 is always cut off: it is zero, not absent (DESIGN law 7)."""
    one = rule(
        applies={"message": [SETPOINT, "SET_POSITION_TARGET_GLOBAL_INT"]},
        detect={"flag": "raw(coordinate_frame) == MAV_FRAME.GLOBAL"},
        explain={"text": "{words(coordinate_frame)}"},
    )
    cut_off: list[Said] = [
        (0.0, SETPOINT, {"x": 5.0, "type_mask": 0x0DF8}, COMPANION),
        (0.1, "SET_POSITION_TARGET_GLOBAL_INT", {"lat_int": 5, "type_mask": 0x0DF8}, COMPANION),
    ]
    given: list[Said] = [
        (t, name, fields | {"coordinate_frame": 1, "target_component": 1}, sender)
        for t, name, fields, sender in cut_off
    ]
    assert len(judged(one, *cut_off)[1]) == 2
    assert len(judged(one, *given)[1]) == 0
    (local, _) = judged(one, *cut_off)[1]
    assert local.text == "0 (GLOBAL)"
    assert "MFC102" in {f.code for f in judge(tlog(*cut_off))[1]}


def test_a_rule_that_names_a_field_that_is_not_there() -> None:
    """A mistake of the rule, said in words and not as a crash."""
    from mavframecheck.engine import RuleFileError

    one = rule(detect={"flag": "raw(rol) > 1"})
    with pytest.raises(RuleFileError, match="ATTITUDE has no field called 'rol'"):
        judged(one, TILTED)


def test_nothing_in_the_recording() -> None:
    report, findings = judge(b"", pack=shipped())
    assert (report.messages, findings) == (0, ())
    assert {run.status for run in report.runs} <= {"not-applicable", "insufficient-data"}
    assert np.isscalar(report.skipped_bytes)
