"""A made-up flight for the kinematic judge: series, and the recording they make."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mavframecheck.checks.motion.series import Series
from mavframecheck.geo import quaternions as q4
from mavframecheck.vehicle.pairs import moved
from tests.strategies import START_US, frame

RATE_S = 0.1


def flight(seconds: float = 40.0, shift_s: float = 0.0) -> Series:
    """Return a flight that climbs, curves and turns, with tilts; seen `shift_s` later."""
    t = np.arange(0, seconds, RATE_S)
    s = t - shift_s
    place = np.column_stack(
        (8 * np.sin(0.35 * s), 6 * np.sin(0.5 * s + 1), -10 + 3 * np.sin(0.45 * s))
    )
    lies = q4.quaternion_from_euler(0.2 * np.sin(0.7 * s), 0.25 * np.cos(0.6 * s), np.sin(0.3 * s))
    velocity = np.column_stack(
        (2.8 * np.cos(0.35 * s), 3 * np.cos(0.5 * s + 1), 1.35 * np.cos(0.45 * s))
    )
    return Series("GLOBAL_POSITION_INT", t, place, lies, velocity, t)


Fields = Callable[[Series, int], dict[str, Any]]


def recording(
    message: str, fields: Fields, seconds: float = 40.0, second: Fields | None = None
) -> bytes:
    """Return the flight as telemetry, and a stream of `message` that a companion sends beside it, or two do."""
    true = flight(seconds)
    data = b""
    angles = q4.euler_from_quaternion(true.attitude)
    for k, t in enumerate(true.t.tolist()):
        lat, lon = moved(
            np.array([47.4]), np.array([8.5]), true.place[k : k + 1, 0], true.place[k : k + 1, 1]
        )
        at = {"lat": round(float(lat[0]) * 1e7), "lon": round(float(lon[0]) * 1e7)}
        at["alt"] = round((500 - float(true.place[k, 2])) * 1e3)
        speed = dict(
            zip(
                ("vx", "vy", "vz"),
                (true.velocity[k] * 100).round().astype(int).tolist(),
                strict=True,
            )
        )
        lies = dict(zip(("roll", "pitch", "yaw"), angles[k].tolist(), strict=True))
        boot = {"time_boot_ms": round(t * 1e3)}
        frames = [
            frame("GLOBAL_POSITION_INT", at | speed | boot),
            frame("GPS_RAW_INT", at | {"fix_type": 3}),
            frame("ATTITUDE", lies | boot),
            frame(message, fields(true, k), (1, 191)),
        ]
        if second is not None:
            frames.append(frame(message, second(true, k), (1, 192)))
        if k % 10 == 0:
            frames.append(frame("HEARTBEAT", {"type": 2, "autopilot": 3}))
        for each in frames:
            data += (START_US + round(t * 1e6)).to_bytes(8, "big") + each
    return data
