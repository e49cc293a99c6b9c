"""`inspect --missions`: transfers and what vehicles hold, as tables, as JSON, and as mission files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from mavframecheck.model.missions import FileMissions, HeldMission, ItemEntry, Transfer
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import FilePage
from mavframecheck.report.words import plural

Row = tuple[str, ...]
KINDS = {0: "mission", 1: "fence", 2: "rally points", 255: "everything"}
MISSION, FENCE, RALLY = 0, 1, 2
_ALTITUDE_MODES = {0: 2, 5: 2, 3: 1, 6: 1, 10: 4, 11: 4}
"""MAV_FRAME -> AltitudeMode of QGroundControl: 1 above launch, 2 above sea level, 4 in the terrain frame."""
_JUMP = "DO_JUMP"
_PX4, _ARDUPILOT, _GENERIC = 12, 3, 0
"""MAV_AUTOPILOT."""
_SPEEDS = {"cruiseSpeed": 15, "hoverSpeed": 5}


class MissionPage(FilePage[FileMissions]):
    """Writes the missions of recordings for one context."""

    def file(self, found: FileMissions) -> Iterator[str]:
        """Yield the head, the transfers, and the items that each vehicle holds."""
        yield self.bold(sentence(found.path))
        for note in found.notes:
            yield from self.wrap(f"note: {note}", "  ", "    ")
        if not found.transfers:
            yield from self.wrap("no mission was sent, asked for or removed", "  ")
            return
        head = ("when", "what", "system", "kind", "by", "items", "answer")
        yield f"  {self.bold('Transfers')}"
        yield from self._table(head, [_row(each, found.time_start) for each in found.transfers])
        for held in found.held:
            yield ""
            yield self.paint(f"  system {held.system}: {_words(held)}", "cyan")
            if held.items:
                head = ("seq", "command", "frame", "x", "y", "z", "params")
                yield from self._table(head, [_item(item) for item in held.items])

    def _table(self, head: Row, rows: Sequence[Row]) -> Iterator[str]:
        """Yield a table, its columns as wide as they need; long ones run on at the end of the line."""
        widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        for number, row in enumerate((head, *rows)):
            cells = "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True))
            line = f"    {cells.rstrip()}"
            yield line if number else self.dim(line)


def _row(transfer: Transfer, start: float | None) -> Row:
    known = transfer.time is not None and start is not None
    when = f"{(transfer.time or 0) - (start or 0):.1f} s" if known else f"byte {transfer.offset}"
    count = "?" if transfer.count is None else str(transfer.count)
    seen = (
        str(transfer.items) if transfer.items == transfer.count else f"{transfer.items} of {count}"
    )
    kind = KINDS.get(transfer.mission_type, str(transfer.mission_type))
    answer = transfer.answer or "-"
    return when, transfer.what, str(transfer.system), kind, transfer.sender, seen, answer


def _words(held: HeldMission) -> str:
    kind = KINDS.get(held.mission_type, str(held.mission_type))
    if held.known == "not known":
        return f"{kind} not known: an upload was not accepted, or not answered"
    if not held.count:
        return f"{kind}: none ({held.known})"
    lost = f", {plural(held.count - len(held.items), 'item')} not seen"
    return f"{kind}, {plural(held.count, 'item')} ({held.known}){lost if held.count > len(held.items) else ''}"


def _item(item: ItemEntry) -> Row:
    degrees = item.frame_name.startswith("GLOBAL")
    x, y = (_number(value, 7 if degrees else 2) for value in (item.x, item.y))
    params = ", ".join(_number(value, 3) for value in item.params)
    return str(item.seq), item.command_name, item.frame_name, x, y, _number(item.z, 2), params


def _number(value: float | None, digits: int) -> str:
    if value is None:
        return "NaN"
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def waypoints(held: Sequence[HeldMission]) -> str:
    """Return the mission of a vehicle as a waypoint file (QGC WPL 110)."""
    lines = ["QGC WPL 110"]
    for item in _of(held, MISSION):
        values = [*item.params, item.x, item.y, item.z]
        numbers = "\t".join(f"{_or_nan(value):.8f}" for value in values)
        current = int(item.seq == 0)
        lines.append(f"{item.seq}\t{current}\t{item.frame}\t{item.command}\t{numbers}\t1")
    return "".join(f"{line}\n" for line in lines)


def plan(held: Sequence[HeldMission]) -> dict[str, object]:
    """Return mission, fence and rally points of a vehicle as a QGroundControl plan, to be written as JSON.

    ArduPilot keeps home in item 0; a plan keeps it by itself, so that there item 1 is the first one.
    """
    autopilot = next((each.autopilot for each in held if each.autopilot), None)
    ardupilot = autopilot is not None and autopilot.startswith("ardu")
    items = _of(held, MISSION)
    home = _first_place(held)
    if ardupilot and items and items[0].seq == 0:
        home = [_or_zero(value) for value in (items[0].x, items[0].y, items[0].z)]
        items = items[1:]
    shift = 0 if ardupilot else 1
    vehicle_type = next((each.vehicle_type for each in held if each.vehicle_type is not None), 2)
    firmware = _ARDUPILOT if ardupilot else _PX4 if autopilot == "px4" else _GENERIC
    return {
        "fileType": "Plan",
        "geoFence": _fence(_of(held, FENCE)),
        "groundStation": "mavframecheck",
        "mission": {
            **_SPEEDS,
            "firmwareType": firmware,
            "globalPlanAltitudeMode": 0,
            "items": [_simple(item, shift) for item in items],
            "plannedHomePosition": home,
            "vehicleType": vehicle_type,
            "version": 2,
        },
        "rallyPoints": {
            "points": [[item.x, item.y, item.z] for item in _of(held, RALLY)],
            "version": 2,
        },
        "version": 1,
    }


def _of(held: Sequence[HeldMission], mission_type: int) -> tuple[ItemEntry, ...]:
    return next((each.items for each in held if each.mission_type == mission_type), ())


def _first_place(held: Sequence[HeldMission]) -> list[float]:
    """Return the first place that any item names: a plan has to say where home is."""
    for item in (item for each in held for item in each.items):
        if item.frame_name.startswith("GLOBAL") and (item.x or item.y):
            return [_or_zero(item.x), _or_zero(item.y), 0.0]
    return [0.0, 0.0, 0.0]


def _simple(item: ItemEntry, shift: int) -> dict[str, object]:
    """Return an item of a plan; items are numbered from 1 there, and jumps go to that number."""
    params = [*item.params, item.x, item.y, item.z]
    if item.command_name == _JUMP and params[0] is not None:
        params[0] += shift
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": item.z,
        "AltitudeMode": _ALTITUDE_MODES.get(item.frame, 0),
        "autoContinue": True,
        "command": item.command,
        "doJumpId": item.seq + shift,
        "frame": item.frame,
        "params": params,
        "type": "SimpleItem",
    }


def _fence(items: Sequence[ItemEntry]) -> dict[str, object]:
    """Return circles and polygons of a fence; a polygon has as many corners as its first one says."""
    circles, polygons = [], []
    rest = list(items)
    while rest:
        item = rest.pop(0)
        inclusion = item.command_name.endswith("INCLUSION")
        if "POLYGON" in item.command_name:
            more = max(int(_or_zero(item.params[0])) - 1, 0)
            corners = [item, *rest[:more]]
            rest = rest[more:]
            path = [[corner.x, corner.y] for corner in corners]
            polygons.append({"inclusion": inclusion, "polygon": path, "version": 1})
        elif "CIRCLE" in item.command_name:
            circle = {"center": [item.x, item.y], "radius": item.params[0]}
            circles.append({"circle": circle, "inclusion": inclusion, "version": 1})
    return {"circles": circles, "polygons": polygons, "version": 2}


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _or_zero(value: float | None) -> float:
    return 0.0 if value is None else value
