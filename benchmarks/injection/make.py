"""Making recordings: clean streams added to one, mistakes written into one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from benchmarks.injection.log import AUTOPILOT, Change, Columns, Log, Rows, put
from benchmarks.injection.plan import Mistake, Stream
from benchmarks.injection.words import Scope, evaluate
from mavframecheck.wire import Layout, Table
from mavframecheck.wire.encode import encode_frame, stamped

SENDERS = {
    "companion": (None, 192),
    "camera": (None, 100),
    "gimbal": (None, 154),
    "adsb": (None, 156),
    "autopilot": (None, AUTOPILOT),
    "gcs": (255, 195),
}
"""System and component of what is added, None for the vehicle's system."""


class Made(NamedTuple):
    """A recording with a mistake in it, and how many messages hold it."""

    data: bytes
    rows: int


def with_streams(log: Log, streams: Iterable[Stream]) -> bytes:
    """Return the recording with clean messages added, as far as its telemetry provides them."""
    added: dict[int, bytes] = defaultdict(bytes)
    for stream in streams:
        for number, record in records_of(log, stream).items():
            added[number] += record
    return log.written({}, added)


PLACED = "(vehicle.lat != 0)"
"""Before, the telemetry says nothing that messages could be made of."""


def records_of(log: Log, stream: Stream, condition: str = "True") -> dict[int, bytes]:
    """Return what a stream adds where `condition` holds: number of the frame that it follows -> record."""
    at = log.own(stream.at)
    if at is None:
        return {}
    text = f"{PLACED} & ({stream.when}) & ({stream.only}) & ({condition})"
    wanted = evaluate(text, Scope(log, at), len(at))
    rows = _spaced(log.seconds[at.frames.number], wanted, stream.every_s)[: stream.times]
    at = at.take(rows)
    layout = log.dialect.by_name[stream.message]
    columns = np.zeros(len(at), layout.dtype)
    _fill(columns, stream.fields, Scope(log, at))
    return _records(at, layout, columns, stream)


def _spaced(seconds: npt.NDArray[np.float64], wanted: npt.NDArray[np.bool_], every: float) -> Rows:
    """Return the wanted rows that are at least about `every` seconds apart."""
    rows = np.flatnonzero(wanted)
    _, first = np.unique(np.floor(seconds[rows] / every), return_index=True)
    spaced: Rows = rows[first]
    return spaced


def _fill(columns: Columns, fields: Mapping[str, str], scope: Scope) -> None:
    """Set fields to the values of expressions, all of them taken before any is set."""
    values = {name: evaluate(text, scope, len(columns)) for name, text in fields.items()}
    for name, value in values.items():
        put(columns, name, value)


def _records(at: Table, layout: Layout, columns: Columns, stream: Stream) -> dict[int, bytes]:
    """Return the messages as records, stamped as those that they follow."""
    system, component = SENDERS[stream.sender]
    vehicle = int(at.frames.sysid[0]) if len(at) else 0
    for target in ("target_system", "target_component"):
        if target in layout.by_name and stream.sender != "autopilot":
            columns[target] = vehicle if target == "target_system" else AUTOPILOT
    records = {}
    for seq, (number, t_us) in enumerate(zip(at.frames.number.tolist(), at.frames.t_us.tolist())):
        frame = encode_frame(
            layout,
            columns[seq].tobytes(),
            sysid=vehicle if system is None else system,
            compid=component,
            seq=seq,
        )
        records[number] = stamped(frame, t_us)
    return records


def with_mistake(log: Log, mistake: Mistake, condition: str) -> Made | None:
    """Return the recording with a mistake in the rows where `condition` holds, None where too few do."""
    if mistake.stream is not None:
        added = records_of(log, mistake.stream, condition)
        return Made(log.written({}, added), len(added)) if len(added) >= mistake.least else None
    table = log.tables.get(mistake.message)
    if table is None:
        return None
    mine = (table.frames.compid == AUTOPILOT) == (mistake.by == "autopilot")
    scope = Scope(log, table)
    holds = evaluate(f"({mistake.where}) & ({condition})", scope, len(table)).astype(np.bool_)
    rows = np.flatnonzero(mine & holds)[-mistake.times :]
    if len(rows) < mistake.least:
        return None
    wrong = table.take(rows)
    columns = wrong.columns.copy()
    _fill(columns, mistake.set, Scope(log, wrong))
    return Made(log.written({mistake.message: Change(rows, columns)}), len(rows))
