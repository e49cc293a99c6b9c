"""Mistakes written into mission files: plans and waypoint files at every place, each clean before.

The clean missions are made here: a plan for PX4 with a fence, a plan and a waypoint file for ArduCopter, a
waypoint file for ArduPlane. What is wrong with which is in `expected.toml`, `[[file_mistake]]`; its expressions see
the columns of the items (`seq`, `command`, `frame`, `p1` to `p4`, `x`, `y`, `z`, and for plans `mode` and
`altitude`), `home`, the corners of the `fence`, the name of the mission, and the constants of MAVLink.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from io import BytesIO
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from benchmarks.injection.judge import FAMILIES, LOUD, Outcome, Verdicts, known_rules
from benchmarks.injection.plan import FileMistake, Plan, Spot
from benchmarks.injection.words import FUNCTIONS, Scope, evaluate
from mavframecheck.engine import Pack, Settings
from mavframecheck.engine.check import check_mission
from mavframecheck.model import Finding
from mavframecheck.sources import Recording, SourceError
from mavframecheck.wire import load_dialect

_METRES = 111_195.0
"""Of a degree of latitude."""
Columns = dict[str, Any]


class Mission(NamedTuple):
    """A mission to write: for whom, in which form."""

    name: str
    autopilot: str
    form: str
    """`plan` or `waypoints`."""
    items: tuple[tuple[str, int, float, float, float, float, float], ...]
    """Command, frame, param1, param4, metres north and east of home, height; NaN: nowhere."""


_NAN = math.nan
_HERE = (_NAN, _NAN)
_PX4 = Mission(
    "PX4 plan",
    "px4",
    "plan",
    (
        ("NAV_TAKEOFF", 3, 0, _NAN, 0, 0, 25),
        ("NAV_WAYPOINT", 3, 0, _NAN, 120.3, 14.7, 30),
        ("NAV_WAYPOINT", 3, 2, _NAN, 131.9, 170.2, 32),
        ("NAV_WAYPOINT", 3, 0, _NAN, 12.6, 166.8, 28),
        ("NAV_WAYPOINT", 0, 0, _NAN, -33.1, 95.4, 35),
        ("NAV_WAYPOINT", 3, 0, _NAN, -21.7, 20.9, 30),
        ("NAV_LAND", 3, 0, _NAN, 3.1, 2.2, 0),
    ),
)
_COPTER = (
    ("NAV_WAYPOINT", 0, 0, 0, 0, 0, 0),
    ("NAV_TAKEOFF", 3, 0, 0, 0, 0, 20),
    ("DO_CHANGE_SPEED", 2, 1, 0, *_HERE, 0),
    ("NAV_WAYPOINT", 3, 0, 0, 85.4, -12.2, 20),
    ("NAV_SPLINE_WAYPOINT", 3, 0, 0, 140.8, 66.1, 30),
    ("NAV_WAYPOINT", 0, 3, 0, 77.7, 131.5, 40),
    ("NAV_WAYPOINT", 3, 0, 0, -15.2, 88.8, 35),
    ("NAV_RETURN_TO_LAUNCH", 2, 0, 0, *_HERE, 0),
)
_PLANE = (
    ("NAV_WAYPOINT", 0, 0, 0, 0, 0, 0),
    ("NAV_TAKEOFF", 3, 15, 0, 150.5, 10.4, 50),
    ("NAV_WAYPOINT", 3, 0, 0, 905.1, 120.6, 80),
    ("NAV_WAYPOINT", 3, 0, 0, 1090.2, 480.9, 90),
    ("NAV_WAYPOINT", 0, 0, 0, 1203.3, 840.2, 100),
    ("NAV_LOITER_TURNS", 3, 2, 0, 610.9, 1310.8, 100),
    ("NAV_WAYPOINT", 3, 0, 0, -220.4, 960.7, 80),
    ("DO_JUMP", 2, 2, 0, *_HERE, 0),
    ("NAV_LAND", 3, 0, 0, 20.8, 5.6, 0),
)
MISSIONS = (
    _PX4,
    Mission("ArduCopter plan", "arducopter", "plan", _COPTER),
    Mission("ArduCopter waypoints", "arducopter", "waypoints", _COPTER),
    Mission("ArduPlane waypoints", "arduplane", "waypoints", _PLANE),
)
_FENCE = np.array([[-200.0, -300.0], [400.0, -280.0], [380.0, 420.0], [-220.0, 400.0]])


class Made(NamedTuple):
    """A mission at a place, as columns."""

    mission: Mission
    home: Spot
    columns: Columns
    fence: np.typing.NDArray[np.float64]


def made(mission: Mission, home: Spot) -> Made:
    """Return a mission around `home`, its heights above the sea those of the place."""
    command = np.array([getattr(mavlink, f"MAV_CMD_{item[0]}") for item in mission.items])
    numbers = np.array([item[1:] for item in mission.items], float)
    frame = numbers[:, 0].astype(np.int64)
    lat, lon = _degrees(home, numbers[:, 3], numbers[:, 4])
    z = numbers[:, 5] + np.where(frame == 0, home.alt, 0.0)
    n = len(command)
    columns = {
        "seq": np.arange(n),
        "command": command,
        "frame": frame,
        "p1": numbers[:, 1],
        **{name: np.zeros(n) for name in ("p2", "p3")},
        "p4": numbers[:, 2],
        "x": np.nan_to_num(lat),
        "y": np.nan_to_num(lon),
        "z": z,
    }
    columns["mode"] = np.where(frame == 0, 2, 1)
    columns["altitude"] = z.copy()
    fence = np.stack(_degrees(home, *_FENCE.T), axis=1)
    return Made(mission, home, columns, fence)


def _degrees(home: Spot, north: Any, east: Any) -> tuple[Any, Any]:
    """Return latitude and longitude, rounded as they are written."""
    lon = home.lon + east / (_METRES * math.cos(math.radians(home.lat)))
    return np.round(home.lat + north / _METRES, 7), np.round((lon + 180) % 360 - 180, 7)


def written(made: Made) -> bytes:
    """Return the file."""
    return (_plan(made) if made.mission.form == "plan" else _waypoints(made)).encode()


def _waypoints(made: Made) -> str:
    c = made.columns
    rows = ["QGC WPL 110"]
    for k in range(len(c["seq"])):
        numbers = "\t".join(f"{c[name][k]:.9f}" for name in ("p1", "p2", "p3", "p4", "x", "y", "z"))
        rows.append(
            f"{c['seq'][k]}\t{int(k == 0)}\t{c['frame'][k]}\t{c['command'][k]}\t{numbers}\t1"
        )
    return "\n".join(rows) + "\n"


def _plan(made: Made) -> str:
    px4 = made.mission.autopilot == "px4"
    rows = range(len(made.columns["seq"]))
    items = [_item(made.columns, k, 1 if px4 else 0) for k in (rows if px4 else rows[1:])]
    home = made.home
    ring = {"inclusion": True, "polygon": made.fence.tolist(), "version": 1}
    return json.dumps(
        {
            "fileType": "Plan",
            "version": 1,
            "groundStation": "QGroundControl",
            "geoFence": {"circles": [], "polygons": [ring], "version": 2},
            "rallyPoints": {"points": [], "version": 2},
            "mission": {
                "version": 2,
                "firmwareType": 12 if px4 else 3,
                "vehicleType": 2,
                "cruiseSpeed": 15,
                "hoverSpeed": 5,
                "plannedHomePosition": [home.lat, home.lon, home.alt],
                "items": items,
            },
        },
        indent=1,
    )


def _item(c: Columns, k: int, shift: int) -> dict[str, Any]:
    numbers = [float(c[name][k]) for name in ("p1", "p2", "p3", "p4", "x", "y", "z")]
    return {
        "type": "SimpleItem",
        "command": int(c["command"][k]),
        "frame": int(c["frame"][k]),
        "AltitudeMode": int(c["mode"][k]),
        "Altitude": float(c["altitude"][k]),
        "AMSLAltAboveTerrain": None,
        "autoContinue": True,
        "doJumpId": int(c["seq"][k]) + shift,
        "params": [None if math.isnan(value) else value for value in numbers],
    }


class _Scope(Scope):
    """The names that expressions about a mission file may use."""

    def __init__(self, made: Made) -> None:
        dict.__init__(self, FUNCTIONS, pi=np.pi, nan=np.nan)
        home = SimpleNamespace(lat=made.home.lat, lon=made.home.lon, alt=made.home.alt)
        kind = made.mission.autopilot
        self.update(made.columns, home=home, fence=made.fence, form=made.mission.form)
        self.update(px4=kind == "px4", ardupilot=kind != "px4", plane=kind == "arduplane")
        self.update(nth=np.arange(len(made.columns["seq"])), plan=made.mission.form == "plan")

    def __missing__(self, name: str) -> Any:
        return getattr(mavlink, name)


def with_mistake(clean: Made, mistake: FileMistake, condition: str) -> Made | None:
    """Return a mission with a mistake in the items where it applies, None where it has too few of them."""
    scope, n = _Scope(clean), len(clean.columns["seq"])
    holds = evaluate(f"({mistake.where}) & ({condition})", scope, n).astype(bool)
    first = int(not scope["px4"])  # item 0 is home
    rows = np.flatnonzero(holds & (np.arange(n) >= (0 if mistake.home else first)))[
        -mistake.times :
    ]
    if len(rows) < mistake.least:
        return None
    columns = {name: column.copy() for name, column in clean.columns.items()}
    for name, text in mistake.set.items():
        value = np.asarray(evaluate(text, scope, n))
        kind = columns[name].dtype if name in ("seq", "command", "frame", "mode") else float
        columns[name][rows] = value[rows].astype(kind)
        if name == "z" and "altitude" not in mistake.set:
            columns["altitude"][rows] = columns["z"][rows]
    fence = np.asarray(evaluate(mistake.fence, scope, 1)) if mistake.fence else clean.fence
    return clean._replace(columns=columns, fence=fence)


def findings_in(file: Made, codes: tuple[str, ...]) -> list[Finding]:
    """Return what the rules whose codes begin like `codes` find in a mission."""
    chosen = [(rule, source) for rule, source in known_rules() if rule.code.startswith(codes)]
    pack = Pack(tuple(rule for rule, _ in chosen), {rule.code: source for rule, source in chosen})
    recording = Recording("injected mission", BytesIO(written(file)), None)
    settings = Settings(preview=True, autopilot=file.mission.autopilot)
    try:
        return list(check_mission(recording, pack, settings, load_dialect())[1])
    except SourceError as error:  # a file that is refused is no finding of a rule
        raise ValueError(f"{file.mission.name}: {error}") from error


def judge_files(plan: Plan, mistakes: list[FileMistake]) -> Verdicts:
    """Judge every mission at every place: as it is, then with each mistake."""
    verdicts = Verdicts()
    for mission, (place, spot) in ((m, p) for m in MISSIONS for p in plan.place.items()):
        clean, said = made(mission, spot), f"{mission.name} at {place}"
        before = findings_in(clean, FAMILIES)
        loud = [finding for finding in before if finding.severity in LOUD]
        verdicts.alarms += [f"{said}: {f.severity} {f.code}: {f.text}" for f in loud]
        verdicts.originals += 1
        for mistake in mistakes:
            verdicts.outcomes += _outcomes(clean, said, mistake, before)
    return verdicts


def _outcomes(
    clean: Made, said: str, mistake: FileMistake, before: list[Finding]
) -> Iterator[Outcome]:
    """Yield how a mistake fared where the method can decide, and where it cannot."""
    known = {finding.code for finding in before}
    cases = [(mistake.decides, "found", "missed")]
    cases += [(mistake.blind, "wrong", "silent")] if mistake.blind else []
    for condition, yes, no in cases:
        bad = with_mistake(clean, mistake, condition)
        if bad is not None:
            found = [f for f in findings_in(bad, mistake.codes) if f.code not in known]
            text = found[0].text if found else ""
            word: Any = yes if found else no
            yield Outcome(mistake.name, said, word, len(found), 1, text)
