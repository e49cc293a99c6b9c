"""Write the samples: small recordings and missions, each with one fault, the same bytes in every run.

``make samples`` writes them beside this file, with a README.md that says what is wrong in each.
"""

from __future__ import annotations

import io
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dpkt
from pymavlink.dialects.v20 import ardupilotmega as dialect

from samples import flight, missions
from samples.flight import COMPANION, GCS, PX4, SETPOINT, START_US, VISION, Fields, Flight, Said

HERE = Path(__file__).parent
FAULTY_S = (20.0, 23.0)
"""When the fault of a sample shows, s from its start, where it does not show throughout."""
ALWAYS = (0.0, math.inf)
FROZEN_S = (24.0, 36.0)
MOVING = 2
"""Sides of the square that show which way axes point."""
GLOBAL_SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"
MESSAGES = {message.msgname: message for message in dialect.mavlink_map.values()}


Records = list[tuple[int, bytes]]
"""Receive time, us since 1970, and a frame."""
Traffic = list[Said]
Change = Callable[[Fields], Fields]


@dataclass(frozen=True)
class Sample:
    """A file, what is wrong in it, and the codes that say so."""

    name: str
    codes: tuple[str, ...]
    wrong: str
    content: Callable[[], bytes]


# From messages to bytes


def pack(traffic: Traffic) -> Records:
    """Return the frames of all messages, each sender counting its own."""
    links: dict[tuple[int, int], dialect.MAVLink] = {}
    records = []
    for t, sender, name, fields in traffic:
        link = links.setdefault(sender, dialect.MAVLink(None, *sender))
        steady = {key: rounded(value) for key, value in fields.items()}
        frame = bytes(MESSAGES[name](**steady).pack(link))
        link.seq = (link.seq + 1) % 256
        records.append((START_US + round(t * 1e6), frame))
    return records


def rounded(value: Any) -> Any:
    """Return numbers to six decimals: the last bits of a sine differ between machines."""
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return round(value, 6) if isinstance(value, float) else value


def tlog(records: Records) -> bytes:
    """Return a telemetry log: each frame after its stamp."""
    return b"".join(struct.pack(">Q", t) + frame for t, frame in records)


def raw(records: Records) -> bytes:
    """Return the frames as a serial port would carry them."""
    return b"".join(frame for _, frame in records)


def pcap(records: Records) -> bytes:
    """Return a capture of the frames, each in a UDP packet."""
    file = io.BytesIO()
    writer = dpkt.pcap.Writer(file)
    for t, frame in records:
        writer.writepkt(bytes(packet(frame)), ts=t / 1e6)
    return file.getvalue()


def packet(frame: bytes) -> dpkt.ethernet.Ethernet:
    """Return a frame in UDP, between the vehicle and a ground station."""
    vehicle, ground = (bytes((10, 0, 0, 1)), 14555), (bytes((10, 0, 0, 2)), 14550)
    (src, sport), (dst, dport) = (ground, vehicle) if frame[5] == GCS[0] else (vehicle, ground)
    udp = dpkt.udp.UDP(sport=sport, dport=dport, data=frame)
    udp.ulen = len(udp)
    ip = dpkt.ip.IP(src=src, dst=dst, p=dpkt.ip.IP_PROTO_UDP, data=udp)
    ip.len = len(ip)
    return dpkt.ethernet.Ethernet(src=bytes(5) + b"\1", dst=bytes(5) + b"\2", data=ip)


# Faults in messages


def changed(traffic: Traffic, message: str, change: Change, during: tuple[float, float]) -> Traffic:
    """Return the traffic with the fields of one message changed for a time."""
    return [
        one._replace(fields=one.fields | change(one.fields))
        if one.message == message and during[0] <= one.t < during[1]
        else one
        for one in traffic
    ]


def faulty_field(message: str, change: Change, *, always: bool = False) -> Callable[[], bytes]:
    """Return a maker of a log in which some fields of one message are wrong."""
    during = ALWAYS if always else FAULTY_S
    known = Flight(odometry=message == "ODOMETRY")
    return lambda: tlog(pack(changed(known.traffic(), message, change, during)))


def values(**fields: object) -> Change:
    """Return a change to these values, whatever was there."""
    return lambda _: fields


def stretched_quaternion(fields: Fields) -> Fields:
    """Return the quaternion with a length of 0.9."""
    return {"q": [0.9 * part for part in fields["q"]]}


def moving(
    message: str, change: Change, during: tuple[float, float] = ALWAYS
) -> Callable[[], bytes]:
    """Return a maker of a longer flight in which an estimate of the pose is wrong."""
    known = Flight(sides=MOVING, odometry=message == "ODOMETRY", vision=message == VISION)
    return lambda: tlog(pack(changed(known.traffic(), message, change, during)))


def east_north_up(fields: Fields) -> Fields:
    """Return the pose in east-north-up, with front-left-up axes of the body."""
    place = {"x": fields["y"], "y": fields["x"], "z": -fields["z"]}
    return place | {"pitch": -fields["pitch"], "yaw": math.pi / 2 - fields["yaw"]}


def turned(degrees: float) -> Change:
    """Return a change to a frame whose x points so far clockwise from north."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def change(f: Fields) -> Fields:
        yaw = math.remainder(f["yaw"] - math.radians(degrees), math.tau)
        return {"x": c * f["x"] + s * f["y"], "y": c * f["y"] - s * f["x"], "yaw": yaw}

    return change


def scaled(factor: float) -> Change:
    """Return a change to positions that are too long."""
    return lambda f: {name: factor * f[name] for name in ("x", "y", "z")}


def world_velocity(fields: Fields) -> Fields:
    """Return the velocity turned out of the axes of the body."""
    w, x, y, z = fields["q"]
    vx, vy, vz = fields["vx"], fields["vy"], fields["vz"]
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    north = vx + w * tx + y * tz - z * ty
    east = vy + w * ty + z * tx - x * tz
    return {"vx": north, "vy": east, "vz": vz + w * tz + x * ty - y * tx}


def faulty_global(**fields: object) -> Callable[[], bytes]:
    """Return a maker of a log with global setpoints, of which some are wrong."""
    return lambda: tlog(
        pack(changed(with_global_setpoints(Flight()), GLOBAL_SETPOINT, values(**fields), FAULTY_S))
    )


def with_global_setpoints(known: Flight) -> Traffic:
    """Return the traffic with the companion's local setpoints given on the globe instead."""
    return [
        one._replace(message=GLOBAL_SETPOINT, fields=on_globe(known, one.fields))
        if one.message == SETPOINT
        else one
        for one in known.traffic()
    ]


def on_globe(known: Flight, local: Fields) -> Fields:
    """Return the fields of a global setpoint, relative to home, for those of a local one."""
    lat, lon = known.globe(local["x"], local["y"])
    place = {"lat_int": round(lat * 1e7), "lon_int": round(lon * 1e7), "alt": -local["z"]}
    kept = {k: v for k, v in local.items() if k not in ("x", "y", "z")}
    return kept | place | {"coordinate_frame": 3}


def faulty_command(message: str, command: int, **fields: object) -> Callable[[], bytes]:
    """Return a maker of a log with one wrong command, which the vehicle denies."""
    asked = flight.to_vehicle() | {"command": command} | fields
    said = [Said(21.0, GCS, message, asked), flight.answer(21.0, command, 2)]

    def content() -> bytes:
        return tlog(pack(sorted(Flight().traffic() + said, key=lambda one: one.t)))

    return content


def float_command(command: int, lat: float, lon: float, alt: float) -> Callable[[], bytes]:
    """Return a maker of a log with a location in a COMMAND_LONG."""
    params = dict.fromkeys(("param1", "param2", "param3", "param4"), 0.0)
    params |= {"param5": lat, "param6": lon, "param7": alt}
    return faulty_command("COMMAND_LONG", command, confirmation=0, **params)


# Faults in bytes


def damaged_link() -> bytes:
    """Return a log with flipped bytes, lost frames, foreign ids, junk and a torn end."""
    pieces = []
    for i, (t, frame) in enumerate(pack(Flight().traffic())):
        if i % 90 == 60:
            continue
        flipped = frame[:12] + bytes((frame[12] ^ 0x55,)) + frame[13:]
        pieces.append(tlog([(t, flipped if i % 90 == 30 else frame)]))
        if i % 200 == 100:
            pieces.append(b"\r\nlink lost, reconnecting\r\n")
        if i % 120 == 110:
            pieces.append(tlog([(t, unknown_message(i))]))
    return b"".join(pieces)[:-7]


def unknown_message(seq: int) -> bytes:
    """Return a well-made frame whose id no dialect has."""
    body = struct.pack("<5B", 8, 0, 0, seq % 256, COMPANION[0] + 41) + bytes((COMPANION[1],))
    body += (60001).to_bytes(3, "little") + b"vendor#7"
    return b"\xfd" + body + struct.pack("<H", dialect.x25crc(body + b"\x2a").crc)


def merged_links() -> bytes:
    """Return a log into which a second radio wrote everything again, 30 ms later."""
    records = pack(Flight().traffic())
    again = [(t + 30_000, frame) for t, frame in records]
    return tlog(sorted(records + again, key=lambda record: record[0]))


def clean(form: Callable[[Records], bytes], known: Flight) -> Callable[[], bytes]:
    """Return a maker of a recording without a fault."""
    return lambda: form(pack(known.traffic()))


CROOKED = [-1.0, *flight.diagonal(0.01, 0.001)[1:]]
SAMPLES = (
    Sample("clean_copter.tlog", (), "Nothing: ArduCopter.", clean(tlog, Flight(sides=4))),
    Sample("clean_px4.tlog", (), "Nothing: PX4.", clean(tlog, Flight(PX4))),
    Sample("clean_odometry.tlog", (), "Nothing: visual odometry.", clean(tlog, Flight(odometry=True))),
    Sample(
        "clean_vision.tlog", (), "Nothing: a camera.", clean(tlog, Flight(sides=MOVING, vision=True))
    ),
    Sample("clean_link.raw", (), "Nothing: frames without stamps.", clean(raw, Flight())),
    Sample("clean_link.pcap", (), "Nothing: captured from a network.", clean(pcap, Flight())),
    Sample(
        "damaged_link.tlog",
        ("MFC001", "MFC002", "MFC003", "MFC004"),
        "Bytes flipped, text between frames, frames lost, a message no dialect has, a torn end.",
        damaged_link,
    ),
    Sample("merged_links.tlog", ("MFC005",), "Everything twice: two radios, one log.", merged_links),
    Sample(
        "foreign_frame_setpoint.tlog",
        ("MFC102",),
        "A global frame (3) in a local setpoint.",
        faulty_field(SETPOINT, values(coordinate_frame=3)),
    ),
    Sample(
        "force_bit_setpoint.tlog",
        ("MFC108",),
        "Acceleration in use and marked as force.",
        faulty_field(SETPOINT, values(type_mask=0x0E3F, afx=0.2)),
    ),
    Sample(
        "superseded_frame_setpoint.tlog",
        ("MFC111",),
        "Frame 6, the old spelling of 3: worth knowing, no fault.",
        faulty_global(coordinate_frame=6),
    ),
    Sample(
        "reserved_frame_odometry.tlog",
        ("MFC112",),
        "Odometry in frame 16, once VISION_NED, reserved for years.",
        faulty_field("ODOMETRY", values(frame_id=16)),
    ),
    Sample(
        "undefined_mask_bit.tlog",
        ("MFC113",),
        "Bit 12 of the type mask, which nothing defines.",
        faulty_field(SETPOINT, values(type_mask=0x1DF8)),
    ),
    Sample(
        "float_location_command.tlog",
        ("MFC118", "MFC301"),
        "A region of interest as float32 degrees: up to a metre is lost.",
        float_command(195, 47.397842, 8.545694, 10.0),
    ),
    Sample(
        "degrees_in_scaled_field.tlog",
        ("MFC302",),
        "Whole degrees (47, 8) where degrees times 1e7 belong.",
        faulty_global(lat_int=47, lon_int=8),
    ),
    Sample(
        "scaled_degrees_in_float_field.tlog",
        ("MFC118", "MFC303"),
        "Degrees times 1e7 where plain degrees belong.",
        float_command(179, 473978420.0, 85456940.0, 488.0),
    ),
    Sample(
        "degrees_out_of_range.tlog",
        ("MFC304",),
        "Degrees scaled twice: both fields saturate.",
        faulty_global(lat_int=2**31 - 1, lon_int=2**31 - 1),
    ),
    Sample(
        "swapped_coordinates.tlog",
        ("MFC305",),
        "Longitude first, latitude second.",
        faulty_global(lat_int=85455940, lon_int=473977420),
    ),
    Sample(
        "relative_height_in_absolute_frame.tlog",
        ("MFC201",),
        "A height above home (12 m) in a frame that counts from mean sea level (home: 488 m).",
        faulty_global(coordinate_frame=0, alt=12.0),
    ),
    Sample(
        "absolute_height_in_relative_frame.tlog",
        ("MFC202",),
        "A height above mean sea level in a frame that counts from home.",
        faulty_global(coordinate_frame=3, alt=500.0),
    ),
    Sample(
        "inverted_type_mask.tlog",
        ("MFC105",),
        "The mask marks what is given as ignored, and what is not as used.",
        faulty_field(SETPOINT, values(type_mask=0x0007)),
    ),
    Sample(
        "metres_not_scaled.tlog",
        ("MFC307",),
        "A local target 20 m north, 15 m east, not multiplied by 1e4.",
        faulty_command(
            "COMMAND_INT", 192, frame=1, x=20, y=15, z=-10.0, current=0, autocontinue=0,
            param1=-1.0, param2=1.0, param3=0.0, param4=math.nan,
        ),
    ),
    Sample(
        "quaternion_not_unit.tlog",
        ("MFC408",),
        "Odometry with a quaternion of length 0.9.",
        faulty_field("ODOMETRY", stretched_quaternion),
    ),
    Sample(
        "zero_covariance.tlog",
        ("MFC501",),
        "Odometry that claims to be perfect: every covariance zero.",
        faulty_field("ODOMETRY", values(pose_covariance=[0.0] * 21, velocity_covariance=[0.0] * 21)),
    ),
    Sample(
        "bad_covariance.tlog",
        ("MFC502",),
        "Variance of x is -1, another system's word for unknown.",
        faulty_field("ODOMETRY", values(pose_covariance=CROOKED)),
    ),
    Sample(
        "vision_in_enu.tlog",
        ("MFC401",),
        "A camera's pose in east-north-up, as robots have it.",
        moving(VISION, east_north_up),
    ),
    Sample(
        "vision_height_up.tlog",
        ("MFC402",),
        "A camera's position whose z is a height.",
        moving(VISION, lambda f: {"z": -f["z"]}),
    ),
    Sample(
        "vision_yaw_reversed.tlog",
        ("MFC404",),
        "A camera's yaw that counts counter-clockwise.",
        moving(VISION, lambda f: {"yaw": -f["yaw"]}),
    ),
    Sample(
        "odometry_velocity_of_the_world.tlog",
        ("MFC407",),
        "Odometry whose velocity is north-east-down and labelled forward-right-down.",
        moving("ODOMETRY", world_velocity),
    ),
    Sample(
        "odometry_quaternion_order.tlog",
        ("MFC409",),
        "Odometry with a quaternion x, y, z, w.",
        moving("ODOMETRY", lambda f: {"q": [*f["q"][1:], f["q"][0]]}),
    ),
    Sample(
        "odometry_quaternion_inverse.tlog",
        ("MFC421",),
        "Odometry with a quaternion from the world to the body.",
        moving("ODOMETRY", lambda f: {"q": [f["q"][0], *(-part for part in f["q"][1:])]}),
    ),
    Sample(
        "vision_jumps.tlog",
        ("MFC504",),
        "A camera's position jumps by 3 m and its reset counter stays.",
        moving(VISION, lambda f: {"y": f["y"] + 3.0}, (30.0, math.inf)),
    ),
    Sample(
        "vision_turned_frame.tlog",
        ("MFC507",),
        "A camera's frame that points 40 degrees east of north.",
        moving(VISION, turned(40.0)),
    ),
    Sample(
        "vision_scaled.tlog",
        ("MFC508",),
        "A camera's metres are too short: everything is 1.3 times as long.",
        moving(VISION, scaled(1.3)),
    ),
    Sample(
        "vision_frozen.tlog",
        ("MFC509",),
        "A camera's position stands still while the vehicle flies on.",
        moving(VISION, values(x=10.0, y=0.0, z=-12.0), FROZEN_S),
    ),
    Sample(
        "vision_late.tlog",
        ("MFC813",),
        "A camera's pose is half a second old and stamped when it is sent.",
        clean(tlog, Flight(sides=MOVING, vision=True, late_s=0.5)),
    ),
    Sample(
        "nan_in_used_field.tlog",
        ("MFC601",),
        "A setpoint whose mask says use x, and x is NaN.",
        faulty_field(SETPOINT, values(x=math.nan)),
    ),
    Sample(
        "unset_zero_quaternion.tlog",
        ("MFC611",),
        "HOME_POSITION.q all zero instead of NaN: worth knowing.",
        faulty_field("HOME_POSITION", values(q=[0.0] * 4), always=True),
    ),
    Sample("clean_mission.plan", (), "Nothing: a mission for PX4.", missions.plan()),
    Sample(
        "sea_level_height.plan",
        ("MFC202",),
        "One corner at 518 m above home, which is its height above mean sea level.",
        missions.plan(missions.sea_level_height),
    ),
    Sample(
        "swapped_waypoint.waypoints",
        ("MFC305",),
        "One corner with longitude first, latitude second.",
        missions.waypoints(missions.swapped),
    ),
    Sample(
        "far_corner.waypoints",
        ("MFC901",),
        "A digit of one latitude is wrong: two legs of 133 km.",
        missions.waypoints(missions.far_corner),
    ),
)  # fmt: skip


def readme() -> str:
    """Return the page that says what is wrong in each sample."""
    lines = ["| sample | what is wrong | codes |", "|---|---|---|"]
    lines += [f"| `{s.name}` | {s.wrong} | {', '.join(s.codes) or 'none'} |" for s in SAMPLES]
    return (
        "# Samples\n\nSmall recordings of one simulated flight and missions over its home, each with one "
        "fault and its codes.\n`make samples` writes them and this page; what they hold is in `make.py`, "
        "the flight in `flight.py`\nand the missions in `missions.py`.\n\n"
        + "\n".join(lines)
        + "\n"
    )


def main() -> None:
    """Write every sample and the README."""
    for sample in SAMPLES:
        content = sample.content()
        (HERE / sample.name).write_bytes(content)
        print(f"{sample.name:36}{len(content):8} bytes")
    (HERE / "README.md").write_text(readme(), encoding="utf-8")


if __name__ == "__main__":
    main()
