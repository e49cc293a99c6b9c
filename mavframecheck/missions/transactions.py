"""Uploads and downloads of missions, fences and rally points, put together from their messages.

A transaction begins with MISSION_COUNT, goes on with MISSION_ITEM or MISSION_ITEM_INT from the same sender
to the same target, and ends with a MISSION_ACK, the next MISSION_COUNT or the end of the recording. An item
that is sent again replaces the first one. Source: MAVLink developer guide, Mission Protocol.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from mavframecheck.missions.items import Items, items_of, join
from mavframecheck.wire import Batch, Table

MAX_OPEN = 64
"""Transactions followed at once."""
MAX_ITEMS = 20_000
"""Items kept of one transaction."""

Key = tuple[int, int, int]
"""Sender (``sysid * 256 + compid``), target system, mission type."""


@dataclass(slots=True)
class Mission:
    """A mission, fence or set of rally points that was sent over the link."""

    sender: int
    """``sysid * 256 + compid`` of who sent the items."""
    target: int
    """System that they were sent to."""
    mission_type: int
    """MAV_MISSION_TYPE: 0 mission, 1 fence, 2 rally points."""
    count: int
    """Items announced by MISSION_COUNT."""
    items: Items
    """In order of `seq`, each once."""
    answer: int | None
    """MAV_MISSION_RESULT of the MISSION_ACK, None when there was none."""

    @property
    def complete(self) -> bool:
        """Whether every announced item was seen."""
        return len(self.items) == self.count


@dataclass(slots=True)
class _Open:
    count: int
    parts: list[Items] = field(default_factory=list)
    rows: list[tuple[Table, int]] = field(default_factory=list)
    """Items of the current batch, in order."""
    kept: int = 0

    def settle(self) -> None:
        """Turn the items of the current batch into columns that do not hold on to it."""
        for table, rows in itertools.groupby(self.rows, key=lambda entry: entry[0]):
            picked = np.array([row for _, row in rows])
            self.parts.append(items_of(table.take(picked).compact()))
        self.rows.clear()


class Transactions:
    """Follows all transactions of a recording, batch by batch."""

    def __init__(self) -> None:
        """Start with none open."""
        self._open: dict[Key, _Open] = {}

    def update(self, batch: Batch) -> Iterator[Mission]:
        """Take in a batch; yield the missions whose transaction ended in it."""
        for _, name, table, row in _in_order(batch):
            if name == "MISSION_COUNT":
                yield from self._begin(table, row)
            elif name == "MISSION_ACK":
                yield from self._end(table, row)
            else:
                self._add(table, row)
        for transaction in self._open.values():
            transaction.settle()

    def finish(self) -> Iterator[Mission]:
        """Yield the missions whose transaction never ended."""
        for key in list(self._open):
            yield from self._close(key, None)

    def _begin(self, table: Table, row: int) -> Iterator[Mission]:
        key = _key(table, row)
        yield from self._close(key, None)
        if len(self._open) < MAX_OPEN:
            self._open[key] = _Open(int(table["count"][row]))

    def _add(self, table: Table, row: int) -> None:
        transaction = self._open.get(_key(table, row))
        if transaction is not None and transaction.kept < MAX_ITEMS:
            transaction.rows.append((table, row))
            transaction.kept += 1

    def _end(self, table: Table, row: int) -> Iterator[Mission]:
        """Close the transaction that an acknowledgement answers: its sender was the target."""
        sysid, kind = int(table.frames.sysid[row]), int(table["mission_type"][row])
        answered = int(table["target_system"][row])
        for key in list(self._open):
            if key[1:] == (sysid, kind) and key[0] >> 8 == answered:
                yield from self._close(key, int(table["type"][row]))

    def _close(self, key: Key, answer: int | None) -> Iterator[Mission]:
        transaction = self._open.pop(key, None)
        if transaction is not None and transaction.kept:
            transaction.settle()
            items = join(transaction.parts)
            backwards = items.seq[::-1]
            last = len(items) - 1 - np.unique(backwards, return_index=True)[1]
            yield Mission(*key, transaction.count, items.take(last), answer)


def _key(table: Table, row: int) -> Key:
    sender = int(table.frames.sysid[row]) * 256 + int(table.frames.compid[row])
    return sender, int(table["target_system"][row]), int(table["mission_type"][row])


def _in_order(batch: Batch) -> list[tuple[int, str, Table, int]]:
    """Return (frame number, message, table, row) of all mission messages of a batch, in frame order.

    Transactions are tens of messages in a recording of many thousands: the one place past `wire` that
    goes through them one by one.
    """
    found = []
    for name in ("MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_ACK"):
        table = batch.tables.get(name)
        if table is not None:
            numbers = table.frames.number.tolist()
            found += [(number, name, table, row) for row, number in enumerate(numbers)]
    return sorted(found, key=lambda entry: entry[0])
