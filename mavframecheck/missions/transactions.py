"""Uploads and downloads of missions, fences and rally points, put together from their messages.

A transaction begins with MISSION_COUNT (or MISSION_WRITE_PARTIAL_LIST, or MISSION_CLEAR_ALL), goes on with
MISSION_ITEM or MISSION_ITEM_INT from the same sender to the same target, and ends with a MISSION_ACK, the next
beginning or the end of the recording. An item that is sent again replaces the first one. Where a recording has lost the beginning, the first items of a sender begin it.
Source: MAVLink developer guide, Mission Protocol.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mavframecheck.missions.items import Items, items_of, join
from mavframecheck.semantics.constants import constant
from mavframecheck.wire import Batch, Frames, Table

MAX_OPEN = 64
"""Transactions followed at once; the oldest one gives way."""
MAX_KEYS = 1024
"""Senders, targets and kinds that are told apart."""
MAX_ITEMS = 20_000
"""Items kept of one transaction."""

Key = tuple[int, int, int]
"""Sender (``sysid * 256 + compid``), target system, mission type."""

ACCEPTED = constant("MAV_MISSION_RESULT.ACCEPTED")
OUT_OF_TURN = constant("MAV_MISSION_RESULT.INVALID_SEQUENCE")
_ITEMS = ("MISSION_ITEM", "MISSION_ITEM_INT")
_GUIDED = (2, 3)
"""`current` of an item that is a target of guided flight, no part of a mission (ArduPilot)."""


@dataclass(slots=True)
class Mission:
    """A mission, fence or set of rally points that was sent over the link, or taken away."""

    sender: int
    """``sysid * 256 + compid`` of who sent the items."""
    target: int
    """System that they were sent to."""
    mission_type: int
    """MAV_MISSION_TYPE: 0 mission, 1 fence, 2 rally points, 255 all of them (to clear)."""
    count: int | None
    """Items announced; None where the recording has lost the announcement."""
    items: Items
    """In order of `seq`, each once."""
    answer: int | None
    """MAV_MISSION_RESULT of the MISSION_ACK, None when there was none."""
    began: Frames
    """(1,) the frame that began it."""
    ended: int
    """Running number of the last frame that belongs to it."""
    first: int = 0
    """`seq` of the first announced item: above 0 only where a part was written."""
    partial: bool = False
    """Whether only a part of a mission was written."""
    again: tuple[int, ...] = ()
    """`seq` of items that were sent again with another content."""

    @property
    def complete(self) -> bool:
        """Whether every announced item was seen."""
        return len(self.items) == self.count

    @property
    def accepted(self) -> bool:
        """Whether the other side said that it has it."""
        return self.answer == ACCEPTED


@dataclass(slots=True)
class _Open:
    began: Frames
    ended: int
    count: int | None
    first: int = 0
    partial: bool = False
    answer: int | None = None
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

    @property
    def says_something(self) -> bool:
        """Whether items came, or all are to be removed."""
        return bool(self.kept) or self.count == 0

    def is_begun_by(self, frames: Frames, row: int, count: int | None) -> bool:
        """Return whether a beginning is the one of this transaction, heard over a second link."""
        return int(frames.seq[row]) == int(self.began.seq[0]) and count == self.count

    def mission(self, key: Key) -> Mission:
        """Return what was sent."""
        self.settle()
        items = join(self.parts) if self.parts else _no_items(self.began)
        last, again = _last_of_each(items)
        return Mission(
            *key,
            self.count,
            items.take(last),
            self.answer,
            self.began,
            self.ended,
            self.first,
            self.partial,
            again,
        )


class Transactions:
    """Follows all transactions of a recording, batch by batch."""

    def __init__(self) -> None:
        """Start with none open."""
        self._open: dict[Key, _Open] = {}
        self._known: set[Key] = set()
        """Keys of which a beginning was seen, or made up."""

    def update(self, batch: Batch) -> Iterator[Mission]:
        """Take in a batch; yield the missions whose transaction ended in it."""
        readers: dict[str, Callable[[Table, int], Iterator[Mission]]] = {
            "MISSION_COUNT": self._count,
            "MISSION_WRITE_PARTIAL_LIST": self._part,
            "MISSION_CLEAR_ALL": self._clear,
            "MISSION_ACK": self._end,
            **dict.fromkeys(_ITEMS, self._add),
        }
        for _, name, table, row in _in_order(batch, tuple(readers)):
            yield from readers[name](table, row)
        for transaction in self._open.values():
            transaction.settle()

    def finish(self) -> Iterator[Mission]:
        """Yield the missions whose transaction never ended; more of them may come after all."""
        for key, transaction in self._open.items():
            if transaction.says_something:
                yield transaction.mission(key)

    def _count(self, table: Table, row: int) -> Iterator[Mission]:
        return self._begin(table, row, int(table["count"][row]))

    def _clear(self, table: Table, row: int) -> Iterator[Mission]:
        return self._begin(table, row, 0)

    def _part(self, table: Table, row: int) -> Iterator[Mission]:
        first, last = int(table["start_index"][row]), int(table["end_index"][row])
        count = last - first + 1 if last >= first else None  # -1: up to the last one
        return self._begin(table, row, count, first, partial=True)

    def _begin(
        self, table: Table, row: int, count: int | None, first: int = 0, *, partial: bool = False
    ) -> Iterator[Mission]:
        key = _key(table, row)
        before = self._open.get(key)
        if before is not None and before.is_begun_by(table.frames, row, count):
            return
        yield from self._close(key)
        if len(self._known) < MAX_KEYS:
            self._known.add(key)
        if len(self._open) >= MAX_OPEN:
            yield from self._close(next(iter(self._open)))
        began = table.frames.take(np.array([row])).own()
        self._open[key] = _Open(began, int(began.number[0]), count, first, partial)

    def _add(self, table: Table, row: int) -> Iterator[Mission]:
        key = _key(table, row)
        if int(table["current"][row]) in _GUIDED:
            return
        if key not in self._known and len(self._known) < MAX_KEYS:
            yield from self._begin(table, row, None)
        transaction = self._open.get(key)
        if transaction is not None and transaction.kept < MAX_ITEMS:
            transaction.rows.append((table, row))
            transaction.kept += 1
            transaction.ended = int(table.frames.number[row])

    def _end(self, table: Table, row: int) -> Iterator[Mission]:
        """Close the transaction that an acknowledgement answers: its sender was the target.

        An item out of turn is refused by itself, and its transaction goes on.
        """
        sysid, kind = int(table.frames.sysid[row]), int(table["mission_type"][row])
        answered, answer = int(table["target_system"][row]), int(table["type"][row])
        for key in list(self._open):
            if key[1:] == (sysid, kind) and key[0] >> 8 == answered:
                transaction = self._open[key]
                transaction.answer = answer
                transaction.ended = int(table.frames.number[row])
                if answer != OUT_OF_TURN:
                    yield from self._close(key)

    def _close(self, key: Key) -> Iterator[Mission]:
        transaction = self._open.pop(key, None)
        if transaction is not None and transaction.says_something:
            yield transaction.mission(key)


def _key(table: Table, row: int) -> Key:
    sender = int(table.frames.sysid[row]) * 256 + int(table.frames.compid[row])
    kind = int(table["mission_type"][row]) if "mission_type" in table.layout.by_name else 0
    return sender, int(table["target_system"][row]), kind


def _no_items(frames: Frames) -> Items:
    none = np.zeros(0, np.int64)
    empty = np.zeros(0)
    return Items(frames.take(none), none, none, none, np.zeros((0, 4)), empty, empty, empty)


def _last_of_each(items: Items) -> tuple[np.typing.NDArray[np.int64], tuple[int, ...]]:
    """Return the row of each `seq` that was sent last, and each `seq` that had another content before."""
    if (np.diff(items.seq) > 0).all():
        return np.arange(len(items)), ()
    backwards = items.seq[::-1]
    _, place, which = np.unique(backwards, return_index=True, return_inverse=True)
    last = len(items) - 1 - place
    final = last[which][::-1]
    same = np.ones(len(items), np.bool_)
    for name in ("command", "frame", "x", "y", "z"):
        column = getattr(items, name)
        same &= (column == column[final]) | (np.isnan(column) & np.isnan(column[final]))
    return last, tuple(np.unique(items.seq[~same]).tolist())


def _in_order(batch: Batch, names: tuple[str, ...]) -> list[tuple[int, str, Table, int]]:
    """Return (frame number, message, table, row) of all mission messages of a batch, in frame order.

    Transactions are tens of messages in a recording of many thousands: the one place past `wire` that
    goes through them one by one.
    """
    found = []
    for name in names:
        table = batch.tables.get(name)
        if table is not None:
            numbers = table.frames.number.tolist()
            found += [(number, name, table, row) for row, number in enumerate(numbers)]
    return sorted(found, key=lambda entry: entry[0])
