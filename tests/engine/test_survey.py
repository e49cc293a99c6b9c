"""The survey: what was sent is counted and understood, however it is cut into batches."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from pymavlink import mavutil

from mavframecheck.engine import Settings
from mavframecheck.engine.survey import MOST_SPLIT, survey_file
from mavframecheck.model.survey import FieldSurvey, FileSurvey, StreamSurvey, ViewSurvey
from mavframecheck.semantics import constant
from mavframecheck.sources import recording
from mavframecheck.wire import load_dialect
from mavframecheck.wire.encode import encode_frame, encode_payload, stamped

CORPUS = Path(__file__).resolve().parents[3] / "shared" / "corpus"
START_US = 1_772_619_072_000_000
DIALECT = load_dialect()
NAN = math.nan


class Log:
    """A recording in the making."""

    def __init__(self) -> None:
        self.data = b""
        self.t_us = START_US

    def add(
        self,
        message: str,
        values: dict[str, Any] | None = None,
        *,
        sender: tuple[int, int] = (1, 1),
        every_s: float = 0.1,
        version: Any = 2,
    ) -> None:
        """Add a message, received `every_s` after the one before."""
        layout = DIALECT.by_name[message]
        payload = encode_payload(layout, values or {})
        sysid, compid = sender
        frame = encode_frame(layout, payload, sysid=sysid, compid=compid, seq=0, version=version)
        self.t_us += round(every_s * 1e6)
        self.data += stamped(frame, self.t_us)


Survey = Callable[..., FileSurvey]


@pytest.fixture
def survey(tmp_path: Path) -> Survey:
    """Return a function that surveys a log."""

    def run(log: Log, *messages: str) -> FileSurvey:
        path = tmp_path / "made.tlog"
        path.write_bytes(log.data)
        return survey_file(str(path), Settings(), messages)

    return run


def stream(found: FileSurvey, message: str, sender: int = 0) -> StreamSurvey:
    return next(each for each in found.senders[sender].streams if each.message == message)


def field(view: StreamSurvey | ViewSurvey, name: str) -> FieldSurvey:
    only = view.views[0] if isinstance(view, StreamSurvey) else view
    return next(each for each in only.fields if each.name == name)


def counts(pairs: Iterable[Any]) -> list[tuple[str, int]]:
    return [(each.reference, each.count) for each in pairs]


def test_who_speaks_and_how_often(survey: Survey) -> None:
    log = Log()
    for _ in range(20):
        log.add("HEARTBEAT", {"type": 2, "autopilot": 12}, every_s=0.5)
        log.add("HEARTBEAT", {"type": 6, "autopilot": 8}, sender=(255, 190), every_s=0.5)
    found = survey(log)
    assert [(each.role, each.autopilot, each.type) for each in found.senders] == [
        ("autopilot", "px4", "QUADROTOR"),
        ("gcs", None, None),
    ]
    heartbeat = stream(found, "HEARTBEAT")
    assert heartbeat.count == 20
    assert heartbeat.rate_hz == pytest.approx(1.0)
    assert field(heartbeat, "custom_mode").quantity is None


def test_rate_leaves_out_pauses_bursts_and_few(survey: Survey) -> None:
    log = Log()
    for number in range(100):
        log.add("ATTITUDE", every_s=600 if number == 50 else 0.1)
        log.add("PARAM_VALUE", every_s=0)
    log.add("HOME_POSITION")
    for _ in range(50):
        log.add("TERRAIN_DATA", every_s=1e-5)
    found = survey(log)
    assert stream(found, "ATTITUDE").rate_hz == pytest.approx(10, rel=0.01)
    assert stream(found, "HOME_POSITION").rate_hz is None
    assert stream(found, "TERRAIN_DATA").rate_hz is None


def test_torn_stamps_leave_the_rate_alone(survey: Survey) -> None:
    log = Log()
    for number in range(40):
        log.add("ATTITUDE")
        if number == 20:
            log.t_us += 10**18
            log.add("ATTITUDE")
            log.t_us -= 10**18
    assert stream(survey(log), "ATTITUDE").rate_hz == pytest.approx(10, rel=0.05)


def test_frames_masks_and_heights_of_what_counts(survey: Survey) -> None:
    """A frame used only where the mask ignores the position is no frame of the position."""
    log, name = Log(), "SET_POSITION_TARGET_LOCAL_NED"
    position, velocity = 0b110111111000, 0b110111000111
    for number in range(49):
        log.add(name, {"x": number, "z": -5, "type_mask": position, "coordinate_frame": 1})
    log.add(name, {"vx": 3, "x": 999, "type_mask": velocity, "coordinate_frame": 8})
    found = stream(survey(log), name)
    x, z = field(found, "x"), field(found, "z")
    assert (x.count, x.used, x.mask, x.minimum, x.maximum) == (50, 49, "type_mask", 0, 48)
    assert counts(x.frames) == [("LOCAL_NED", 49)]
    assert counts(z.heights) == [("origin", 49)]
    assert counts(field(found, "vx").frames) == [("BODY_NED", 1)]
    selector = field(found, "coordinate_frame").seen
    assert [(each.value, each.words, each.count) for each in selector] == [
        (1, "LOCAL_NED", 49),
        (8, "BODY_NED", 1),
    ]
    mask = field(found, "type_mask").seen
    assert [each.count for each in mask] == [49, 1]
    assert (mask[0].words or "").startswith("uses x, y, z; ignores vx, vy, vz")


def test_views_by_frame_and_command(survey: Survey) -> None:
    log, name = Log(), "MISSION_ITEM_INT"
    waypoint, jump = constant("MAV_CMD.NAV_WAYPOINT"), constant("MAV_CMD.DO_JUMP")
    for _ in range(3):
        log.add(name, {"command": waypoint, "frame": 3, "x": 473977420, "z": 20, "param4": NAN})
    log.add(name, {"command": waypoint, "frame": 1, "x": 25000, "z": -20})
    log.add(name, {"command": jump, "frame": 2})
    found = survey(log)
    globally, *rest = stream(found, name).views
    assert {field: each.words for field, each in globally.selectors.items()} == {
        "frame": "GLOBAL_RELATIVE_ALT",
        "command": "NAV_WAYPOINT",
    }
    x, z = field(globally, "x"), field(globally, "z")
    assert (x.quantity, x.unit) == ("latitude", "degE7")
    assert x.minimum == pytest.approx(47.397742)
    assert (z.quantity, counts(z.heights)) == ("altitude", [("home", 3)])
    yaw = field(globally, "param4")
    assert (yaw.quantity, yaw.nan, yaw.minimum) == ("heading", 3, None)
    locally = next(view for view in rest if view.selectors["frame"].value == 1)
    x = field(locally, "x")
    assert (x.quantity, x.minimum, counts(x.frames)) == ("position", 2.5, [("LOCAL_NED", 1)])
    jumping = next(view for view in rest if view.selectors["command"].value == jump)
    assert field(jumping, "x").quantity is None


def test_conditions_beside_the_selectors(survey: Survey) -> None:
    """CONDITION_YAW turns to a heading, or by an angle when param4 is 1."""
    log = Log()
    command = constant("MAV_CMD.CONDITION_YAW")
    log.add("COMMAND_LONG", {"command": command, "param1": 90, "param4": 0})
    log.add("COMMAND_LONG", {"command": command, "param1": 10, "param4": 1})
    (view,) = stream(survey(log), "COMMAND_LONG").views
    meanings = {each.when: each for each in view.fields if each.name == "param1"}
    absolute, relative = meanings[("param4 = 0",)], meanings[("param4 = 1",)]
    assert (absolute.quantity, absolute.count) == ("heading", 1)
    assert absolute.maximum == pytest.approx(math.pi / 2)
    assert (relative.quantity, counts(relative.frames)) == ("angle", [("heading_frd", 1)])


def test_selector_of_a_command_parameter(survey: Survey) -> None:
    """Param5 of this command holds gimbal flags, no MAV_FRAME."""
    log = Log()
    command = constant("MAV_CMD.DO_GIMBAL_MANAGER_PITCHYAW")
    log.add("COMMAND_LONG", {"command": command, "param1": -45, "param5": 64})
    found = survey(log)
    assert counts(field(stream(found, "COMMAND_LONG"), "param1").frames) == [("gimbal_north", 1)]


def test_shares_of_sentinels_nan_and_infinity(survey: Survey) -> None:
    log = Log()
    for number in range(10):
        log.add("GPS_RAW_INT", {"time_usec": number, "cog": 65535 if number < 3 else 9000})
        log.add("ALTITUDE", {"altitude_terrain": (NAN, -2000.0, math.inf, 7.0)[number % 4]})
    found = survey(log)
    cog = field(stream(found, "GPS_RAW_INT"), "cog")
    assert [(each.code, each.count) for each in cog.sentinels] == [("65535", 3)]
    assert cog.minimum == cog.maximum == pytest.approx(math.pi / 2)
    terrain = field(stream(found, "ALTITUDE"), "altitude_terrain")
    assert [(each.code, each.count) for each in terrain.sentinels] == [("NaN", 3), ("< -1000", 3)]
    assert (terrain.values, terrain.nan, terrain.infinite) == (10, 3, 2)
    assert (terrain.minimum, terrain.maximum) == (7, 7)


def test_sentinels_of_arrays_are_told_apart(survey: Survey) -> None:
    """NaN in the first element speaks for the matrix, NaN elsewhere for itself."""
    log = Log()
    log.add("ODOMETRY", {"pose_covariance": [NAN] + [0.0] * 20, "frame_id": 20})
    log.add("ODOMETRY", {"pose_covariance": [0.1, NAN] + [0.5] * 19, "frame_id": 20})
    pose = field(stream(survey(log), "ODOMETRY"), "pose_covariance")
    assert [(each.meaning, each.count) for each in pose.sentinels] == [
        ("matrix unknown", 21),
        ("element unknown", 1),
    ]
    assert (pose.values, pose.nan) == (42, 2)
    assert pose.minimum == pytest.approx(0.1)
    assert pose.maximum == 0.5


def test_extension_fields_that_were_given(survey: Survey) -> None:
    log = Log()
    log.add("GPS_RAW_INT", {"alt_ellipsoid": 500_000})
    log.add("GPS_RAW_INT", {"alt_ellipsoid": 500_000}, version=1)
    found = stream(survey(log), "GPS_RAW_INT")
    ellipsoid = field(found, "alt_ellipsoid")
    assert (ellipsoid.extension, ellipsoid.count, ellipsoid.present) == (True, 2, 1)
    assert counts(ellipsoid.heights) == [("ellipsoid", 1)]
    assert field(found, "lat").present == 2


def test_ambiguous_clocks_are_told_by_size(survey: Survey) -> None:
    log = Log()
    log.add("ODOMETRY", {"time_usec": 12_000_000})
    log.add("ALTITUDE", {"time_usec": START_US})
    log.add("GPS_RAW_INT", {"time_usec": 12_000_000})
    log.add("GPS_RAW_INT", {"time_usec": START_US})
    found = survey(log)
    seen = {
        name: field(stream(found, name), "time_usec").clock_seen
        for name in ("ODOMETRY", "ALTITUDE", "GPS_RAW_INT")
    }
    assert seen == {"ODOMETRY": "boot", "ALTITUDE": "unix", "GPS_RAW_INT": "mixed"}


def test_instances(survey: Survey) -> None:
    log = Log()
    for number in range(6):
        log.add("DISTANCE_SENSOR", {"id": number % 3, "current_distance": 100})
        log.add("NAMED_VALUE_FLOAT", {"name": ("wind", "\x1b[2J")[number % 2]})
    found = survey(log)
    sensors = stream(found, "DISTANCE_SENSOR")
    assert sensors.instance_field == "id"
    assert [(each.value, each.count) for each in sensors.instances] == [(0, 2), (1, 2), (2, 2)]
    names = stream(found, "NAMED_VALUE_FLOAT").instances
    assert {each.value for each in names} == {"wind", "\x1b[2J"}


def test_references_keep_the_four_notions_apart(survey: Survey) -> None:
    log = Log()
    log.add("GLOBAL_POSITION_INT")
    log.add("LOCAL_POSITION_NED")
    found = survey(log)
    notions = {each.name: each for each in found.references}
    assert (notions["wgs84"].system, notions["wgs84"].datum) == ("geodetic", "WGS 84")
    local = notions["local_ned"]
    assert (local.system, local.datum) == ("cartesian", "none")
    assert "estimator" in local.origin
    assert "sphere" in local.projection
    assert [each.name for each in found.heights] == ["home", "msl", "origin"]


def test_only_the_messages_asked_for(survey: Survey) -> None:
    log = Log()
    log.add("ATTITUDE")
    log.add("ALTITUDE")
    (sender,) = survey(log, "ALTITUDE").senders
    assert [each.message for each in sender.streams] == ["ALTITUDE"]
    assert sender.messages == 2


def test_hostile_variety_is_bounded(survey: Survey) -> None:
    log = Log()
    for sender in range(MOST_SPLIT + 5):
        for command in range(40):
            log.add("COMMAND_LONG", {"command": command}, sender=(sender + 1, 1))
    for value in range(100):
        log.add("ATTITUDE_TARGET", {"type_mask": value})
    found = survey(log)
    streams = [each for one in found.senders for each in one.streams]
    split = [each for each in streams if each.message == "COMMAND_LONG"]
    assert [len(each.views) for each in split] == [32] * MOST_SPLIT + [0] * 5
    assert all(sum(v.count for v in each.views) + each.views_others == 40 for each in split)
    mask = field(stream(found, "ATTITUDE_TARGET"), "type_mask")
    assert (len(mask.seen), mask.seen_others) == (32, 68)


@pytest.mark.parametrize("size", [100, 1_000, 7_777])
def test_cut_into_batches_makes_no_difference(
    survey: Survey, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    log = Log()
    for number in range(300):
        sender = (1 + number % 3, 1)
        log.add("ATTITUDE_TARGET", {"type_mask": number % 50, "q": [number, NAN, 0, 1]})
        log.add("COMMAND_LONG", {"command": number % 40, "param1": number}, sender=sender)
        log.add("GPS_RAW_INT", {"cog": number * 219, "lat": number}, sender=sender, every_s=0.03)
        log.add("NAMED_VALUE_FLOAT", {"name": f"n{number % 40}", "value": NAN}, sender=sender)
    whole = survey(log)
    monkeypatch.setattr(recording, "BATCH_BYTES", size)
    assert msgspec.json.encode(survey(log)) == msgspec.json.encode(whole)


def oracle(path: Path) -> Counter[tuple[int, int, str]]:
    """Count messages by pymavlink."""
    log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    found: Counter[tuple[int, int, str]] = Counter()
    while (message := log.recv_match()) is not None:
        if not message.get_type().startswith(("BAD_DATA", "UNKNOWN")):
            found[message.get_srcSystem(), message.get_srcComponent(), message.get_type()] += 1
    log.close()
    return found


def counted(found: FileSurvey) -> Counter[tuple[int, int, str]]:
    return Counter(
        {(s.sysid, s.compid, m.message): m.count for s in found.senders for m in s.streams}
    )


def test_counts_are_those_of_pymavlink(survey: Survey, tmp_path: Path) -> None:
    log = Log()
    for number in range(50):
        log.add("ATTITUDE", {"roll": 0.1}, sender=(1 + number % 2, 1))
        log.add("HEARTBEAT", {"type": 2, "autopilot": 3}, version=1 + number % 2)
    found = survey(log)
    assert counted(found) == oracle(tmp_path / "made.tlog")


@pytest.mark.parametrize(
    "name",
    [
        "sitl/clean_px4_mission_rtl.tlog",
        "sitl/clean_copter_guided_local.tlog",
        "sitl/clean_two_copters.tlog",
        "real/tlog/*__test.tlog",
    ],
)
def test_real_recordings(name: str) -> None:
    """No count is below pymavlink's, which loses frames after damage; every range is one."""
    path = next(CORPUS.glob(name), None)
    if path is None:
        pytest.skip(
            "the recordings are not here: they live beside the checkout, in ../shared/corpus"
        )
    found = survey_file(str(path), Settings())
    theirs, ours = oracle(path), counted(found)
    assert {key: count for key, count in theirs.items() if ours[key] < count} == {}
    for sender in found.senders:
        for each in sender.streams:
            views = sum(view.count for view in each.views)
            assert views + each.views_others == each.count
            for one in (f for view in each.views for f in view.fields):
                assert one.used <= one.present <= one.count
                assert sum(code.count for code in one.sentinels) <= one.values
                if one.minimum is not None and one.maximum is not None:
                    assert one.minimum <= one.maximum
