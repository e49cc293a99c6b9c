"""Positions of a recording: found by the catalogue, typed, converted; the same wherever batches end."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink import mavutil
from pyproj import Transformer

from mavframecheck.engine import Settings
from mavframecheck.engine.conversion import Converter, Target
from mavframecheck.engine.positions import Extract, places, positions
from mavframecheck.engine.reading import Reading
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.report.positions import COLUMNS, Records
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.enums import AltRef
from mavframecheck.semantics.positions import (
    NO_TIME,
    BodyVector,
    EcefPosition,
    GeodeticPosition,
    LocalPosition,
    Origin,
)
from mavframecheck.sources import Kind
from samples.make import HERE
from tests.engine.judged import CutRecording
from tests.engine.test_cuts import traffic
from tests.strategies import DIALECT, START_US, cut, frame

CORPUS = Path(__file__).parents[3] / "shared" / "corpus"
SAMPLES = [HERE / f"{name}.tlog" for name in ("clean_px4", "clean_copter", "clean_odometry")]
PROJ = Transformer.from_crs(4979, 4978, always_xy=True)
HOME = Origin("given", 47.397742, 8.545594, 488.0, AltRef.MSL)
TARGETS = [
    Target(),
    Target(height=AltRef.ELLIPSOID),
    Target("geodetic", AltRef.MSL),
    Target("ecef"),
    Target("ned"),
    Target("enu", origin=HOME),
    Target("utm"),
]


def found(
    data: bytes,
    target: Target | None = None,
    cuts: Iterable[int] = (),
    wanted: tuple[str, ...] = (),
) -> list[list[Extract]]:
    """Return the positions of a telemetry log, one list a batch."""
    recording = CutRecording(data, cut(data, cuts), Kind.TLOG)
    converter = Converter(target or Target())
    reading = Reading(recording, Settings(), DIALECT)
    return [converter.convert(each) for each in positions(reading, wanted)]


def table(
    data: bytes,
    target: Target | None = None,
    cuts: Iterable[int] = (),
    wanted: tuple[str, ...] = (),
) -> list[dict[str, Any]]:
    """Return the records of a telemetry log."""
    rows: list[dict[str, Any]] = []
    for batch in found(data, target, cuts, wanted):
        records = Records.of("made up", batch)
        if records.size:
            columns = [records.columns[name].plain() for name in COLUMNS]
            rows += [dict(zip(COLUMNS, row)) for row in zip(*columns)]
    return rows


def log(*frames: bytes) -> bytes:
    """Return frames as a telemetry log, a second apart."""
    return b"".join(
        (START_US + 1_000_000 * number).to_bytes(8, "big") + one
        for number, one in enumerate(frames)
    )


HEARTBEAT = frame("HEARTBEAT", {"type": 2, "autopilot": 3})
ORIGIN = frame(
    "GPS_GLOBAL_ORIGIN", {"latitude": 473977420, "longitude": 85455940, "altitude": 488_000}
)
ROUND = {"lat": 473977420, "lon": 85455940}


# What is a position


def test_every_position_of_the_catalogue_is_one_here() -> None:
    """A latitude or a first axis of every message belongs to a place, or is said not to be one."""
    missing = {
        f"{tag.message}.{tag.field}"
        for tag in catalogue.find(quantity=("latitude", "position"), axis=("lat", "north", "x"))
        if tag.field not in {axis.field for place in places(tag.message) for axis in place.axes}
    }
    assert missing == set()
    assert places("ATTITUDE") == ()
    assert places("VFR_HUD") == ()


def test_one_message_can_tell_several() -> None:
    assert [(p.subject, p.is_geodetic) for p in places("HOME_POSITION")] == [
        ("", True),
        ("", False),
        ("approach", False),
    ]
    main = places("GLOBAL_POSITION_INT")[0]
    assert [tag.alt_ref for tag in main.heights] == [AltRef.MSL, AltRef.HOME]


def test_swapped_axes_of_a_command_are_put_right() -> None:
    """MAV_CMD_NAV_LAND_LOCAL has y in param 5 and x in param 6."""
    command = {"command": 23, "frame": 1, "x": 50_000, "y": 120_000, "z": -3.0}
    rows = table(log(HEARTBEAT, ORIGIN, frame("COMMAND_INT", {**command, "target_system": 1})))
    assert [rows[-1][name] for name in ("x_m", "y_m", "z_m", "frame")] == [12, 5, -3, "local_ned"]


# Against another reader


def test_global_positions_are_those_that_pymavlink_reads() -> None:
    path = HERE / "clean_px4.tlog"
    rows = table(path.read_bytes(), wanted=("GLOBAL_POSITION_INT",))

    link = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    said = []
    while (message := link.recv_match(type="GLOBAL_POSITION_INT")) is not None:
        stamp = message.time_boot_ms * 1_000_000, round(message._timestamp * 1e6) * 1000
        said.append((*stamp, message.lat / 1e7, message.lon / 1e7, message.alt / 1e3))
    link.close()

    names = ("timestamp_ns", "received_utc_ns", "latitude_deg", "longitude_deg", "height_m")
    assert [tuple(row[name] for name in names) for row in rows] == said
    assert {(r["height_reference"], r["clock"], r["datum"]) for r in rows} == {
        ("msl", "boot", "WGS84")
    }


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.stem)
def test_conversions_agree_with_proj_and_geographiclib(sample: Path) -> None:
    """To ECEF as PROJ does it, and back to where it was, within a millimetre."""
    data = sample.read_bytes()
    there = [e for batch in found(data, Target(height=AltRef.ELLIPSOID)) for e in batch]
    ecef = [e for batch in found(data, Target("ecef")) for e in batch]
    checked = 0
    for native, moved in zip(there, ecef, strict=True):
        place, converted, rows = native.position, moved.position, moved.problem == ""
        if not isinstance(place, GeodeticPosition) or not isinstance(converted, EcefPosition):
            continue
        lat, lon, height = place.lat_deg[rows], place.lon_deg[rows], place.height_m[rows]
        oracle = np.stack(PROJ.transform(lon, lat, height), axis=-1)
        np.testing.assert_allclose(converted.xyz[rows], oracle, atol=1e-3)
        back = converted.take(rows).to_geodetic()
        for a, o, a2, o2 in np.unique([lat, lon, back.lat_deg, back.lon_deg], axis=1).T[::10]:
            assert Geodesic.WGS84.Inverse(a, o, a2, o2)["s12"] < 1e-3
        np.testing.assert_allclose(back.height_m, height, atol=1e-3)
        checked += len(lat)
    assert checked > 100


def explained(data: bytes) -> tuple[int, float, float]:
    """Return pairs of local and global positions of one moment, and how far they are apart at worst.

    Horizontally as a share of what the projection allows (0.7 % of the distance from the origin) and the
    lag of ArduPilot's fields allows (0.3 m); vertically in metres.
    """
    local: dict[tuple[int, int], tuple[float, ...]] = {}
    world: dict[tuple[int, int], tuple[float, ...]] = {}
    wanted = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")
    for extract in (e for batch in found(data, wanted=wanted) for e in batch):
        known = extract.take(extract.problem == "")
        position, stamps = known.position, known.measured.time_ns
        if not len(known) or stamps is None:
            continue
        if isinstance(position, LocalPosition) and position.origin is not None:
            place = position.to_geodetic().above("msl")
            away = np.linalg.norm(position.xyz[:, :2], axis=1)
            columns = (place.lat_deg, place.lon_deg, place.height_m, away)
            kept = local
        elif isinstance(position, GeodeticPosition):
            columns = (position.lat_deg, position.lon_deg, position.height_m, position.height_m)
            kept = world
        else:
            continue
        for stamp, *row in zip(stamps.tolist(), *(column.tolist() for column in columns)):
            kept[known.sysid, stamp] = tuple(row)
    both = sorted(local.keys() & world.keys())
    mine = np.array([local[key] for key in both]).reshape(-1, 4).T
    said = np.array([world[key] for key in both]).reshape(-1, 4).T
    off = distance_m(*mine[:2], *said[:2]) / (0.007 * mine[3] + 0.3)
    return len(both), float(off.max(initial=0)), float(np.abs(mine[2] - said[2]).max(initial=0))


@pytest.mark.parametrize(
    "name", ["clean_copter_svalbard", "clean_copter_dateline", "clean_plane_guided", "clean_px4_mavsdk_mission"]
)  # fmt: skip
def test_the_origin_explains_the_global_position(name: str) -> None:
    """A local position of a real autopilot lies where its global one says, by its origin alone."""
    path = CORPUS / "sitl" / f"{name}.tlog"
    if not path.is_file():
        pytest.skip("the recordings of shared/corpus are not here")

    pairs, horizontal, vertical = explained(path.read_bytes())

    assert pairs > 200
    assert horizontal < 1
    assert vertical < 0.05


# Where batches end


@pytest.mark.parametrize("target", TARGETS, ids=str)
@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(data=traffic(), cuts=st.lists(st.integers(0, 3000), min_size=1, max_size=12))
def test_cuts_change_nothing(target: Target, data: bytes, cuts: list[int]) -> None:
    assert table(data, target, cuts) == table(data, target)


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.stem)
@settings(max_examples=4, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(cuts=st.lists(st.integers(0, 100_000), min_size=1, max_size=12))
def test_cuts_of_samples_change_nothing(sample: Path, cuts: list[int]) -> None:
    data = sample.read_bytes()
    assert table(data, Target("utm"), cuts) == table(data, Target("utm"))


# Frames, origins, times


def test_a_local_position_refers_to_the_origin_in_force() -> None:
    local = frame("LOCAL_POSITION_NED", {"x": 10.0, "z": -5.0, "time_boot_ms": 3})
    rows = table(log(HEARTBEAT, local, ORIGIN, local), wanted=("LOCAL_POSITION_NED",))

    assert [row["origin_id"] for row in rows] == [None, "1:1"]
    converted = table(log(HEARTBEAT, local, ORIGIN, local), Target("geodetic", AltRef.MSL),
                      wanted=("LOCAL_POSITION_NED",))  # fmt: skip
    assert converted[0]["problem"] == "nothing says where the origin of this local frame is"
    assert converted[1]["height_m"] == pytest.approx(493, abs=1e-3)


@pytest.mark.parametrize(
    ("number", "name", "axes", "kind"),
    [
        (1, "local_ned", "NED", LocalPosition),
        (4, "local_enu", "ENU", LocalPosition),
        (7, "local_offset_ned", "NED", LocalPosition),
        (8, "body_ned", "FRD", BodyVector),
        (12, "body_frd", "FRD", BodyVector),
        (20, "local_frd", "FRD", LocalPosition),
        (99, "frame 99", "XYZ", LocalPosition),
    ],
)
def test_the_row_chooses_the_frame(number: int, name: str, axes: str, kind: type) -> None:
    setpoint = {"coordinate_frame": number, "x": 1.0, "y": 2.0, "z": 3.0, "target_system": 1}
    data = log(HEARTBEAT, ORIGIN, frame("SET_POSITION_TARGET_LOCAL_NED", setpoint, (1, 191)))

    extract = found(data, wanted=("SET_POSITION_TARGET_LOCAL_NED",))[0][0]

    assert (extract.frame, extract.position.axes) == (name, axes)  # type: ignore[union-attr]
    assert isinstance(extract.position, kind)
    at_origin = isinstance(extract.position, LocalPosition) and extract.position.origin is not None
    assert at_origin == (number in (1, 4))


def test_masks_and_codes() -> None:
    """What a mask leaves out is no position; a part of it is said to be one."""
    field = {"coordinate_frame": 1, "x": 1.0, "y": 2.0, "z": 3.0, "target_system": 1}
    setpoints = [
        frame("SET_POSITION_TARGET_LOCAL_NED", {**field, "type_mask": mask}, (1, 191))
        for mask in (0x0FFF, 0x0004, 0)
    ]
    unplaced = frame("GLOBAL_POSITION_INT", {"time_boot_ms": 5})
    nofix = frame("GPS_RAW_INT", {**ROUND, "fix_type": 1})
    flat = frame("GPS_RAW_INT", {**ROUND, "alt": 500_000, "fix_type": 2})
    beyond = frame("GPS_RAW_INT", {"lat": 910_000_000, "lon": 1, "fix_type": 3})

    rows = table(log(HEARTBEAT, *setpoints, unplaced, nofix, flat, beyond))

    assert [(row["valid"], row["problem"]) for row in rows] == [
        (False, "the mask leaves out a part of it"),
        (True, None),
        (False, "0 N 0 E stands for no position"),
        (False, "no fix"),
        (True, None),
        (False, "latitude beyond 90 degrees"),
    ]
    assert (rows[0]["x_m"], rows[0]["z_m"]) == (1, None)
    assert rows[4]["height_m"] is None


def test_times_are_kept_apart() -> None:
    """Boot clock, UTC through SYSTEM_TIME, and receive time; an unset stamp is unknown."""
    utc_us = 1_700_000_000_000_000
    bridge = frame("SYSTEM_TIME", {"time_unix_usec": utc_us, "time_boot_ms": 10_000})
    boot = frame("GLOBAL_POSITION_INT", {**ROUND, "time_boot_ms": 12_500})
    unix = frame("GPS_RAW_INT", {**ROUND, "fix_type": 3, "time_usec": utc_us + 7})
    unset = frame("GPS_RAW_INT", {**ROUND, "fix_type": 3})

    rows = table(log(HEARTBEAT, boot, bridge, boot, unix, unset))

    assert [(row["clock"], row["timestamp_ns"], row["time_utc_ns"]) for row in rows] == [
        ("boot", 12_500_000_000, None),
        ("boot", 12_500_000_000, utc_us * 1000 + 2_500_000_000),
        ("unix", utc_us * 1000 + 7000, utc_us * 1000 + 7000),
        (None, None, None),
    ]
    assert rows[0]["received_utc_ns"] == (START_US + 1_000_000) * 1000


def test_stamps_that_cannot_be_believed_are_no_receive_time() -> None:
    one = frame("GLOBAL_POSITION_INT", ROUND)
    extract = found((2**62).to_bytes(8, "big") + one)[0][0]
    assert extract.measured.received_ns is not None
    assert extract.measured.received_ns[0] == NO_TIME


def test_covariance_and_accuracy() -> None:
    """The block of x, y, z of an upper triangle; all zeros of an extension say nothing."""
    pose = [0.0] * 21
    pose[0], pose[1], pose[6], pose[11] = 0.04, 0.01, 0.09, 0.16
    odometry = frame("ODOMETRY", {"frame_id": 1, "pose_covariance": pose, "q": [1.0, 0, 0, 0]})
    vision = frame("VISION_POSITION_ESTIMATE", {"x": 1.0}, (1, 191))
    fix = frame("GPS_RAW_INT", {**ROUND, "fix_type": 3, "h_acc": 400, "v_acc": 0})

    rows = table(log(HEARTBEAT, odometry, vision, fix))

    assert rows[0]["covariance_frame"] == "local_ned"
    expected = [0.04, 0.01, 0, 0.01, 0.09, 0, 0, 0, 0.16]
    assert rows[0]["covariance_m2"] == pytest.approx(expected, abs=1e-8)
    assert rows[1]["covariance_m2"] is None
    pose[1] = float("nan")
    partly = frame("ODOMETRY", {"frame_id": 20, "pose_covariance": pose, "q": [1.0, 0, 0, 0]})
    row = table(log(HEARTBEAT, partly))[0]
    assert (row["covariance_frame"], row["covariance_m2"][1]) == ("own", None)
    assert (rows[2]["horizontal_accuracy_m"], rows[2]["vertical_accuracy_m"]) == (0.4, None)


# Conversions


def test_heights_above_home_need_home() -> None:
    home = frame("HOME_POSITION", {"latitude": 1, "longitude": 1, "altitude": 488_000})
    field = {"coordinate_frame": 3, "lat_int": 473977420, "lon_int": 85455940, "alt": 12.0,
             "target_system": 1}  # fmt: skip
    setpoint = frame("SET_POSITION_TARGET_GLOBAL_INT", field, (1, 191))
    wanted = ("SET_POSITION_TARGET_GLOBAL_INT",)

    rows = table(log(HEARTBEAT, setpoint, home, setpoint), Target(height=AltRef.MSL), wanted=wanted)

    assert [(row["height_m"], row["valid"]) for row in rows] == [(None, False), (500, True)]
    assert [row["latitude_deg"] for row in rows] == [47.397742, 47.397742]


def test_utm_keeps_to_one_zone() -> None:
    """The first position chooses the zone; one beyond its edge is refused, not shifted."""
    east = [frame("GLOBAL_POSITION_INT", {"lat": 520_000_000, "lon": lon, "time_boot_ms": 1})
            for lon in (179_999_999, 180_000_001)]  # fmt: skip
    rows = table(log(HEARTBEAT, *east), Target("utm"))

    assert [row["zone"] for row in rows] == [33, None]
    assert rows[1]["easting_m"] is None
    assert rows[1]["problem"] == "not in UTM zone 33N: two zones do not mix"
    chosen = table(log(HEARTBEAT, *east), Target("utm", zone=(34, True)))
    assert [row["valid"] for row in chosen] == [False, True]


def test_offsets_from_a_body_stay_what_they_are() -> None:
    """Without the attitude nothing says where they lie."""
    setpoint = {"coordinate_frame": 8, "x": 5.0, "target_system": 1}
    row = table(log(HEARTBEAT, frame("SET_POSITION_TARGET_LOCAL_NED", setpoint)), Target("ecef"))[0]
    assert row["representation"] is None
    assert row["problem"].startswith("an offset in body axes needs the place and the attitude")


def test_two_vehicles_keep_their_own_origins() -> None:
    other = frame("GPS_GLOBAL_ORIGIN", {"latitude": 520_000_000, "longitude": 210_000_000}, (2, 1))
    beat = frame("HEARTBEAT", {"type": 2, "autopilot": 3}, (2, 1))
    local = [frame("LOCAL_POSITION_NED", {"x": 1.0}, (system, 1)) for system in (1, 2)]
    data = log(HEARTBEAT, beat, ORIGIN, other, *local)

    rows = table(data, Target("geodetic"), wanted=("LOCAL_POSITION_NED",))

    assert [round(row["latitude_deg"]) for row in rows] == [47, 52]
    assert [row["origin_id"] for row in table(data, wanted=("LOCAL_POSITION_NED",))] == [
        "1:1",
        "2:1",
    ]
