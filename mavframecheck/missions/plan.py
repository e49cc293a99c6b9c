"""QGroundControl plans (`.plan`, version 1): simple items, those that complex items hold, fence and rally points.

Source: QGroundControl developer guide, "Plan File Format", and its readers, which also take items that keep
their place in `coordinate` (before 2018).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from mavframecheck.missions.located import (
    Array,
    Members,
    Object,
    Value,
    arrays,
    decimals,
    numbers,
    parse,
)
from mavframecheck.missions.planned import (
    FENCE,
    MISSION,
    RALLY,
    UNSAID,
    Home,
    Item,
    LaterPlaces,
    Places,
    Planned,
    Said,
    bounded,
)
from mavframecheck.missions.text import MissionError, Text
from mavframecheck.semantics.constants import constant

_CORNER = {
    True: constant("MAV_CMD.NAV_FENCE_POLYGON_VERTEX_INCLUSION"),
    False: constant("MAV_CMD.NAV_FENCE_POLYGON_VERTEX_EXCLUSION"),
}
_CIRCLE = {
    True: constant("MAV_CMD.NAV_FENCE_CIRCLE_INCLUSION"),
    False: constant("MAV_CMD.NAV_FENCE_CIRCLE_EXCLUSION"),
}
_RETURN = constant("MAV_CMD.NAV_FENCE_RETURN_POINT")
_RALLY = constant("MAV_CMD.NAV_RALLY_POINT")
_GLOBAL = constant("MAV_FRAME.GLOBAL")
_ABOVE_HOME = constant("MAV_FRAME.GLOBAL_RELATIVE_ALT")
_PARAMS = tuple(f"param{k}" for k in (1, 2, 3, 4))


def read_plan(text: Text) -> Planned:
    """Return the mission, fence and rally points of a plan; MissionError where it is none."""
    root = Members(text, parse(text), 0, "a plan")
    kind = root.box.get("fileType")
    if kind != "Plan":
        raise MissionError(
            f"{text.name}: {_what_else(root.box, kind)}; open it in QGroundControl and save it as a plan"
        )
    if root.number("version") != 1:
        text.fail(root.box.at["version"], "only version 1 of plans is known here")
    mission = root.inner("mission")
    planned = Planned("plan", text, [], _home(mission))
    if "firmwareType" in mission.box:
        planned.autopilot = mission.whole("firmwareType", most=255)
    if "vehicleType" in mission.box:
        planned.vehicle_type = mission.whole("vehicleType", most=255)
    planned.items += bounded(text, _items(root, mission, planned.notes))
    return planned


def _items(root: Members, mission: Members, notes: list[str]) -> Iterator[Item]:
    """Yield mission, fence and rally points."""
    yield from _mission(mission, notes)
    if root.box.get("geoFence") is not None:
        yield from _fence(root.inner("geoFence"))
    if root.box.get("rallyPoints") is not None:
        yield from _rally(root.inner("rallyPoints"))


def _what_else(root: Object, kind: Value) -> str:
    """Say what a JSON file that is no plan seems to be."""
    if isinstance(kind, str):
        return f'its fileType is "{kind[:40]}": only whole plans are read'
    if "MAV_AUTOPILOT" in root and "items" in root:
        return "this is a mission of QGroundControl before version 3.2"
    return 'this JSON is no plan of QGroundControl: it has no "fileType": "Plan"'


def _home(mission: Members) -> Home | None:
    """Return the planned home position; none at 0 N 0 E, which is what was never set."""
    if mission.box.get("plannedHomePosition") is None:
        return None
    place = mission.array("plannedHomePosition", (2, 3))
    lat, lon, alt_msl = numbers(mission.text, place) + [math.nan] * (3 - len(place))
    if lat == lon == 0 or math.isnan(lat) or math.isnan(lon):
        return None
    return Home(lat, lon, alt_msl, place.begin)


def _mission(mission: Members, notes: list[str]) -> Iterator[Item]:
    """Yield the items that would be sent, those of complex items included."""
    mode = mission.number("globalPlanAltitudeMode", math.nan)
    empty: list[str] = []
    complex_items = 0
    for box in mission.objects("items", "a mission item"):
        if box.box.get("type") != "ComplexItem":
            yield _simple(box, mode)
            continue
        complex_items += 1
        held = _held(box)
        for each in held:
            yield _simple(each, mode, complex_items)
        if not held:
            line = box.text.place(box.box.begin)[0]
            empty.append(f"{str(box.box.get('complexItemType'))[:40]} in line {line}")
    if empty:
        listed = ", ".join(empty[:5]) + (f" and {len(empty) - 5} more" if len(empty) > 5 else "")
        notes.append(
            f"{listed}: the plan holds no items of it, QGroundControl makes them when it uploads; "
            "they were not judged, and later items have other numbers on the vehicle"
        )


def _held(box: Members) -> list[Members]:
    """Return the items that a complex item was turned into: survey and corridor keep them."""
    inner = box.inner("TransectStyleComplexItem") if "TransectStyleComplexItem" in box.box else box
    return list(inner.objects("Items", "a generated item")) if "Items" in inner.box else []


def _simple(box: Members, plan_altitude_mode: float, complex_item: float = UNSAID) -> Item:
    """Return a mission item, also one of the older forms that keep the place in `coordinate`."""
    values, (lat, lon) = _params(box)
    return Item(
        mission_type=MISSION,
        command=box.whole("command", most=65_535),
        frame=box.whole("frame", most=255),
        params=(values[0], values[1], values[2], values[3]),
        x=values[4],
        y=values[5],
        z=values[6],
        places=LaterPlaces(partial(_places, box)),
        autocontinue=int(box.box.get("autoContinue") is not False),
        said=Said(
            x_decimals=decimals(lat),
            y_decimals=decimals(lon),
            number=box.number("doJumpId", math.nan),
            altitude=box.number("Altitude", math.nan),
            altitude_mode=box.number("AltitudeMode", math.nan),
            terrain_altitude=box.number("AMSLAltAboveTerrain", math.nan),
            plan_altitude_mode=plan_altitude_mode,
            complex_item=complex_item,
        ),
    )


def _params(box: Members) -> tuple[list[float], list[Value]]:
    """Return the seven parameters, and latitude and longitude as they are written."""
    if "coordinate" not in box.box:
        params = box.array("params", (7,))
        return numbers(box.text, params), params[4:6]
    coordinate = box.array("coordinate", (3,))
    behind = numbers(box.text, coordinate)
    if "params" in box.box:
        return numbers(box.text, box.array("params", (4,))) + behind, coordinate[:2]
    return [box.number(name) for name in _PARAMS] + behind, coordinate[:2]


def _places(box: Members) -> Places:
    """Return where an item and its parts stand."""
    at = box.box.at
    params = box.array("params").at if "params" in box.box else [at[name] for name in _PARAMS]
    if "coordinate" in box.box:
        params = params + box.array("coordinate").at
    return Places(box.box.begin, box.box.end, at["command"], at["frame"], *params)


def _fence(fence: Members) -> Iterator[Item]:
    """Yield the return point, the corners of polygons, and the circles, as they would be sent."""
    text = fence.text
    if fence.box.get("breachReturn") is not None:
        yield _point(text, fence.array("breachReturn", (2, 3)), _RETURN, FENCE, _ABOVE_HOME)
    if fence.box.get("polygon") is not None:  # version 1: a single one, to stay in
        yield from _polygon(fence, inclusion=True)
    for box in fence.objects("polygons", "a polygon"):
        yield from _polygon(box, inclusion=box.box.get("inclusion") is not False)
    for box in fence.objects("circles", "a circle"):
        command = _CIRCLE[box.box.get("inclusion") is not False]
        circle = box.inner("circle")
        point = _point(text, circle.array("center", (2, 3)), command, FENCE, _GLOBAL)
        yield point._replace(
            params=(circle.number("radius"), 0.0, 0.0, 0.0),
            places=point.places._replace(param1=circle.box.at["radius"]),
        )


def _polygon(box: Members, *, inclusion: bool) -> Iterator[Item]:
    """Yield the corners of a polygon; each says how many there are."""
    corners = box.array("polygon")
    for corner in arrays(box.text, corners, (2, 3)):
        point = _point(box.text, corner, _CORNER[inclusion], FENCE, _GLOBAL)
        yield point._replace(params=(float(len(corners)), 0.0, 0.0, 0.0))


def _rally(rally: Members) -> Iterator[Item]:
    """Yield the rally points."""
    if rally.box.get("points") is not None:
        for point in arrays(rally.text, rally.array("points"), (2, 3)):
            yield _point(rally.text, point, _RALLY, RALLY, _ABOVE_HOME)


def _point(text: Text, place: Array, command: int, mission_type: int, frame: int) -> Item:
    """Return an item that is a bare place: latitude, longitude and perhaps a height."""
    lat, lon, z = numbers(text, place) + [0.0] * (3 - len(place))
    at, (north, east) = place.at + [-1] * (3 - len(place)), place[:2]
    return Item(
        mission_type=mission_type,
        command=command,
        frame=frame,
        params=(0.0, 0.0, 0.0, 0.0),
        x=lat,
        y=lon,
        z=z,
        places=Places(place.begin, place.end, x=at[0], y=at[1], z=at[2]),
        said=Said(x_decimals=decimals(north), y_decimals=decimals(east)),
    )
