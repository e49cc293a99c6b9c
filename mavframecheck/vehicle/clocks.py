"""What stamps say beside receive times: one record per (sender, message, stamp field), fed batch by batch.

A record keeps counts, the places where stamps step back or stand still, and *knots*: for each stretch of
the recording (so many frames, more as it grows, at most `MAX_KNOTS`) the first and the last row, and the
one that came soonest after its stamp. Stretches are counted in frames because receive times may go back;
so nothing depends on where batches are cut, and memory does not grow. `timing` draws the conclusions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics import catalogue
from mavframecheck.semantics.enums import Clock, Quantity
from mavframecheck.vehicle.timesync import Exchanges
from mavframecheck.wire import Batch, Frames, Layout, Place, Table

MAX_STREAMS = 512
"""Streams whose stamps are followed, in the order in which they are first heard."""
MAX_KNOTS = 512
"""Stretches that a recording is divided into."""
MAX_EVENTS = 64
"""Backward steps, and stamps standing still, that are kept of one stream; all are counted."""
UNIX_S = 1_000_000_000
"""A stamp from here on counts from 1970 (2001-09-09), before it from a boot (31 years)."""
_STILL_US = 1_000_000
"""Shorter than this (us) a stamp that stands still is not worth a record."""

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Knots = npt.NDArray[Any]

KNOT = np.dtype(
    [
        (name, np.int64)
        for name in (
            *("stretch", "rows", "number", "t_us", "stamp", "offset", "size"),
            *("last_number", "last_t_us", "last_stamp", "low_t_us", "low_stamp"),
        )
    ]
)
"""A stretch of one stream: its rows, the first (`number`, receive time, stamp, bytes), the last, and the
one with the least receive time minus stamp. Stamps are as on the wire."""


class StampField(NamedTuple):
    """A field that stamps its message, as the catalogue has it."""

    name: str
    unit_us: float
    """Length of its unit, us."""
    clock: Clock
    bits: int
    """Width on the wire."""


class StampKey(NamedTuple):
    """Stamps that follow each other."""

    sender: int
    """``sysid * 256 + compid``."""
    message: str
    field: str
    target: int
    """System that it is addressed to: who speaks to two vehicles may stamp by two clocks."""
    instance: int


class StepBack(NamedTuple):
    """Two neighbours of a stream of which the second has the earlier stamp."""

    before: Place
    after: Place
    stamp_before: int
    stamp_after: int
    sent_between: int
    """How far the sender's sequence counter went, 0..255: from 128 on the second one was sent first."""


class Still(NamedTuple):
    """A stamp that stayed while the rest of the message changed."""

    first: Place
    last: Place
    seconds: float
    """Receive time."""
    rows: int
    changed: int
    """Rows that differ from the one before in more than the stamp."""
    stamp: int


_OWN_ROWS: dict[tuple[str, str], Callable[[Table], Bools]] = {
    ("TIMESYNC", "ts1"): lambda table: np.asarray(table["tc1"] == 0),
    ("TIMESYNC", "tc1"): lambda table: np.asarray(table["tc1"] != 0),
    ("PING", "time_usec"): lambda table: np.asarray(table["target_system"] == 0),
}
"""Rows that hold the sender's own clock: an answer gives the clock of who asked back."""

_FOLLOWED = frozenset({Clock.BOOT, Clock.UNIX, Clock.AMBIGUOUS, Clock.SENDER})
_UNITS_US = {"ns": 1e-3, "us": 1.0, "ms": 1e3}


def stamp_fields(layout: Layout) -> tuple[StampField, ...]:
    """Return the fields of a message that are running clocks: not events, not weeks, not durations."""
    found = {}
    for tag in catalogue.tags(layout.name):
        plain = tag.field in layout.by_name and not tag.when and tag.unit in _UNITS_US
        if plain and tag.quantity == Quantity.TIMESTAMP and tag.clock in _FOLLOWED:
            dtype = layout.dtype[tag.field]
            if dtype.kind in "iu" and not dtype.shape:
                unit_us = _UNITS_US[tag.unit]
                found[tag.field] = StampField(tag.field, unit_us, tag.clock, dtype.itemsize * 8)
    return tuple(found.values())


@dataclass(slots=True)
class _Last:
    """The last stamped row of a stream."""

    seen: Place
    stamp: int
    seq: int
    payload: npt.NDArray[np.uint8]
    """Without the stamp."""


@dataclass(slots=True)
class _Run:
    """Rows with one stamp, of which more may come."""

    first: Place
    last: Place
    since_us: int
    until_us: int
    stamp: int
    rows: int = 1
    changed: int = 0


@dataclass(slots=True)
class StampStream:
    """The stamps of one field of one stream."""

    key: StampKey
    field: StampField
    rows: int = 0
    unset: int = 0
    """Rows whose stamp is 0 or all ones: the sender does not stamp."""
    repeated: int = 0
    """Rows with the stamp of the row before."""
    since_unix: int = 0
    """Rows whose stamp counts from 1970."""
    back: int = 0
    """Rows with an earlier stamp than the row before."""
    late: int = 0
    """Of these, rows that were sent before the row before: the way here changed their order."""
    first: Place | None = None
    last: Place | None = None
    """First and last stamped row."""
    first_stamp: int = 0
    backs: list[StepBack] = dataclasses.field(default_factory=list)
    epochs: list[StepBack] = dataclasses.field(default_factory=list)
    """Neighbours of which one counts from a boot and the other from 1970."""
    stills: list[Still] = dataclasses.field(default_factory=list)
    knots: Knots = dataclasses.field(default_factory=lambda: np.zeros(0, KNOT))
    level: int = 0
    _before: _Last | None = None
    _run: _Run | None = None

    @property
    def subject(self) -> tuple[int, int, str, str]:
        """Return sysid, compid, message, field."""
        return self.key.sender >> 8, self.key.sender & 0xFF, self.key.message, self.field.name

    @property
    def stamped(self) -> int:
        """Return the rows with a stamp."""
        return self.rows - self.unset

    @property
    def moves(self) -> int:
        """Return how often the stamp was another one than before."""
        return max(self.stamped - self.repeated - 1, 0)

    def add(self, table: Table, level: int) -> None:
        """Take in further rows, in stretches of ``2 ** level`` frames."""
        self.rows += len(table)
        stamps = _as_int64(table[self.field.name])
        highest = min(2**self.field.bits, 2**63) - 1
        if stamps.min() <= 0 or stamps.max() >= highest:
            given = (stamps > 0) & (stamps != highest) & (stamps != 2**63 - 1)
            self.unset += int(np.count_nonzero(~given))
            table, stamps = table.take(given), stamps[given]
        if not len(stamps):
            return
        self._compare(table, stamps)
        self._knot(table.frames, stamps, level)
        payload = self._payloads(table, slice(-1, None))[0]
        counter = int(table.frames.seq[-1])
        self._before = _Last(table.frames.place(-1), int(stamps[-1]), counter, payload)
        if self.first is None:
            self.first, self.first_stamp = table.frames.place(0), int(stamps[0])
        self.last = self._before.seen

    def _compare(self, table: Table, stamps: Ints) -> None:
        """Look at each row beside the one before it."""
        frames, last = table.frames, self._before
        before = np.concatenate(([stamps[0] - 1 if last is None else last.stamp], stamps[:-1]))
        step = stamps - before
        same = step == 0
        if step.min() <= 0:
            back = np.flatnonzero(step < 0)
            self.repeated += int(np.count_nonzero(same))
            self.back += len(back)
            self.late += int(np.count_nonzero(self._overtaken(frames, back)))
            self._note(self.backs, frames, stamps, back)
        self._note(self.epochs, frames, stamps, self._new_epochs(before, stamps))
        self._stand(table, stamps, same)

    def _new_epochs(self, before: Ints, stamps: Ints) -> Ints:
        """Count the rows since 1970; return those that count from another time than the row `before`."""
        since = UNIX_S * 1e6 / self.field.unit_us
        if max(before[0], stamps.max()) < since:
            return np.zeros(0, np.int64)
        unix = stamps >= since
        self.since_unix += int(np.count_nonzero(unix))
        changed = unix[1:] != unix[:-1]
        first = self._before is not None and (before[0] >= since) != unix[0]
        return np.flatnonzero(np.concatenate(([first], changed)))

    def _overtaken(self, frames: Frames, rows: Ints) -> Bools:
        """Return which of `rows` were sent before the row before, by the sender's sequence counter."""
        counters = frames.seq[np.maximum(rows - 1, 0)].astype(np.int64)
        if self._before is not None:
            counters[rows == 0] = self._before.seq
        return np.asarray((frames.seq[rows].astype(np.int64) - counters) % 256 >= 128)

    def _note(self, kept: list[StepBack], frames: Frames, stamps: Ints, rows: Ints) -> None:
        for row in rows[: MAX_EVENTS - len(kept)].tolist():
            last = self._before
            if row:
                before = frames.place(row - 1), int(stamps[row - 1]), int(frames.seq[row - 1])
            elif last is not None:
                before = last.seen, last.stamp, last.seq
            where, stamp, counter = before
            sent = (int(frames.seq[row]) - counter) % 256
            kept.append(StepBack(where, frames.place(row), stamp, int(stamps[row]), sent))

    def _stand(self, table: Table, stamps: Ints, same: Bools) -> None:
        """Continue and close runs of rows with one stamp."""
        frames, starts = table.frames, np.flatnonzero(~same)
        if len(starts) == len(same):
            self._close()
            self._run = _run(frames, stamps, (len(same) - 1, len(same) - 1), 0)
            return
        changed = np.cumsum(self._changes(table, same))
        lead = int(starts[0]) if len(starts) else len(same)
        if lead and self._run is not None:
            run = self._run
            run.rows, run.changed = run.rows + lead, run.changed + int(changed[lead - 1])
            run.last, run.until_us = frames.place(lead - 1), int(frames.clock_us[lead - 1])
        if not len(starts):
            return
        self._close()
        ends = np.append(starts[1:], len(same)) - 1
        long = frames.clock_us[ends] - frames.clock_us[starts] >= _STILL_US
        long[-1] = True
        for first, last in zip(starts[long].tolist(), ends[long].tolist()):
            differs = int(changed[last] - changed[first])
            self._run = _run(frames, stamps, (first, last), differs)
            if last != ends[-1]:
                self._close()

    def _close(self) -> None:
        """Keep the current run if it stood still for long while the message changed."""
        still = self.standing()
        if still is not None and len(self.stills) < MAX_EVENTS:
            self.stills.append(still)
        self._run = None

    def standing(self) -> Still | None:
        """Return the run that has not ended yet, if it is long enough to matter."""
        run = self._run
        if run is None or not run.changed or run.until_us - run.since_us < _STILL_US:
            return None
        seconds = (run.until_us - run.since_us) * 1e-6
        return Still(run.first, run.last, seconds, run.rows, run.changed, run.stamp)

    def _changes(self, table: Table, same: Bools) -> Bools:
        """Return (n,) rows with the stamp of the row before that differ from it otherwise."""
        changed = np.zeros(len(same), np.bool_)
        rows = np.flatnonzero(same)
        if len(rows):
            payloads = self._payloads(table, slice(None))
            before = np.roll(payloads, 1, axis=0)
            if self._before is not None:
                before[0] = self._before.payload
            changed[rows] = (payloads[rows] != before[rows]).any(axis=1)
        return changed

    def _payloads(self, table: Table, rows: slice) -> npt.NDArray[np.uint8]:
        """Return (n, length) payloads with the stamp blotted out."""
        columns = table.columns[rows].copy()
        columns[self.field.name] = 0
        return columns.view(np.uint8).reshape(len(columns), -1)

    def _knot(self, frames: Frames, stamps: Ints, level: int) -> None:
        """Add rows with a believable receive time to the knots."""
        self.coarsen(level)
        if not frames.t_valid.all():
            timed = np.flatnonzero(frames.t_valid)
            frames, stamps = frames.take(timed), stamps[timed]
        if not len(stamps):
            return
        number, t_us = frames.number, frames.t_us
        starts, ends, stretch = _stretches(number >> level)
        low = _lowest(t_us - stamps * self.field.unit_us, starts, ends)
        new = np.empty(len(starts), KNOT)
        new["stretch"], new["rows"] = stretch, ends - starts + 1
        new["number"], new["last_number"] = number[starts], number[ends]
        new["t_us"], new["last_t_us"], new["low_t_us"] = t_us[starts], t_us[ends], t_us[low]
        new["stamp"], new["last_stamp"] = stamps[starts], stamps[ends]
        new["low_stamp"] = stamps[low]
        new["offset"], new["size"] = frames.offset[starts], frames.size[starts]
        kept = max(len(self.knots) - 1, 0)  # only the last one may go on
        new = self._joined(_following(self.knots[kept:], new))
        self.knots = _following(self.knots[:kept], new)

    def coarsen(self, level: int) -> None:
        """Divide into stretches of ``2 ** level`` frames."""
        if level > self.level:
            self.knots["stretch"] >>= level - self.level
            self.knots, self.level = self._joined(self.knots), level

    def _joined(self, knots: Knots) -> Knots:
        """Return one knot for those of one stretch, which follow each other."""
        if (np.diff(knots["stretch"]) > 0).all():
            return knots
        starts, ends, _ = _stretches(knots["stretch"])
        lag = knots["low_t_us"] - knots["low_stamp"] * self.field.unit_us
        low = _lowest(lag, starts, ends)
        joined = knots.take(starts)
        joined["rows"] = np.add.reduceat(knots["rows"], starts)
        for name in ("last_number", "last_t_us", "last_stamp"):
            joined[name] = knots[name][ends]
        for name in ("low_t_us", "low_stamp"):
            joined[name] = knots[name][low]
        return joined


def _following(one: Knots, other: Knots) -> Knots:
    """Return knots one after the other: as numbers, since structured arrays are slow to join."""
    return np.concatenate((one.view(np.int64), other.view(np.int64))).view(KNOT)


def _run(frames: Frames, stamps: Ints, rows: tuple[int, int], changed: int) -> _Run:
    """Return the rows from the first to the last of `rows`, which have one stamp."""
    first, last = rows
    times = int(frames.clock_us[first]), int(frames.clock_us[last])
    where = frames.place(first), frames.place(last)
    return _Run(*where, *times, int(stamps[first]), last - first + 1, changed)


def _stretches(stretch: Ints) -> tuple[Ints, Ints, Ints]:
    """Return first and last place of each run of equal numbers (n,), and the numbers."""
    starts = np.flatnonzero(np.diff(stretch, prepend=-1))
    return starts, np.append(starts[1:], len(stretch)) - 1, stretch[starts]


def _lowest(lag: npt.NDArray[np.float64], starts: Ints, ends: Ints) -> Ints:
    """Return the place of the first least value in each run."""
    least = np.repeat(np.minimum.reduceat(lag, starts), ends - starts + 1)
    places = np.flatnonzero(lag == least)
    return np.asarray(places[np.searchsorted(places, starts)])


class ClockBook:
    """The stamps of every stream of a recording."""

    def __init__(self) -> None:
        """Start with nothing heard."""
        self.streams: dict[StampKey, StampStream] = {}
        self.refused = 0
        """Rows of streams beyond `MAX_STREAMS`."""
        self.level = 0
        self.exchanges = Exchanges()
        self._fields: dict[str, tuple[StampField, ...]] = {}

    def update(self, batch: Batch) -> None:
        """Take in the stamps of a batch."""
        if not len(batch):
            return
        while int(batch.frames.number[-1]) >> self.level >= MAX_KNOTS:
            self.level += 1
        if "TIMESYNC" in batch.tables:
            self.exchanges.update(batch.tables["TIMESYNC"])
        heard = [each for name in batch.tables for each in self._heard(batch.tables, name)]
        for key, stamp, table in sorted(heard, key=lambda each: _first(each[2])):
            stream = self.streams.get(key)
            if stream is None and len(self.streams) < MAX_STREAMS:
                stream = self.streams[key] = StampStream(key, stamp, level=self.level)
            if stream is None:
                self.refused += len(table)
            else:
                stream.coarsen(self.level)
                stream.add(table, self.level)

    def _heard(
        self, tables: Mapping[str, Table], name: str
    ) -> Iterator[tuple[StampKey, StampField, Table]]:
        """Yield the rows of each stream of one message, for each of its stamps."""
        if name not in self._fields:
            self._fields[name] = stamp_fields(tables[name].layout)
        for stamp in self._fields[name]:
            own = _OWN_ROWS.get((name, stamp.name))
            rows = tables[name] if own is None else tables[name].take(own(tables[name]))
            for key, part in _parts(rows):
                sender, target, instance = key >> 40, key >> 32 & 0xFF, key & 0xFFFFFFFF
                yield StampKey(sender, name, stamp.name, target, instance), stamp, part

    def settled(self) -> list[StampStream]:
        """Return every stream, all divided alike, in the order of their keys."""
        for stream in self.streams.values():
            stream.coarsen(self.level)
        return [self.streams[key] for key in sorted(self.streams)]


def _first(table: Table) -> int:
    return int(table.frames.number[0])


def _as_int64(column: npt.NDArray[Any]) -> Ints:
    """Return stamps as signed numbers; what does not fit is the largest one."""
    if column.dtype == np.uint64:
        column = np.minimum(column, np.uint64(2**63 - 1))
    return np.asarray(column, np.int64)


def _parts(table: Table) -> Iterator[tuple[int, Table]]:
    """Yield the rows of each sender, target and instance (as one number)."""
    if not len(table):
        return
    key = table.frames.sender << 40
    if "target_system" in table.layout.by_name:
        key |= table["target_system"].astype(np.int64) << 32
    name = _instance_field(table.layout)
    if name:
        key |= _as_number(table[name])
    if (key == key[0]).all():
        yield int(key[0]), table
        return
    for each in np.unique(key).tolist():
        yield each, table.take(key == each)


def _instance_field(layout: Layout) -> str:
    named = (tag.instance_field for tag in catalogue.tags(layout.name) if tag.instance_field)
    return next((name for name in named if name in layout.by_name), "")


def _as_number(column: npt.NDArray[Any]) -> Ints:
    """Return (n,) instances as numbers of 32 bits: names by their first eight letters."""
    if column.dtype.kind == "S":
        wide = np.ascontiguousarray(column.astype("S8")).view(np.uint64)
        column = (wide ^ wide >> np.uint64(31)) & np.uint64(0xFFFFFFFF)
    return column.astype(np.int64) & 0xFFFFFFFF
