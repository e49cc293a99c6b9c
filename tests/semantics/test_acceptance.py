"""What each autopilot accepts: the files, their compiled form, the facts, and the recordings."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from mavframecheck.semantics import _authored, constant
from mavframecheck.semantics.acceptance import (
    COMPILED,
    Consequence,
    Fact,
    accepts,
    fact,
    families,
    frames_accepted,
    known_fact,
    numbers,
    verdicts,
)
from mavframecheck.semantics.commands import location_commands
from mavframecheck.semantics.mavframe import FRAMES, GLOBAL_FRAMES
from mavframecheck.sources import open_recording
from mavframecheck.wire import load_dialect, read_batches

ROOT = Path(__file__).parents[2]
SITL = ROOT.parent / "shared" / "corpus" / "sitl"
needs_recordings = pytest.mark.skipif(
    not SITL.is_dir(), reason="the labelled recordings are not beside this checkout"
)

LOCAL = "SET_POSITION_TARGET_LOCAL_NED"
GLOBAL = "SET_POSITION_TARGET_GLOBAL_INT"
VEHICLES = ("arducopter", "arduplane", "ardurover", "ardusub")


def cmd(name: str) -> int:
    return constant(f"MAV_CMD.{name}")


# --- the files --------------------------------------------------------------------------------------


def test_compiled_file_is_not_stale() -> None:
    assert COMPILED.read_bytes() == _authored.compiled(), "run `make generate`"


def test_every_autopilot_has_a_file() -> None:
    assert set(families()) == {"px4", "ardupilot", "generic", *VEHICLES}


def test_statements_are_about_messages_that_exist() -> None:
    known = {layout.name for layout in load_dialect().layouts.values()}
    for path in _authored.FOLDER.glob("*.toml"):
        for statement in _authored.read_file(path).statement:
            assert set(statement.message) <= known, path.name
            assert statement.message or [cmd(name) for name in statement.command]


def test_every_statement_has_a_source_and_says_something() -> None:
    for path in _authored.FOLDER.glob("*.toml"):
        for statement in _authored.read_file(path).statement:
            assert statement.source
            assert statement.accepts is not None or statement.facts or statement.note


def test_recordings_named_as_evidence_exist() -> None:
    if not SITL.is_dir():
        pytest.skip("the labelled recordings are not beside this checkout")
    named = re.compile(r"\b(?:clean|fault)_[a-z0-9_]+")
    for path in _authored.FOLDER.glob("*.toml"):
        for recording in named.findall(path.read_text("utf-8")):
            assert (SITL / f"{recording}.tlog").exists(), f"{path.name}: {recording}"


def test_words_are_explained() -> None:
    page = (ROOT / "docs" / "acceptance.md").read_text("utf-8")
    for word in (*_authored.FACTS, *(c for c in Consequence if c is not Consequence.UNKNOWN)):
        assert f"`{word}`" in page, word


@pytest.mark.parametrize(
    ("written", "complaint"),
    [
        ('message = ["ODOMETRY"]\naccepts = ["LOCAL_NDE"]', "LOCAL_NED"),
        ('message = ["ODOMETRY"]\nfacts = { colour = "red" }', "facts.colour"),
        ('message = ["ODOMETRY"]\nfacts = { quaternion = "red" }', "facts.quaternion"),
        ('message = ["ODOMETRY"]\nthen = "refused"', "then needs accepts"),
        ('message = ["ODOMETRY"]\naccepts = []\nthen = "explodes"', "then"),
        ('message = ["ODOMETRY"]\nframes = []', "frames"),
        ("note = 'x'", "neither a message nor a command"),
        ('command = ["NAV_WAYPIONT"]\nmessage = ["COMMAND_INT"]', "NAV_WAYPOINT"),
    ],
)
def test_a_mistake_in_a_file_is_named(tmp_path: Path, written: str, complaint: str) -> None:
    text = f'about = "x"\n[[statement]]\nsource = "y"\n{written}\n'
    (tmp_path / "generic.toml").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=r"generic\.toml") as caught:
        _authored.compile_files(tmp_path)
    assert complaint in str(caught.value)


# --- looking up -------------------------------------------------------------------------------------

O, M, R, I, S, U = Consequence  # noqa: E741

ACCEPTED: list[tuple[str, str, str | None, dict[Consequence, set[int]]]] = [
    # SET_POSITION_TARGET_LOCAL_NED
    ("px4", LOCAL, None, {O: {1, 8}, R: {0, 3, 7, 9, 12, 20}}),
    ("arducopter", LOCAL, None, {O: {1, 7, 8, 9}, S: {0, 2, 3, 4, 12, 14, 16, 18, 20, 21}}),
    ("arduplane", LOCAL, None, {O: {7}, I: {1, 8, 9}}),
    ("ardurover", LOCAL, None, {O: {1, 7, 8, 9}, I: {0, 12}}),
    ("ardusub", LOCAL, None, {O: {1, 7, 8, 9}, U: {12}, I: {0, 20}}),
    ("generic", LOCAL, None, {O: {1, 7, 8, 9}, U: {4, 12, 20, 21}, I: {0, 3, 13}}),
    # SET_POSITION_TARGET_GLOBAL_INT
    ("arducopter", GLOBAL, None, {O: set(GLOBAL_FRAMES), S: {1, 2, 8}}),
    ("ardurover", GLOBAL, None, {O: set(GLOBAL_FRAMES), I: {1}}),
    ("generic", GLOBAL, None, {O: set(GLOBAL_FRAMES), I: {1, 2, 8, 13}}),
    # ODOMETRY, LANDING_TARGET, OBSTACLE_DISTANCE
    ("arducopter", "ODOMETRY", None, {O: {20}, I: {0, 1, 4, 21}}),
    ("px4", "LANDING_TARGET", None, {O: {1}, I: {0, 12}}),
    ("arducopter", "LANDING_TARGET", None, {O: {12}, U: {20}, I: {0, 1}}),
    ("px4", "OBSTACLE_DISTANCE", None, {O: {0, 12}}),
    ("arducopter", "OBSTACLE_DISTANCE", None, {O: {12}, M: {0}}),
    ("arducopter", "OBSTACLE_DISTANCE_3D", None, {O: {12}, I: {0, 1}}),
    # commands
    ("px4", "COMMAND_INT", "DO_REPOSITION", {O: {0, 5}, M: {3, 6, 10, 11, 1}}),
    ("px4", "COMMAND_INT", "DO_CHANGE_SPEED", {U: {0, 3}}),
    ("arducopter", "COMMAND_INT", "DO_REPOSITION", {O: set(GLOBAL_FRAMES), R: {1, 8}}),
    ("arducopter", "COMMAND_INT", "NAV_TAKEOFF", {O: {3}, R: {0, 6, 10}}),
    ("arduplane", "COMMAND_INT", "NAV_TAKEOFF", {O: {7}, U: {3}}),
    ("arducopter", "COMMAND_LONG", "DO_REPOSITION", {R: {0}}),
    ("arducopter", "COMMAND_LONG", "NAV_TAKEOFF", {O: {0}}),
    ("px4", "COMMAND_LONG", "DO_REPOSITION", {O: {0}}),
    # missions
    ("px4", "MISSION_ITEM_INT", "NAV_WAYPOINT", {O: {0, 3, 5, 6}, R: {1, 2, 10, 11}}),
    ("px4", "MISSION_ITEM_INT", "DO_CHANGE_SPEED", {U: {2}}),
    ("arducopter", "MISSION_ITEM_INT", "NAV_WAYPOINT", {O: {2, *GLOBAL_FRAMES}, R: {1, 4, 7}}),
    ("generic", "MISSION_ITEM", "NAV_WAYPOINT", {O: set(GLOBAL_FRAMES), R: {2}, U: {1}}),
    # nobody reads it
    ("px4", "VISION_SPEED_ESTIMATE", None, {I: {0}}),
    ("arducopter", "VISION_SPEED_ESTIMATE", None, {U: {0}}),
]


@pytest.mark.parametrize(("family", "message", "command", "expected"), ACCEPTED)
def test_frames(
    family: str, message: str, command: str | None, expected: dict[Consequence, set[int]]
) -> None:
    number = cmd(command) if command else None
    for consequence, frames in expected.items():
        for frame in frames:
            verdict = accepts(family, message, frame, number)
            assert verdict.consequence is consequence, frame
            assert verdict.accepted is {U: None, O: True, M: True}.get(consequence, False)
            assert verdict.certain is (consequence is not U)


FACTS: list[tuple[str, str, str, str | None, object]] = [
    ("px4", LOCAL, "body_position", None, "ignored"),
    ("arducopter", LOCAL, "body_position", None, "offset"),
    ("ardurover", LOCAL, "body_position", None, "offset"),
    ("px4", LOCAL, "body_acceleration", None, "attitude"),
    ("arducopter", LOCAL, "body_acceleration", None, "heading"),
    ("px4", LOCAL, "partial_position", None, "per_axis"),
    ("px4", LOCAL, "partial_body_velocity", None, "group"),
    ("px4", GLOBAL, "partial_position", None, "group"),
    ("arducopter", LOCAL, "partial_position", None, "group"),
    ("arducopter", GLOBAL, "partial_velocity", None, "group"),
    ("ardurover", LOCAL, "partial_position", None, "xy_group"),
    ("arduplane", GLOBAL, "partial_position", None, "z_only"),
    ("arducopter", LOCAL, "nothing_set", None, "stops"),
    ("px4", LOCAL, "nothing_set", None, "refused"),
    ("arducopter", LOCAL, "yaw_only", None, "stops"),
    ("ardurover", LOCAL, "yaw_only", None, "obeyed"),
    ("arducopter", LOCAL, "force", None, "stops"),
    ("px4", LOCAL, "force", None, "refused"),
    ("px4", LOCAL, "nan_velocity", None, "not_set"),
    ("arducopter", LOCAL, "nan_velocity", None, "stops"),
    ("arducopter", "SET_ATTITUDE_TARGET", "throttle_ignored", None, "stops"),
    ("px4", "SET_ATTITUDE_TARGET", "throttle_ignored", None, "obeyed"),
    ("arducopter", "SET_ATTITUDE_TARGET", "partial_rates", None, "stops"),
    ("arducopter", "SET_ATTITUDE_TARGET", "quaternion_tolerance", None, 0.001),
    ("px4", "SET_ATTITUDE_TARGET", "quaternion_not_unit", None, "obeyed"),
    ("arducopter", "SET_ATTITUDE_TARGET", "thrust", None, "climb_rate"),
    ("px4", "VICON_POSITION_ESTIMATE", "read", None, "no"),
    ("arducopter", "VICON_POSITION_ESTIMATE", "read", None, None),
    ("px4", "HIL_GPS", "eph", None, "accuracy_cm"),
    ("arducopter", "HIL_GPS", "eph", None, "dop"),
    ("px4", "COMMAND_INT", "z_reference", "DO_SET_ROI_LOCATION", "msl"),
    ("px4", "NAV_TAKEOFF", "z_reference", None, "msl"),
    ("px4", "NAV_TAKEOFF", "nan_z", None, "default"),
    ("arducopter", "COMMAND_LONG", "z_reference", "NAV_TAKEOFF", "home"),
    ("arduplane", "COMMAND_LONG", "z_reference", "NAV_TAKEOFF", "vehicle"),
    ("arducopter", "COMMAND_LONG", "z_reference", "DO_SET_ROI", "home"),
    ("arducopter", "COMMAND_LONG", "z_reference", "DO_SET_HOME", "msl"),
    ("px4", "DO_REPOSITION", "yaw", None, "radians"),
    ("arducopter", "DO_REPOSITION", "null_position", None, "refused"),
    ("px4", "MISSION_ITEM_INT", "mission_frame", "NAV_WAYPOINT", "refused"),
    ("arduplane", "MISSION_ITEM_INT", "mission_frame", "NAV_WAYPOINT", "msl"),
    ("px4", "MISSION_ITEM_INT", "zero_yaw", None, "north"),
    ("arducopter", "MISSION_ITEM_INT", "zero_yaw", None, "unread"),
    ("arducopter", "MISSION_ITEM_INT", "null_position", None, "here"),
    ("arducopter", "MISSION_ITEM_INT", "home_item", None, "first"),
    ("px4", "MISSION_ITEM_INT", "home_item", None, "none"),
    ("px4", "SET_GPS_GLOBAL_ORIGIN", "origin_again", None, "moved"),
    ("ardupilot", "SET_GPS_GLOBAL_ORIGIN", "origin_again", None, "refused"),
    ("other", "SET_GPS_GLOBAL_ORIGIN", "origin_again", None, None),
]


@pytest.mark.parametrize(("family", "subject", "key", "command", "expected"), FACTS)
def test_facts(family: str, subject: str, key: str, command: str | None, expected: object) -> None:
    assert fact(family, subject, key, cmd(command) if command else None) == expected


def test_sets_of_numbers() -> None:
    assert numbers("arducopter", "ODOMETRY", "child_frames") == frozenset({12})
    assert numbers("px4", "ODOMETRY", "estimator_types") == frozenset({0, 1, 2, 3, 6})
    assert numbers("arducopter", "MISSION_ITEM_INT", "nan_params") == frozenset({1, 2, 3, 4})
    assert numbers(
        "arducopter", "MISSION_ITEM_INT", "nan_params", cmd("NAV_WAYPOINT")
    ) == frozenset({1, 2, 3})
    assert numbers("px4", "MISSION_ITEM_INT", "nan_params") == frozenset()
    assert numbers("px4", LOCAL, "mode") is None
    assert fact("px4", "ODOMETRY", "estimator_types") is None


def test_a_known_fact_says_where_it_is_from() -> None:
    found = known_fact("arducopter", LOCAL, "partial_position")
    assert found is not None
    assert found.certain
    assert "fault_copter_partial_axis" in found.source


def test_tables_hold_what_single_questions_answer() -> None:
    table = verdicts("px4", LOCAL)
    assert len(table) == len(FRAMES)
    assert all(table[f] == accepts("px4", LOCAL, f) for f in range(len(FRAMES)))
    assert frames_accepted("px4", LOCAL) == frozenset({1, 8})
    assert frames_accepted("px4", "COMMAND_INT", cmd("DO_REPOSITION")) == frozenset({0, 5})
    assert frames_accepted("px4", "ATTITUDE") is None


def test_an_undefined_frame_is_one_of_the_others() -> None:
    assert accepts("arducopter", LOCAL, 99).consequence is Consequence.STOPS
    assert accepts("generic", LOCAL, 99).accepted is None


def test_unknown_families_are_judged_by_the_protocol() -> None:
    assert accepts("other", LOCAL, 0) == accepts("generic", LOCAL, 0)
    assert accepts("ardupilot", LOCAL, 0).accepted is None


# --- versions ---------------------------------------------------------------------------------------


def version(text: str) -> float:
    return float(_authored.version_number(text))


def test_versions_sort() -> None:
    assert version("4.5.7") == 4_005_007
    assert version("1.9") < version("1.16") < version("4.6")


@pytest.mark.parametrize(
    ("at", "frame", "expected"),
    [
        ("1.11", 5, Consequence.OBEYED),
        ("1.11", 6, Consequence.MISREAD),
        ("1.12", 5, Consequence.UNKNOWN),
        ("1.13", 6, Consequence.OBEYED),
        ("1.13", 3, Consequence.REFUSED),
        ("1.16", 0, Consequence.REFUSED),
    ],
)
def test_a_known_version_is_judged_by_its_own_statement(
    at: str, frame: int, expected: Consequence
) -> None:
    assert accepts("px4", GLOBAL, frame, None, version(at)).consequence is expected


def test_an_unknown_version_is_certain_only_where_all_agree() -> None:
    agreed = accepts("px4", GLOBAL, 5, None, math.nan)
    assert (agreed.accepted, agreed.certain) == (True, True)
    newest = accepts("px4", GLOBAL, 3, None, math.nan)
    assert (newest.consequence, newest.certain) == (Consequence.REFUSED, False)
    assert frames_accepted("px4", GLOBAL) == frozenset({5})
    assert frames_accepted("px4", GLOBAL, None, version("1.16")) == frozenset({5, 6, 11})
    assert frames_accepted("arduplane", GLOBAL, None, version("4.5.7")) == frozenset({0, 5, 6, 11})
    assert frames_accepted("arduplane", GLOBAL, None, version("4.7")) == frozenset(GLOBAL_FRAMES)


def test_a_fact_that_versions_differ_in_is_not_certain() -> None:
    newest = known_fact("px4", "ODOMETRY", "child_frames")
    assert isinstance(newest, Fact)
    assert not newest.certain
    assert numbers("px4", "ODOMETRY", "child_frames") is None
    assert numbers("px4", "ODOMETRY", "child_frames", None, version("1.12")) == frozenset({12})


# --- the recordings ---------------------------------------------------------------------------------

REQUESTS = ("COMMAND_INT", "COMMAND_LONG")
ITEMS = ("MISSION_ITEM", "MISSION_ITEM_INT")
REPLIES = ("COMMAND_ACK", "MISSION_ACK", "STATUSTEXT")
SETPOINTS = (LOCAL, GLOBAL)
STACKS = {
    "PX4": "px4",
    "ArduCopter": "arducopter",
    "ArduPlane": "arduplane",
    "Rover": "ardurover",
    "ArduSub": "ardusub",
}
FRAME_FIELDS = {"COMMAND_INT": "frame", LOCAL: "coordinate_frame", GLOBAL: "coordinate_frame"}


class Row(NamedTuple):
    """One message of a recording."""

    order: int
    name: str
    fields: Any


class Recorded(NamedTuple):
    """One labelled recording."""

    name: str
    family: str
    version: float
    kind: str
    allow: tuple[str, ...]

    def rows(self, *messages: str) -> list[Row]:
        return [row for row in _rows(self.name) if row.name in messages]


@cache
def _rows(name: str) -> tuple[Row, ...]:
    wanted = (*REQUESTS, *ITEMS, *REPLIES, *SETPOINTS, "ODOMETRY", "LOCAL_POSITION_NED")
    found: list[Row] = []
    with open_recording(SITL / f"{name}.tlog") as recording:
        batches = read_batches(recording.chunks(), load_dialect(), stamped=recording.stamped)
        for batch in batches:
            for message in (m for m in wanted if m in batch.tables):
                table = batch.tables[message]
                offsets = table.frames.offset.tolist()
                found += [
                    Row(offset, message, table.columns[i])
                    for i, offset in enumerate(offsets)
                    if message != "ODOMETRY" or table.frames.compid[i] != 1
                ]
    return tuple(sorted(found, key=lambda row: row.order))


def _recordings() -> Iterator[Recorded]:
    labels = tomllib.loads((SITL / "labels.toml").read_text("utf-8"))
    for name, label in labels.items():
        stack, number, *_ = label["stack"].replace("-", " ").split()
        allow = tuple(label.get("allow", ()))
        if (SITL / f"{name}.tlog").exists():
            yield Recorded(name, STACKS[stack], version(number), label["kind"], allow)


def _recording(name: str) -> Recorded:
    return next(recording for recording in _recordings() if recording.name == name)


@needs_recordings
def test_what_was_acknowledged_is_not_said_to_be_refused() -> None:
    """A command that was accepted is one we think acceptable; an unsupported one is not."""
    judged = 0
    for recording in _recordings():
        pending: dict[int, Row] = {}
        for row in recording.rows(*REQUESTS, "COMMAND_ACK"):
            command = int(row.fields["command"])
            if row.name != "COMMAND_ACK":
                pending[command] = row
            elif (request := pending.pop(command, None)) is not None:
                verdict = _judged(recording, request, command)
                result = int(row.fields["result"])
                assert result != 0 or verdict.accepted is not False, (recording.name, command)
                assert result != 3 or not verdict.accepted, (recording.name, command)
                judged += verdict.accepted is not None
    assert judged > 90


def _judged(recording: Recorded, request: Row, command: int) -> Any:
    frame = int(request.fields["frame"]) if request.name == "COMMAND_INT" else 0
    return accepts(recording.family, request.name, frame, command, recording.version)


@needs_recordings
def test_missions_that_were_accepted_hold_no_item_said_to_be_refused() -> None:
    judged = 0
    for recording in _recordings():
        uploaded: list[Row] = []
        for row in recording.rows(*ITEMS, "MISSION_ACK"):
            if row.name != "MISSION_ACK":
                uploaded.append(row)
                continue
            refused = [item for item in uploaded if _refused(recording, item)]
            accepted = int(row.fields["type"]) == 0
            assert not refused or not accepted, recording.name
            assert accepted or refused or not uploaded, recording.name
            judged += len(uploaded)
            uploaded = []
    assert judged > 100


def _refused(recording: Recorded, item: Row) -> bool:
    command, frame = int(item.fields["command"]), int(item.fields["frame"])
    verdict = accepts(recording.family, item.name, frame, command, recording.version)
    forbidden = numbers(recording.family, item.name, "nan_params", command, recording.version)
    nan = {n for n in range(1, 5) if math.isnan(float(item.fields[f"param{n}"]))}
    return verdict.accepted is False or bool(nan & (forbidden or frozenset()))


@needs_recordings
def test_frames_of_clean_recordings_are_accepted() -> None:
    for recording in _recordings():
        if recording.kind != "clean" or "MFC101" in recording.allow:
            continue
        for row in recording.rows(*SETPOINTS):
            frame = int(row.fields["coordinate_frame"])
            verdict = accepts(recording.family, row.name, frame, None, recording.version)
            assert verdict.accepted, (recording.name, row.name, frame)
        for row in recording.rows("ODOMETRY"):
            pair = int(row.fields["frame_id"]), int(row.fields["child_frame_id"])
            assert _odometry_taken(recording, *pair), (recording.name, pair)


def _odometry_taken(recording: Recorded, frame: int, child: int) -> bool:
    children = numbers(recording.family, "ODOMETRY", "child_frames", None, recording.version)
    verdict = accepts(recording.family, "ODOMETRY", frame, None, recording.version)
    return bool(verdict.accepted) and child in (children or ())


@needs_recordings
def test_arducopter_drops_odometry_in_local_ned() -> None:
    recording = _recording("fault_copter_odometry_frame1")
    pairs = {
        (int(r.fields["frame_id"]), int(r.fields["child_frame_id"]))
        for r in recording.rows("ODOMETRY")
    }
    assert pairs == {(1, 12)}
    assert not _odometry_taken(recording, 1, 12)


@needs_recordings
@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("clean_px4_offboard_global_0_3", b"invalid coordinate", GLOBAL),
        ("fault_copter_unsupported_frames", b"Unknown mavlink coordinate frame", GLOBAL),
    ],
)
def test_frames_that_the_autopilot_complains_of_are_said_to_be_refused(
    name: str, text: bytes, message: str
) -> None:
    recording = _recording(name)
    complaints = [r for r in recording.rows("STATUSTEXT") if text in bytes(r.fields["text"])]
    frames = {int(row.fields["coordinate_frame"]) for row in recording.rows(message)}
    refused = {
        f
        for f in frames
        if accepts(recording.family, message, f).consequence in ("refused", "stops")
    }
    assert complaints
    assert refused == frames


@needs_recordings
@pytest.mark.parametrize(
    ("name", "message", "mask", "rule", "moves"),
    [
        ("fault_copter_partial_axis", LOCAL, 0x0DFC, ("partial_position", "group"), False),
        ("clean_px4_partial_axis", LOCAL, 0x0DDC, ("partial_position", "per_axis"), True),
        ("fault_copter_all_ignore_mask", LOCAL, 0x0FFF, ("nothing_set", "stops"), False),
        ("fault_px4_mask0_zeros", LOCAL, 0x0000, ("partial_position", "per_axis"), True),
    ],
)
def test_masks_do_what_the_vehicle_did(
    name: str, message: str, mask: int, rule: tuple[str, str], moves: bool
) -> None:
    recording = _recording(name)
    assert fact(recording.family, message, rule[0]) == rule[1]
    rows = recording.rows(message, "LOCAL_POSITION_NED")
    sent = [r.order for r in rows if r.name == message and r.fields["type_mask"] == mask]
    track = [
        (float(r.fields["x"]), float(r.fields["y"]))
        for r in rows
        if r.name == "LOCAL_POSITION_NED" and sent[0] <= r.order <= sent[-1]
    ]
    travelled = float(np.ptp(np.array(track), axis=0).max())
    assert (travelled > 5.0) if moves else (travelled < 2.0)


@needs_recordings
def test_frames_that_stop_a_copter_stop_it() -> None:
    recording = _recording("fault_copter_unsupported_frames")
    rows = recording.rows(*SETPOINTS, "LOCAL_POSITION_NED")
    wrong = [
        r.order for r in rows if r.name == LOCAL and int(r.fields["coordinate_frame"]) not in (1, 4)
    ]
    sent = {int(r.fields["coordinate_frame"]) for r in rows if r.name == LOCAL}
    assert all(accepts("arducopter", LOCAL, f).consequence == "stops" for f in sent - {1})
    speeds = [
        math.hypot(float(r.fields["vx"]), float(r.fields["vy"]))
        for r in rows
        if r.name == "LOCAL_POSITION_NED" and wrong[0] <= r.order <= wrong[-1]
    ]
    assert max(speeds) < 0.5


def test_location_commands_are_what_the_word_says() -> None:
    """A command without a place is not judged by the statements about places."""
    assert cmd("DO_CHANGE_SPEED") not in location_commands()
    assert accepts("arducopter", "MISSION_ITEM_INT", 1, cmd("DO_CHANGE_SPEED")).accepted is None
