"""Recordings of mission transfers, made message by message."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tests.strategies import START_US, frame

VEHICLE, OTHER, STATION = (1, 1), (2, 1), (255, 190)
WAYPOINT, TAKEOFF, LAND, JUMP = 16, 22, 21, 177
SEA, HOME = 0, 3
LAT, LON = 473_977_420, 85_455_940
ACCEPTED, ERROR, OUT_OF_TURN = 0, 1, 13

Sender = tuple[int, int]
Fields = dict[str, Any]


def waypoints(count: int, **changes: Any) -> list[Fields]:
    """Return items, 111 m apart to the north and 20 m above home."""
    item = {"command": WAYPOINT, "frame": HOME, "y": LON, "z": 20.0, **changes}
    return [{"seq": seq, "x": LAT + 10_000 * seq, **item} for seq in range(count)]


class Transfers:
    """A recording that grows, a tenth of a second per message."""

    def __init__(self) -> None:
        self.frames: list[bytes] = []

    @property
    def data(self) -> bytes:
        return b"".join(self.frames)

    def say(self, name: str, sender: Sender, **fields: Any) -> Transfers:
        """Append a message."""
        number = len(self.frames)
        stamp = (START_US + 100_000 * number).to_bytes(8, "big")
        self.frames.append(stamp + frame(name, fields, sender, seq=number % 256))
        return self

    def again(self, back: int = 1) -> Transfers:
        """Append a message as it was heard over another link."""
        self.frames.append(self.frames[-back])
        return self

    def alive(self, autopilot: int = 12, vehicle: Sender = VEHICLE) -> Transfers:
        return self.say("HEARTBEAT", vehicle, type=2, autopilot=autopilot)

    def home(self, height_m: float, north_deg: float = 0.0) -> Transfers:
        lat = LAT + round(north_deg * 1e7)
        at = {"latitude": lat, "longitude": LON, "altitude": round(height_m * 1e3)}
        return self.say("HOME_POSITION", VEHICLE, q=[1.0, 0, 0, 0], **at)

    def count(self, count: int, vehicle: Sender = VEHICLE, kind: int = 0) -> Transfers:
        to = {"target_system": vehicle[0], "target_component": 1, "mission_type": kind}
        return self.say("MISSION_COUNT", STATION, count=count, **to)

    def items(self, items: Sequence[Fields], vehicle: Sender = VEHICLE, kind: int = 0) -> Transfers:
        to = {"target_system": vehicle[0], "target_component": 1, "mission_type": kind}
        for item in items:
            self.say("MISSION_ITEM_INT", STATION, **{**to, **item})
        return self

    def acknowledge(
        self, answer: int = ACCEPTED, vehicle: Sender = VEHICLE, kind: int = 0
    ) -> Transfers:
        back = {"target_system": 255, "target_component": 190, "mission_type": kind}
        return self.say("MISSION_ACK", vehicle, type=answer, **back)

    def upload(self, items: Sequence[Fields], answer: int = ACCEPTED, kind: int = 0) -> Transfers:
        return (
            self.count(len(items), kind=kind).items(items, kind=kind).acknowledge(answer, kind=kind)
        )

    def download(self, items: Sequence[Fields], vehicle: Sender = VEHICLE) -> Transfers:
        back = {"target_system": 255, "target_component": 190}
        self.say("MISSION_REQUEST_LIST", STATION, target_system=vehicle[0], target_component=1)
        self.say("MISSION_COUNT", vehicle, count=len(items), **back)
        for item in items:
            self.say("MISSION_ITEM_INT", vehicle, **{**back, **item})
        to = {"target_system": vehicle[0], "target_component": 1}
        return self.say("MISSION_ACK", STATION, type=ACCEPTED, **to)
