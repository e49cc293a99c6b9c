"""A mission file as read: its items in the order in which they would be sent, with where each number stands.

Readers (`plan`, `wpl`, `points`) make a `Planned`; `upload` turns it into the batch that rules judge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from mavframecheck.missions.text import Text

MISSION, FENCE, RALLY = 0, 1, 2
"""MAV_MISSION_TYPE."""
MOST_ITEMS = 65_535
"""MISSION_COUNT.count has 16 bits: a longer mission cannot be sent."""
UNSAID: Final = math.nan
"""What a file does not say."""


class Said(NamedTuple):
    """What only the file says of an item, and no message can carry; NaN where it does not say it."""

    x_decimals: float = UNSAID
    """Digits after the decimal point of latitude, as written."""
    y_decimals: float = UNSAID
    """The same of longitude."""
    number: float = UNSAID
    """The number that the file gives the item: `doJumpId` of a plan, first column of a waypoint file."""
    altitude: float = UNSAID
    """`Altitude` of a QGroundControl item, m; what param7 is made from."""
    altitude_mode: float = UNSAID
    """`AltitudeMode` of a QGroundControl item; two numberings are in the field."""
    terrain_altitude: float = UNSAID
    """`AMSLAltAboveTerrain` of a QGroundControl item, m."""
    plan_altitude_mode: float = UNSAID
    """`globalPlanAltitudeMode` of the plan."""
    complex_item: float = UNSAID
    """Running number of the survey, corridor... that generated the item."""


SAID: Final = tuple(f"file_{name}" for name in Said._fields)
"""Names under which rules see `Said`: ``optional(file_x_decimals)``, ``items.said["file_altitude"]``."""


class Places(NamedTuple):
    """Where an item and its parts stand in the text: offsets in characters; -1 where a part is not written."""

    item: int
    end: int
    """Where the item ends."""
    command: int = -1
    frame: int = -1
    param1: int = -1
    param2: int = -1
    param3: int = -1
    param4: int = -1
    x: int = -1
    y: int = -1
    z: int = -1


class LaterPlaces:
    """Places that are worked out when somebody asks: of a large mission that is a few."""

    __slots__ = ("_find", "_found")

    def __init__(self, find: Callable[[], Places]) -> None:
        """Ask `find` once, if ever."""
        self._find = find
        self._found: Places | None = None

    def __getattr__(self, name: str) -> Any:
        """Return what `Places` has of this name."""
        if self._found is None:
            self._found = self._find()
        return getattr(self._found, name)


class Item(NamedTuple):
    """An item as the file has it: latitude and longitude in degrees, a null as NaN."""

    mission_type: int
    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: float
    y: float
    z: float
    places: Places | LaterPlaces
    current: int = 0
    autocontinue: int = 1
    said: Said = Said()


class Home(NamedTuple):
    """Where the file says home is, degrees and metres above mean sea level; NaN where it does not."""

    lat: float
    lon: float
    alt_msl: float
    at: int
    """Where in the text it stands."""


@dataclass(slots=True)
class Planned:
    """A mission file."""

    kind: str
    """``plan``, ``wpl``, ``fence points``..."""
    text: Text
    items: list[Item]
    home: Home | None = None
    autopilot: int | None = None
    """MAV_AUTOPILOT (`firmwareType`), None where the file does not say."""
    vehicle_type: int | None = None
    """MAV_TYPE (`vehicleType`)."""
    notes: list[str] = field(default_factory=list)
    """What a reader of the report should know."""


def bounded(text: Text, items: Iterable[Item]) -> Iterator[Item]:
    """Yield the items of a file; MissionError at the first one too many."""
    for count, item in enumerate(items):
        if count >= MOST_ITEMS:
            text.fail(item.places.item, f"more than {MOST_ITEMS} items cannot be sent to a vehicle")
        yield item
