"""The words of `expected.toml`: expressions over the columns of a message and what the vehicle said before.

`vehicle.lat`, `home.alt` and so on are the last values that the autopilot sent before each row, in degrees,
metres, metres per second and radians; `undulation` is that of the geoid there, `separation` what the receiver says
of it, where it says anything; `t` counts seconds from the first frame, `nth` rows; `compid` is the sender's; `k` is the value of the case,
`earlier(column, seconds)` what the stream said before, `noise(size)` the same random numbers in every run,
`attitude` that of the vehicle as a quaternion, `turned(q, (x, y, z))` vectors turned by it; `seen(message, field, values)` tells whether the recording has such a message; `px4`, `ardupilot`,
`copter`, `plane`, `rover` and `sub` say who flies. Any other name is a field of the message, as on the wire, or a
constant of MAVLink as pymavlink spells it (`MAV_CMD_NAV_TAKEOFF`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from types import CodeType
from typing import Any

import numpy as np
import numpy.typing as npt
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from benchmarks.injection.log import Log
from mavframecheck.geo import quaternions
from mavframecheck.geo.geoid import undulation
from mavframecheck.wire import Table

Floats = npt.NDArray[np.float64]

STACKS = {
    (mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_TYPE_QUADROTOR): "px4",
    (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_QUADROTOR): "arducopter",
    (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_FIXED_WING): "arduplane",
    (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_GROUND_ROVER): "ardurover",
    (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_SUBMARINE): "ardusub",
}
"""(autopilot, type) of HEARTBEAT -> what flies."""

FACTS: dict[str, dict[str, tuple[str, str, float]]] = {
    "vehicle": {
        "lat": ("GLOBAL_POSITION_INT", "lat", 1e-7),
        "lon": ("GLOBAL_POSITION_INT", "lon", 1e-7),
        "alt": ("GLOBAL_POSITION_INT", "alt", 1e-3),
        "up": ("GLOBAL_POSITION_INT", "relative_alt", 1e-3),
        "vx": ("GLOBAL_POSITION_INT", "vx", 1e-2),
        "vy": ("GLOBAL_POSITION_INT", "vy", 1e-2),
        "vz": ("GLOBAL_POSITION_INT", "vz", 1e-2),
        "roll": ("ATTITUDE", "roll", 1.0),
        "pitch": ("ATTITUDE", "pitch", 1.0),
        "yaw": ("ATTITUDE", "yaw", 1.0),
        "boot": ("ATTITUDE", "time_boot_ms", 1e-3),
    },
    "home": {
        "lat": ("HOME_POSITION", "latitude", 1e-7),
        "lon": ("HOME_POSITION", "longitude", 1e-7),
        "alt": ("HOME_POSITION", "altitude", 1e-3),
    },
    "local": {name: ("LOCAL_POSITION_NED", name, 1.0) for name in ("x", "y", "z")},
    "gnss": {
        "lat": ("GPS_RAW_INT", "lat", 1e-7),
        "lon": ("GPS_RAW_INT", "lon", 1e-7),
        "alt": ("GPS_RAW_INT", "alt", 1e-3),
        "ellipsoid": ("GPS_RAW_INT", "alt_ellipsoid", 1e-3),
        "fix": ("GPS_RAW_INT", "fix_type", 1.0),
    },
}
"""Subject -> quantity -> message, field, and the factor to degrees, metres or radians."""


def distinct(values: Any) -> int:
    """Return how many different values a column holds."""
    return len(np.unique(values))


def turned(q: Any, v: Any) -> Floats:
    """Return (n, 3) vectors, or a tuple of columns, turned by quaternions."""
    return quaternions.turn_by(q, np.column_stack(v) if isinstance(v, tuple) else v)


FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("where", "abs", "sin", "cos", "radians", "degrees")},
    **{
        name: getattr(np, name)
        for name in ("hypot", "arctan2", "float32", "isnan", "isfinite", "minimum")
    },
    **{name: getattr(np, name) for name in ("maximum", "isin", "trunc", "zeros_like", "full")},
    "sqrt": np.sqrt,
    "distinct": distinct,
    "share": np.mean,
    "geoid": undulation,
    "len": len,
    "every": np.all,
    "median": np.median,
    "inverse": quaternions.inverse,
    "times": quaternions.product,
    "about_z": quaternions.about_z,
    "quaternion": quaternions.quaternion_from_euler,
    "turned": turned,
}


class _Subject:
    """What was last said of one subject before each row."""

    def __init__(self, log: Log, name: str, number: npt.NDArray[np.int64]) -> None:
        self._log, self._name, self._number = log, name, number

    def __getattr__(self, quantity: str) -> Floats:
        message, field, scale = FACTS[self._name][quantity]
        table = self._log.own(message)
        if table is None:
            return np.full(len(self._number), np.nan)
        before = np.searchsorted(table.frames.number, self._number) - 1
        values: Floats = table[field][np.maximum(before, 0)] * scale
        return values


class Scope(dict[str, Any]):
    """The names that an expression may use, for the rows of one table."""

    def __init__(self, log: Log, table: Table) -> None:
        """Look at `table`, rows of `log`."""
        super().__init__(FUNCTIONS, pi=np.pi, nan=np.nan, array=self._array)
        self._log, self._table = log, table
        self.update(earlier=self._earlier, noise=self._noise)
        self._dice = np.random.default_rng(len(table))

    def __missing__(self, name: str) -> Any:
        table, flies = self._table, flying(self._log)
        if name == "seen":
            return self._seen
        if name in table.layout.by_name:
            column = table[name]
            return column.astype(np.int64 if column.dtype.kind in "iu" else np.float64)
        if name in FACTS:
            return _Subject(self._log, name, table.frames.number)
        if name == "attitude":
            lies = self["vehicle"]
            return quaternions.quaternion_from_euler(lies.roll, lies.pitch, lies.yaw)
        if name in ("undulation", "separation"):
            here, gnss = self["vehicle"], self["gnss"]
            model, told = undulation(here.lat, here.lon), gnss.ellipsoid - gnss.alt
            gives = (gnss.ellipsoid != 0) & (np.abs(told) > 1) & (name == "separation")
            return np.where(gives, told, model)
        known: Mapping[str, Any] = {
            "t": self._log.seconds[table.frames.number],
            "nth": np.arange(len(table)),
            "compid": table.frames.compid,
            "px4": np.bool_(flies == "px4"),
            "ardupilot": np.bool_(flies.startswith("ardu")),
            "copter": np.bool_(flies == "arducopter"),
            "plane": np.bool_(flies == "arduplane"),
            "rover": np.bool_(flies == "ardurover"),
            "sub": np.bool_(flies == "ardusub"),
        }
        return known[name] if name in known else getattr(mavlink, name)

    def _array(self, values: tuple[Any, ...]) -> Floats:
        """Return (n, k) columns or numbers side by side: an array field."""
        rows = [np.broadcast_to(np.asarray(v, np.float64), len(self._table)) for v in values]
        return np.stack(rows, axis=-1)

    def _earlier(self, values: Any, seconds: float) -> Any:
        """Return what a column, or columns, held `seconds` before, at the beginning the first value."""
        t = self._log.seconds[self._table.frames.number]
        rows = round(seconds / max(float(np.median(np.diff(t))), 1e-3)) if len(t) > 1 else 0
        return values[np.maximum(np.arange(len(t)) - rows, 0)]

    def _noise(self, size: float) -> Floats:
        """Return (n,) random numbers of that standard deviation."""
        return self._dice.normal(0.0, size, len(self._table))

    def _seen(self, message: str, field: str, values: tuple[int, ...]) -> Any:
        """Return whether any such message in the recording has one of these values."""
        table = self._log.tables.get(message)
        return np.bool_(table is not None and np.isin(table[field], values).any())


def evaluate(text: str, scope: Scope, rows: int) -> Any:
    """Return the value of an expression, a scalar spread over `rows`."""
    try:
        value = np.asarray(eval(_code(text), {"__builtins__": {}}, scope))
    except Exception as error:
        raise ValueError(f"expected.toml: {text!r}: {error!r}") from error
    return np.broadcast_to(value, rows) if value.ndim == 0 else value


@cache
def _code(text: str) -> CodeType:
    return compile(text, "expected.toml", "eval")


def flying(log: Log) -> str:
    """Return what flies: the first autopilot that says so."""
    beats = log.own("HEARTBEAT")
    if beats is None:
        return ""
    return STACKS.get((int(beats["autopilot"][0]), int(beats["type"][0])), "other")
