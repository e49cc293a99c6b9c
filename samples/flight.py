"""A small flight and the MAVLink traffic about it: what the samples are made from.

A multicopter takes off, flies sides of a square, lands. Its path is minimum-jerk between knots, so
position, velocity, acceleration and attitude agree with each other exactly, as a rule will demand.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

START_US = 1_772_445_600_000_000
"""Receive time of the first message, us since 1970 (2 March 2026, 10:00 UTC)."""
BOOTED_S = 20.0
"""Time since boot of the vehicle at the first message, s."""
HOME_LAT, HOME_LON, HOME_MSL = 47.397742, 8.545594, 488.0
"""Home and estimator origin: deg, deg, m above mean sea level."""
UNDULATION_M = 47.6
"""Height of the geoid above the ellipsoid there, m."""
HEIGHT_M, SIDE_M = 12.0, 15.0
CLIMB_S, ARM_S, SQUARE_S, PER_SIDE_S = 8.0, 6.0, 18.0, 8.0
"""When it begins to climb, is armed, and begins its square; time for one side of it, s."""
GRAVITY = 9.80665
VEHICLE, GCS, COMPANION = (1, 1), (255, 190), (1, 191)
"""(sysid, compid) of who speaks."""

Fields = dict[str, Any]
Vector = tuple[float, float, float]


class Said(NamedTuple):
    """A message before it is packed."""

    t: float
    """Seconds since `START_US`."""
    sender: tuple[int, int]
    message: str
    fields: Fields


@dataclass(frozen=True)
class Stack:
    """What differs between autopilots on the wire."""

    autopilot: int
    sphere_m: float
    """Radius of the sphere on which its local frame is projected, m."""
    guided: tuple[int, int]
    landing: tuple[int, int]
    """param2 and param3 of DO_SET_MODE for flying under a companion and for landing."""

    def custom_mode(self, mode: tuple[int, int]) -> int:
        """Return a mode as HEARTBEAT carries it: PX4 packs main and sub mode."""
        return mode[0] << 16 | mode[1] << 24 if self is PX4 else mode[0]


ARDUCOPTER = Stack(3, 6_378_100.0, (4, 0), (9, 0))
PX4 = Stack(12, 6_371_000.0, (6, 0), (4, 6))


class State(NamedTuple):
    """The vehicle at one moment: NED, m, m/s, m/s^2; FRD attitude, rad."""

    t: float
    position: Vector
    velocity: Vector
    acceleration: Vector
    roll: float
    pitch: float
    yaw: float

    @property
    def boot_ms(self) -> int:
        """Return time since boot, ms."""
        return round((BOOTED_S + self.t) * 1e3)

    @property
    def ground_speed(self) -> float:
        """Return horizontal speed, m/s."""
        return math.hypot(*self.velocity[:2])


@dataclass(frozen=True)
class Knot:
    """A state of rest: where the vehicle is at `t`, NED m, and where its nose points, rad."""

    t: float
    position: Vector
    yaw: float


@dataclass
class Flight:
    """One flight of `sides` sides of the square, told by one autopilot."""

    stack: Stack = ARDUCOPTER
    sides: int = 1
    odometry: bool = False
    vision: bool = False
    late_s: float = 0.0
    """How old the vision estimate is when it is stamped, s."""
    dice: random.Random = field(default_factory=lambda: random.Random(7))

    @property
    def land_s(self) -> float:
        """Return when it begins to land, s."""
        return SQUARE_S + self.sides * PER_SIDE_S

    @property
    def end_s(self) -> float:
        """Return when the recording ends, s."""
        return self.land_s + 14.0

    def knots(self) -> list[Knot]:
        """Return the rests between which it moves."""
        yaw = math.radians(40)
        knots = [Knot(t, (0.0, 0.0, 0.0), yaw) for t in (0.0, CLIMB_S)]
        here = (0.0, 0.0, -HEIGHT_M)
        knots += [Knot(t, here, yaw) for t in (SQUARE_S - 2, SQUARE_S)]
        for side in range(self.sides):
            start, yaw = SQUARE_S + side * PER_SIDE_S, side * math.pi / 2
            knots.append(Knot(start + 1.5, here, yaw))
            here = (here[0] + SIDE_M * math.cos(yaw), here[1] + SIDE_M * math.sin(yaw), here[2])
            knots.append(Knot(start + PER_SIDE_S - 0.5, here, yaw))
        knots.append(Knot(self.land_s, here, yaw))
        ground = (here[0], here[1], 0.0)
        return [*knots, *(Knot(t, ground, yaw) for t in (self.land_s + 10, self.end_s + 1))]

    def at(self, t: float) -> State:
        """Return the state at `t` seconds: minimum jerk between two knots, tilted to accelerate."""
        knots = self.knots()
        a, b = next((a, b) for a, b in itertools.pairwise(knots) if t <= b.t)
        span = b.t - a.t
        u = (t - a.t) / span
        s = u**3 * (10 - 15 * u + 6 * u * u)
        ds = 30 * u * u * (1 - u) ** 2 / span
        dds = 60 * u * (1 - u) * (1 - 2 * u) / span**2
        way = [q - p for p, q in zip(a.position, b.position, strict=True)]
        n, e, d = (p + w * s for p, w in zip(a.position, way, strict=True))
        an, ae, ad = (w * dds for w in way)
        yaw = a.yaw + (b.yaw - a.yaw) * s
        forward = an * math.cos(yaw) + ae * math.sin(yaw)
        right = ae * math.cos(yaw) - an * math.sin(yaw)
        pitch = math.atan2(-forward, GRAVITY - ad)
        roll = math.atan2(right * math.cos(pitch), GRAVITY - ad)
        velocity = (way[0] * ds, way[1] * ds, way[2] * ds)
        return State(t, (n, e, d), velocity, (an, ae, ad), roll, pitch, yaw)

    def globe(self, north: float, east: float) -> tuple[float, float]:
        """Return latitude and longitude, deg, of a local position, m, as this autopilot projects."""
        lat = HOME_LAT + math.degrees(north / self.stack.sphere_m)
        scale = self.stack.sphere_m * math.cos(math.radians(HOME_LAT))
        return lat, HOME_LON + math.degrees(east / scale)

    def noise(self, size: float) -> float:
        """Return a number within plus and minus `size`, the same in every run."""
        return self.dice.uniform(-size, size)

    def traffic(self) -> list[Said]:
        """Return everything said during the flight, in order of time."""
        said = [*self._events(), *(m for stream in self._streams() for m in stream)]
        return sorted(said, key=lambda one: one.t)

    def _streams(self) -> Iterator[Iterator[Said]]:
        """Yield each stream: who says what, how often, from when, to when."""
        end, guided = self.end_s, (SQUARE_S, self.land_s)
        for message, period, phase, tell in VEHICLE_STREAMS:
            yield self._stream(VEHICLE, message, period, (phase, end), tell)
        yield self._stream(GCS, "HEARTBEAT", 1.0, (0.3, end), lambda *_: peer(6))
        yield self._stream(COMPANION, "HEARTBEAT", 1.0, (0.6, end), lambda *_: peer(18))
        yield self._stream(COMPANION, SETPOINT, 0.5, guided, setpoint)
        if self.odometry:
            yield self._stream(COMPANION, "ODOMETRY", 0.2, (CLIMB_S, self.land_s), odometry)
        if self.vision:
            yield self._stream(COMPANION, VISION, 0.2, (CLIMB_S, self.land_s), vision)

    def _stream(
        self, sender: tuple[int, int], message: str, period: float, when: Vector2, tell: Tell
    ) -> Iterator[Said]:
        """Yield `message` every `period` seconds."""
        for i in range(math.ceil((when[1] - when[0]) / period)):
            t = when[0] + i * period
            yield Said(t, sender, message, tell(self, self.at(t)))

    def _events(self) -> Iterator[Said]:
        """Yield what is said once: who the autopilot is, commands and their answers."""
        if self.stack is PX4:
            yield Said(0.9, VEHICLE, "AUTOPILOT_VERSION", px4_version())
            takeoff: Fields = dict.fromkeys(("param4", "param5", "param6"), math.nan)
            takeoff["param7"] = HOME_MSL + HEIGHT_M
        else:
            text = b"ArduCopter V4.5.7 (2a3dc4b7)"
            yield Said(0.9, VEHICLE, "STATUSTEXT", {"severity": 6, "text": text})
            takeoff = {"param7": HEIGHT_M}
        yield from command(ARM_S - 1, DO_SET_MODE, mode(self.stack.guided))
        yield from command(ARM_S - 0.2, ARM_DISARM, {"param1": 1})
        yield from command(CLIMB_S - 0.3, NAV_TAKEOFF, takeoff)
        yield from command(self.land_s - 0.1, DO_SET_MODE, mode(self.stack.landing))


Tell = Callable[[Flight, State], Fields]
Vector2 = tuple[float, float]
SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
VISION = "VISION_POSITION_ESTIMATE"
NAV_TAKEOFF, DO_SET_MODE, ARM_DISARM = 22, 176, 400


def mode(main_and_sub: tuple[int, int]) -> Fields:
    """Return the parameters of DO_SET_MODE."""
    return {"param1": 1, "param2": main_and_sub[0], "param3": main_and_sub[1]}


def command(t: float, number: int, params: Fields, result: int = 0) -> list[Said]:
    """Return a COMMAND_LONG of the ground station and the vehicle's answer."""
    given = dict.fromkeys((f"param{i}" for i in range(1, 8)), 0.0) | params
    asked = given | {"command": number, "confirmation": 0}
    return [Said(t, GCS, "COMMAND_LONG", asked | to_vehicle()), answer(t, number, result)]


def answer(t: float, number: int, result: int) -> Said:
    """Return the COMMAND_ACK for a command of the ground station given at `t`."""
    to = {"target_system": GCS[0], "target_component": GCS[1]}
    return Said(t + 0.05, VEHICLE, "COMMAND_ACK", {"command": number, "result": result} | to)


def to_vehicle() -> Fields:
    """Return the target of a message to the vehicle."""
    return {"target_system": VEHICLE[0], "target_component": VEHICLE[1]}


def peer(kind: int) -> Fields:
    """Return the HEARTBEAT of something that is no autopilot."""
    modes = {"base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3}
    return {"type": kind, "autopilot": 8} | modes


def heartbeat(flight: Flight, now: State) -> Fields:
    """Return who the vehicle is, its mode, and whether it is armed."""
    flying = CLIMB_S <= now.t < flight.land_s + 10
    armed = ARM_S <= now.t < flight.land_s + 12
    mode = flight.stack.landing if now.t >= flight.land_s else flight.stack.guided
    custom_mode = flight.stack.custom_mode(mode)
    fields = {"type": 2, "autopilot": flight.stack.autopilot, "base_mode": 128 * armed + 89}
    status = {"system_status": 4 if flying else 3, "mavlink_version": 3}
    return fields | status | {"custom_mode": custom_mode}


def px4_version() -> Fields:
    """Return the AUTOPILOT_VERSION of PX4 1.15.4."""
    versions = ("middleware_sw_version", "os_sw_version", "board_version", "vendor_id")
    custom = (f"{part}_custom_version" for part in ("flight", "middleware", "os"))
    fields: Fields = dict.fromkeys((*versions, "product_id", "uid"), 0)
    fields |= dict.fromkeys(custom, [0] * 8)
    return fields | {"capabilities": 0xE4EF, "flight_sw_version": 0x010F04FF}


def attitude(flight: Flight, now: State) -> Fields:
    """Return Euler angles and body rates."""
    angles = {"roll": now.roll, "pitch": now.pitch, "yaw": math.remainder(now.yaw, math.tau)}
    return {"time_boot_ms": now.boot_ms} | angles | body_rates(flight, now)


def body_rates(flight: Flight, now: State, step: float = 1e-3) -> Fields:
    """Return rates about the FRD axes, rad/s, from Euler angles `step` seconds apart."""
    later = flight.at(now.t + step)
    dr, dp, dy = (b - a for a, b in zip(now[4:7], later[4:7], strict=True))
    (sr, cr), (sp, cp) = ((math.sin(a), math.cos(a)) for a in (now.roll, now.pitch))
    rates = (dr - dy * sp, dp * cr + dy * sr * cp, dy * cr * cp - dp * sr)
    names = ("rollspeed", "pitchspeed", "yawspeed")
    return dict(zip(names, (rate / step for rate in rates), strict=True))


def attitude_quaternion(flight: Flight, now: State) -> Fields:
    """Return the same attitude as a quaternion."""
    angles = attitude(flight, now)
    q = dict(zip(("q1", "q2", "q3", "q4"), quaternion(now), strict=True))
    return {k: v for k, v in angles.items() if k not in ("roll", "pitch", "yaw")} | q


def quaternion(now: State) -> list[float]:
    """Return w, x, y, z of `ned_from_frd`."""
    half = (now.roll / 2, now.pitch / 2, math.remainder(now.yaw, math.tau) / 2)
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, half), map(math.sin, half)
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    return [w, x, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]


def scaled_position(flight: Flight, now: State) -> tuple[int, int, int]:
    """Return latitude and longitude, degE7, and altitude, mm above mean sea level."""
    lat, lon = flight.globe(*now.position[:2])
    return round(lat * 1e7), round(lon * 1e7), round((HOME_MSL - now.position[2]) * 1e3)


def global_position(flight: Flight, now: State) -> Fields:
    """Return where the estimator thinks it is on the globe."""
    lat, lon, alt = scaled_position(flight, now)
    vx, vy, vz = (round(v * 100) for v in now.velocity)
    place = {"lat": lat, "lon": lon, "alt": alt, "relative_alt": round(-now.position[2] * 1e3)}
    return place | {"time_boot_ms": now.boot_ms, "vx": vx, "vy": vy, "vz": vz, "hdg": cdeg(now)}


def cdeg(now: State) -> int:
    """Return the heading, hundredths of a degree clockwise from north."""
    return round(math.degrees(now.yaw) % 360 * 100) % 36000


def local_position(_: Flight, now: State) -> Fields:
    """Return where the estimator thinks it is relative to its origin."""
    names = ("x", "y", "z", "vx", "vy", "vz")
    return {"time_boot_ms": now.boot_ms} | dict(
        zip(names, now.position + now.velocity, strict=True)
    )


def gps(flight: Flight, now: State) -> Fields:
    """Return a receiver's fix: the position with a few decimetres of error."""
    lat, lon, alt = scaled_position(flight, now)
    alt += round(flight.noise(200))
    course = math.degrees(math.atan2(now.velocity[1], now.velocity[0])) % 360
    place = {"lat": lat + round(flight.noise(20)), "lon": lon + round(flight.noise(30)), "alt": alt}
    motion = {"vel": round(now.ground_speed * 100), "cog": round(course * 100) % 36000}
    quality = {"fix_type": 4, "eph": 70, "epv": 110, "satellites_visible": 14, "h_acc": 400}
    height = {"alt_ellipsoid": alt + round(UNDULATION_M * 1e3), "v_acc": 600, "vel_acc": 200}
    return {"time_usec": now.boot_ms * 1000} | place | motion | quality | height


def origin(_: Flight, now: State) -> Fields:
    """Return the estimator's origin."""
    lat, lon = round(HOME_LAT * 1e7), round(HOME_LON * 1e7)
    place = {"latitude": lat, "longitude": lon, "altitude": round(HOME_MSL * 1e3)}
    return place | {"time_usec": now.boot_ms * 1000}


def home(flight: Flight, now: State) -> Fields:
    """Return home, which lies on the origin."""
    zeros = dict.fromkeys(("x", "y", "z", "approach_x", "approach_y", "approach_z"), 0.0)
    return origin(flight, now) | zeros | {"q": [1.0, 0.0, 0.0, 0.0]}


def hud(_: Flight, now: State) -> Fields:
    """Return what a pilot reads."""
    speed = {"airspeed": now.ground_speed, "groundspeed": now.ground_speed}
    height = {"alt": HOME_MSL - now.position[2], "climb": -now.velocity[2]}
    return speed | height | {"heading": cdeg(now) // 100, "throttle": 40 * (now.t > CLIMB_S)}


def system_time(_: Flight, now: State) -> Fields:
    """Return both clocks of the vehicle."""
    return {"time_unix_usec": START_US + round(now.t * 1e6), "time_boot_ms": now.boot_ms}


def setpoint(_: Flight, now: State) -> Fields:
    """Return where the companion wants the vehicle: position only, all else masked."""
    x, y, z = now.position
    unused = ("vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
    place = {"x": x, "y": y, "z": z, "coordinate_frame": 1, "type_mask": 0x0DF8}
    return dict.fromkeys(unused, 0.0) | place | to_vehicle() | {"time_boot_ms": now.boot_ms}


def odometry(flight: Flight, now: State) -> Fields:
    """Return the companion's own visual odometry: FRD axes, with what it knows of its errors."""
    x, y, z = (p + flight.noise(0.01) for p in now.position)
    twist = dict(zip(("vx", "vy", "vz"), body_velocity(now), strict=True))
    frames = {"frame_id": 20, "child_frame_id": 12, "estimator_type": 3, "quality": 90}
    errors = {"pose_covariance": diagonal(0.01, 0.001), "velocity_covariance": diagonal(0.02, 0.01)}
    pose = {"time_usec": now.boot_ms * 1000, "x": x, "y": y, "z": z, "q": quaternion(now)}
    return pose | twist | body_rates(flight, now) | frames | errors | {"reset_counter": 0}


def vision(flight: Flight, now: State) -> Fields:
    """Return a camera's estimate of the pose in the vehicle's local frame."""
    seen = flight.at(now.t - flight.late_s)
    x, y, z = (p + flight.noise(0.01) for p in seen.position)
    angles = {"roll": seen.roll, "pitch": seen.pitch, "yaw": math.remainder(seen.yaw, math.tau)}
    errors = {"covariance": diagonal(0.01, 0.001), "reset_counter": 0}
    return {"usec": now.boot_ms * 1000, "x": x, "y": y, "z": z} | angles | errors


def body_velocity(now: State) -> Vector:
    """Return velocity along the FRD axes, m/s: yaw, then pitch, then roll undone."""
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(a), math.cos(a)) for a in (now.roll, now.pitch, now.yaw)
    )
    n, e, d = now.velocity
    ahead, right = cy * n + sy * e, cy * e - sy * n
    below = sp * ahead + cp * d
    return cp * ahead - sp * d, cr * right + sr * below, cr * below - sr * right


def diagonal(linear: float, angular: float) -> list[float]:
    """Return the upper triangle, row by row, of a 6x6 covariance with these variances."""
    upper = [0.0] * 21
    for slot, variance in zip((0, 6, 11, 15, 18, 20), (linear,) * 3 + (angular,) * 3, strict=True):
        upper[slot] = variance
    return upper


VEHICLE_STREAMS: tuple[tuple[str, float, float, Tell], ...] = (
    ("HEARTBEAT", 1.0, 0.0, heartbeat),
    ("SYSTEM_TIME", 2.0, 0.02, system_time),
    ("GPS_GLOBAL_ORIGIN", 5.0, 0.04, origin),
    ("HOME_POSITION", 5.0, 0.06, home),
    ("ATTITUDE", 0.4, 0.10, attitude),
    ("ATTITUDE_QUATERNION", 0.8, 0.12, attitude_quaternion),
    ("GLOBAL_POSITION_INT", 0.4, 0.14, global_position),
    ("LOCAL_POSITION_NED", 0.4, 0.16, local_position),
    ("GPS_RAW_INT", 1.0, 0.18, gps),
    ("VFR_HUD", 1.0, 0.20, hud),
)
