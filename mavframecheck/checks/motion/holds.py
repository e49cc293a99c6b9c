"""Setpoints that stay the same for a while: what a vehicle was asked for, long enough to see what it did."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.setpoints import GLOBAL, LOCAL, Stream, streams
from mavframecheck.semantics.names import family, mode_name
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Place, Table

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

FIELDS = ("x", "y", "z", "vx", "vy", "vz", "yaw", "yaw_rate")
OBEYING = ("GUIDED", "OFFBOARD")
"""Flight modes in which setpoints are flown."""
MIN_HOLD_S = 2.0
"""What lasts less, s of receive time, shows no response."""
MAX_HOLDS = 2000
"""Holds that are kept, of all streams together."""
MAX_STREAMS = 64
MAX_INTERRUPTIONS = 20_000
_ARMED = 128


@dataclass(slots=True)
class Hold:
    """One setpoint, sent once or over and over."""

    sender: int
    system: int
    """The vehicle that it is for."""
    message: str
    frame: int
    mask: int
    wanted: Floats
    """(8,) `FIELDS`; those of GLOBAL_INT have no place here: x, y and z are NaN."""
    start_s: float
    last_s: float
    """Receive time of the first and the last row."""
    first: Place
    last: Place
    rows: int
    until_s: float = np.inf
    """When something else was asked for, or the vehicle left the mode in which it listens."""


class Holds:
    """The setpoints of a recording that last, batch by batch."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.kept: list[Hold] = []
        self.senders: set[int] = set()
        """Who sent setpoints."""
        self._open: dict[tuple[int, int, str], Hold] = {}
        """The last setpoint of each stream: sender, system and message."""
        self._interruptions: list[tuple[float, int]] = []
        """When a vehicle left, or entered, a mode in which it listens; and its system."""
        self._obeys: dict[int, bool] = {}

    def update(self, batch: Batch, context: Context, t0_us: int) -> None:
        """Take in a batch; times count from `t0_us`."""
        heartbeats = batch.tables.get("HEARTBEAT")
        if heartbeats is not None:
            self._watch(heartbeats, t0_us)
        found: list[Hold] = []
        for stream in streams(batch, context, (LOCAL, GLOBAL)):
            table = stream.table.take(stream.table.frames.t_valid)
            if len(table):
                system = int(context.about(table)[0])
                if len(self.senders) < MAX_STREAMS:
                    self.senders.add(stream.sender)
                found += _holds(stream._replace(table=table), system, t0_us)
        for hold in sorted(found, key=lambda each: each.first.number):
            self._add(hold)

    def _watch(self, table: Table, t0_us: int) -> None:
        """Note when a vehicle begins and ends to obey setpoints."""
        table = table.take(table.frames.t_valid & (table["autopilot"] != 8))
        kind = table["custom_mode"].astype(np.int64) << 8 | table["base_mode"] & _ARMED
        for system in np.unique(table.frames.sysid).tolist():
            rows = np.flatnonzero(table.frames.sysid == system)
            for row in rows[np.diff(kind[rows], prepend=-1) != 0].tolist():
                pilot = family(int(table["autopilot"][row]), int(table["type"][row]))
                mode = mode_name(pilot, int(table["custom_mode"][row]))
                obeys = mode in OBEYING and bool(table["base_mode"][row] & _ARMED)
                if self._obeys.get(system) != obeys:
                    self._obeys[system] = obeys
                    at = (int(table.frames.t_us[row]) - t0_us) * 1e-6
                    if len(self._interruptions) < MAX_INTERRUPTIONS:
                        self._interruptions.append((at, system if obeys else -system))

    def _add(self, hold: Hold) -> None:
        key = (hold.sender, hold.system, hold.message)
        before = self._open.get(key)
        if before is not None and _equal(before, hold):
            before.last_s, before.last, before.rows = (
                hold.last_s,
                hold.last,
                before.rows + hold.rows,
            )
            return
        for other in self._open.values():
            if other.system == hold.system:
                other.until_s = min(other.until_s, hold.start_s)
        if before is not None:
            self._close(before)
        if before is not None or len(self._open) < MAX_STREAMS:
            self._open[key] = hold

    def _close(self, hold: Hold) -> None:
        if hold.until_s - hold.start_s >= MIN_HOLD_S and len(self.kept) < MAX_HOLDS:
            self.kept.append(hold)

    def finish(self) -> list[Hold]:
        """Return the holds that lasted, each up to when something else began, in the order of time."""
        holds = sorted([*self.kept, *self._open.values()], key=lambda hold: hold.start_s)
        return [
            each for each in map(self._ended, holds) if each.until_s - each.start_s >= MIN_HOLD_S
        ]

    def _ended(self, hold: Hold) -> Hold:
        """Return a hold that ends with the mode it was sent in; one sent in another mode ends at once."""
        turns = [(at, who > 0) for at, who in self._interruptions if abs(who) == hold.system]
        obeys = [now for at, now in turns if at <= hold.start_s]
        if not (obeys and obeys[-1]):
            return replace(hold, until_s=hold.start_s)
        after = [at for at, now in turns if at > hold.start_s and not now]
        return replace(hold, until_s=min([hold.until_s, *after]))


def _holds(stream: Stream, system: int, t0_us: int) -> list[Hold]:
    """Return the rows of a stream, equal neighbours put together."""
    table = stream.table
    fields = [table[name] if name in table.layout.by_name else _nothing(table) for name in FIELDS]
    wanted = np.column_stack([each.astype(np.float64) for each in fields])
    frame = table["coordinate_frame"].astype(np.int64)
    mask = table["type_mask"].astype(np.int64)
    same = np.nan_to_num(np.column_stack((frame, mask, wanted)), nan=-1e30)
    t = (table.frames.t_us - t0_us) * 1e-6
    begins = (np.flatnonzero(np.any(same[1:] != same[:-1], axis=1)) + 1).tolist()
    return [
        Hold(
            stream.sender,
            system,
            table.name,
            int(frame[start]),
            int(mask[start]),
            wanted[start],
            float(t[start]),
            float(t[stop - 1]),
            table.frames.place(start),
            table.frames.place(stop - 1),
            stop - start,
        )
        for start, stop in zip([0, *begins], [*begins, len(t)], strict=True)
    ]


def _equal(a: Hold, b: Hold) -> bool:
    same = a.frame == b.frame and a.mask == b.mask and a.system == b.system
    return same and np.array_equal(a.wanted, b.wanted, equal_nan=True)


def _nothing(table: Table) -> Floats:
    return np.full(len(table), np.nan)
