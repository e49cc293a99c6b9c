"""Transfers of missions in a recording, and what vehicles hold, as `inspect --missions` shows them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.missions import Held, Items, Ledger, Mission, Transactions
from mavframecheck.model.missions import FileMissions, HeldMission, ItemEntry, Transfer
from mavframecheck.semantics.constants import entry_name
from mavframecheck.semantics.mavframe import frame_name
from mavframecheck.sources import open_recording
from mavframecheck.vehicle import Context
from mavframecheck.wire import load_dialect

_DIGITS = 9
"""Of a coordinate: more than any message holds."""
MAX_TRANSFERS = 2000
MAX_ITEMS = 200_000
"""Transfers that are kept, and items in them."""


def missions_of_file(
    path: str, settings: Settings, progress: Progress | None = None
) -> FileMissions:
    """Read the recording at `path` (``-``: standard input) for its missions.

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` when the dialect cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    with open_recording(path, settings.input_kind) as recording:
        reading = Reading(recording, settings, dialect)
        transactions, found = Transactions(), _Kept()
        for batch in reading.understood(progress):
            found.add(transactions.update(batch))
        found.add(transactions.finish())
        context = reading.context
        ledger = Ledger(lambda sender: _is_autopilot(context, sender)).enter(found.missions)
        return FileMissions(
            **reading.summary(),
            transfers=tuple(_transfer(mission, context) for mission in found.missions),
            held=tuple(_held(each, context) for _, each in sorted(ledger.held.items())),
        )


class _Kept:
    """The missions of a recording, as many as are kept."""

    def __init__(self) -> None:
        self.missions: list[Mission] = []
        self._items = 0

    def add(self, missions: Iterable[Mission]) -> None:
        for mission in missions:
            if len(self.missions) < MAX_TRANSFERS and self._items < MAX_ITEMS:
                self.missions.append(mission)
                self._items += len(mission.items)


def _is_autopilot(context: Context, sender: int) -> bool:
    return context.role(sender) == "autopilot"


def _transfer(mission: Mission, context: Context) -> Transfer:
    own = _is_autopilot(context, mission.sender)
    what = "partial upload" if mission.partial else "upload" if mission.count != 0 else "clear"
    answer = mission.answer
    return Transfer(
        what="download" if own else what,
        sender=f"{mission.sender >> 8}/{mission.sender & 0xFF}",
        system=mission.sender >> 8 if own else mission.target,
        mission_type=mission.mission_type,
        count=mission.count,
        items=len(mission.items),
        answer=None if answer is None else entry_name("MAV_MISSION_RESULT", answer),
        time=int(mission.began.t_us[0]) * 1e-6 if mission.began.t_valid[0] else None,
        offset=int(mission.began.offset[0]),
    )


def _held(held: Held, context: Context) -> HeldMission:
    mav_type = context.last("vehicle.type", held.system)
    return HeldMission(
        system=held.system,
        autopilot=context.last("vehicle.autopilot", held.system),
        vehicle_type=None if mav_type is None else int(mav_type),
        mission_type=held.mission_type,
        known=held.known,
        count=held.count,
        items=tuple(_item(held.items, row) for row in range(len(held.items))),
    )


def _item(items: Items, row: int) -> ItemEntry:
    command, frame = int(items.command[row]), int(items.frame[row])
    first, second, third, fourth = (_given(value) for value in items.params[row].tolist())
    return ItemEntry(
        seq=int(items.seq[row]),
        command=command,
        command_name=entry_name("MAV_CMD", command),
        frame=frame,
        frame_name=frame_name(frame),
        params=(first, second, third, fourth),
        x=_given(round(float(items.x[row]), _DIGITS)),
        y=_given(round(float(items.y[row]), _DIGITS)),
        z=_given(float(items.z[row])),
    )


def _given(value: float) -> float | None:
    return value if math.isfinite(value) else None
