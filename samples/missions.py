"""The mission files among the samples: a square above the flight's home, as ground stations write it."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from samples.flight import HOME_LAT, HOME_LON, HOME_MSL

WAYPOINT, LAND, TAKEOFF = 16, 21, 22
ABOVE_HOME, ABOVE_SEA = 3, 0
PX4, QUADROTOR = 12, 2
HEIGHT_M = 30.0
SIDE_DEG = 0.0006

Row = dict[str, Any]
"""An item: command, frame, lat, lon, alt."""
Change = Callable[[list[Row]], None]


def square() -> list[Row]:
    """Return take-off, the corners of a square and a landing."""
    corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
    commands = [TAKEOFF, WAYPOINT, WAYPOINT, WAYPOINT, LAND]
    return [
        {
            "command": command,
            "frame": ABOVE_HOME,
            "lat": round(HOME_LAT + north * SIDE_DEG, 7),
            "lon": round(HOME_LON + east * SIDE_DEG, 7),
            "alt": 0.0 if command == LAND else HEIGHT_M,
        }
        for command, (north, east) in zip(commands, corners, strict=True)
    ]


def plan(change: Change | None = None) -> Callable[[], bytes]:
    """Return a maker of a plan for PX4 as QGroundControl writes it, after `change` of its items."""

    def content() -> bytes:
        rows = square()
        if change is not None:
            change(rows)
        mission = {
            "cruiseSpeed": 15,
            "firmwareType": PX4,
            "globalPlanAltitudeMode": 1,
            "hoverSpeed": 5,
            "items": [_simple_item(number, row) for number, row in enumerate(rows, 1)],
            "plannedHomePosition": [HOME_LAT, HOME_LON, HOME_MSL],
            "vehicleType": QUADROTOR,
            "version": 2,
        }
        whole = {
            "fileType": "Plan",
            "geoFence": {"circles": [], "polygons": [], "version": 2},
            "groundStation": "QGroundControl",
            "mission": mission,
            "rallyPoints": {"points": [], "version": 2},
            "version": 1,
        }
        return json.dumps(whole, indent=4).encode() + b"\n"

    return content


def _simple_item(number: int, row: Row) -> Row:
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": row["alt"],
        "AltitudeMode": 1,
        "autoContinue": True,
        "command": row["command"],
        "doJumpId": number,
        "frame": row["frame"],
        "params": [0, 0, 0, None, row["lat"], row["lon"], row["alt"]],
        "type": "SimpleItem",
    }


def waypoints(change: Change) -> Callable[[], bytes]:
    """Return a maker of a waypoint file as Mission Planner writes it, after `change` of its items."""

    def content() -> bytes:
        rows = square()
        change(rows)
        home = {"command": WAYPOINT, "frame": ABOVE_SEA, "lat": HOME_LAT, "lon": HOME_LON}
        rows.insert(0, home | {"alt": HOME_MSL})
        lines = [_line(number, row) for number, row in enumerate(rows)]
        return ("QGC WPL 110\n" + "".join(lines)).encode()

    return content


def _line(number: int, row: Row) -> str:
    place = f"{row['lat']:.8f}\t{row['lon']:.8f}\t{row['alt']:.6f}"
    return (
        f"{number}\t{int(number == 0)}\t{row['frame']}\t{row['command']}\t0\t0\t0\t0\t{place}\t1\n"
    )


def sea_level_height(rows: list[Row]) -> None:
    """Give one corner the height above the sea, in the frame that counts from home."""
    rows[2]["alt"] = HOME_MSL + HEIGHT_M


def far_corner(rows: list[Row]) -> None:
    """Lose a digit of one corner's latitude: it is 133 km to the south."""
    rows[3]["lat"] = round(rows[3]["lat"] - 1.2, 7)


def swapped(rows: list[Row]) -> None:
    """Write longitude before latitude at one corner."""
    rows[2]["lat"], rows[2]["lon"] = rows[2]["lon"], rows[2]["lat"]
