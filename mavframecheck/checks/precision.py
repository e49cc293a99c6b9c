"""Positions that went through single precision: every value lies on the grid of 32-bit floats."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Subject
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.enums import Quantity
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Frames, Place, Table

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MAX_STREAMS = 4096
MAX_DISTINCT = 1000
"""Different values of a run that are told apart; as many prove anything."""
MAX_FOUND = 200
"""Runs remembered per stream."""
PLAIN = 312_500
"""Multiples of 1/32 degree are on every grid: they prove nothing."""
DEGREE_M = 111_319.5
E7 = 1e-7


def _degrees(raw: Ints) -> Floats:
    """Return degE7 numbers as degrees that went through a 32-bit float."""
    degrees: Floats = (raw * E7).astype(np.float32).astype(np.float64)
    return degrees


def _step_of_degrees(raw: Ints) -> Floats:
    step: Floats = np.spacing(np.abs(raw * E7).astype(np.float32)).astype(np.float64) / E7
    return step


def _step_of_product(raw: Ints) -> Floats:
    return np.spacing(np.abs(raw).astype(np.float32)).astype(np.float64)


class _Way(NamedTuple):
    """A way through single precision: which values it can give, and how far those lie apart, degE7."""

    words: str
    gives: Callable[[Ints], Bools]
    step: Callable[[Ints], Floats]

    def gives_both(self, raw: Ints) -> Bools:
        """Return (n,) rows (n, 2) of which it gives both values; most fail with the first."""
        both = self.gives(raw[:, 0])
        likely = np.flatnonzero(both)
        both[likely] = self.gives(raw[likely, 1])
        return both


_WAYS = (
    _Way(
        "degrees held in a 32-bit float",
        lambda raw: np.round(_degrees(raw) / E7) == raw,
        _step_of_degrees,
    ),
    _Way(
        "degrees held in a 32-bit float, cut off instead of rounded",
        lambda raw: np.trunc(_degrees(raw) * 1e7) == raw,
        _step_of_degrees,
    ),
    _Way(
        "degrees times 1e7 held in a 32-bit float",
        lambda raw: raw.astype(np.float32).astype(np.float64) == raw,
        _step_of_product,
    ),
)


@dataclass(slots=True)
class _Run:
    """Rows in a row whose values all lie on the grid."""

    first: Place | None = None
    last: Place | None = None
    times: int = 0
    proof: float = 0.0
    """Decimal digits of improbability that so many different values lie on the grid by chance."""
    seen: set[int] = field(default_factory=set)
    where: tuple[float, float] = (0.0, 0.0)
    """Latitude and longitude of the first row, deg."""


@dataclass(slots=True)
class _Stream:
    """One latitude and longitude of one message of one sender."""

    subject: Subject
    role: str
    sender: int
    runs: list[_Run] = field(default_factory=lambda: [_Run() for _ in _WAYS])
    found: list[tuple[int, _Run]] = field(default_factory=list)
    judged: int = 0
    """Rows with a value that can prove something."""
    cleared: bool = False
    """Whether some row lay off every grid."""


class Float32Passage(Check):
    """Streams of degE7 positions that lie on the grid of 32-bit floats, value after value."""

    of_missions = True

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no stream yet."""
        super().__init__(params, dialect)
        self._streams: dict[tuple[int, ...], _Stream] = {}
        self._tags: dict[str, list[tuple[FieldTag, FieldTag]]] = {}

    def update(self, batch: Batch, context: Context) -> None:
        """Follow every stream of positions through the batch."""
        for name in batch.tables:
            pairs = self._pairs(name)
            if not pairs:
                continue
            table = batch.tables[name]
            if table.layout.dtype[pairs[0][0].field].kind != "i":  # home of a mission file
                continue
            for number, (lat, lon) in enumerate(pairs):
                rows = np.flatnonzero(_counts(table, lat) & _counts(table, lon))
                for key, own in _by_stream(table, rows):
                    stream = self._stream((table.layout.msgid, number, *key), table, own, context)
                    if stream is not None:
                        self._follow(stream, table.take(own), lat, lon)

    def _pairs(self, message: str) -> list[tuple[FieldTag, FieldTag]]:
        """Return the latitudes of a message that are integers, each with its longitude."""
        if message not in self._tags:
            tags = [
                tag
                for tag in catalogue.tags(message)
                if tag.quantity is Quantity.LATITUDE and tag.unit == "degE7"
            ]
            both = [(tag, catalogue.partners(tag).get("lon")) for tag in tags]
            layout = self.dialect.by_name[message]
            self._tags[message] = [
                (lat, lon)
                for lat, lon in both
                if lon is not None
                and layout.dtype[lat.field].kind == "i"
                and layout.dtype[lon.field].kind == "i"
            ]
        return self._tags[message]

    def _stream(
        self, key: tuple[int, ...], table: Table, rows: Ints, context: Context
    ) -> _Stream | None:
        stream = self._streams.get(key)
        if stream is None and len(self._streams) < MAX_STREAMS:
            frames, row = table.frames, int(rows[0])
            subject = Subject(int(frames.sysid[row]), int(frames.compid[row]), table.name)
            role = str(context.lookup("sender.role", table.take(rows[:1])).words[0])
            stream = self._streams[key] = _Stream(subject, role, int(frames.sender[row]))
        return stream

    def _follow(self, stream: _Stream, table: Table, lat: FieldTag, lon: FieldTag) -> None:
        raw = np.stack([table[lat.field], table[lon.field]], axis=1).astype(np.int64)
        telling = (np.abs(raw) * E7 >= self.params["min_magnitude_deg"]) & (raw % PLAIN != 0)
        stream.judged += int(np.count_nonzero(telling.any(axis=1)))
        off_all = np.ones(len(raw), np.bool_)
        for number, way in enumerate(_WAYS):
            on = way.gives_both(raw)
            off_all &= ~on
            if not on[0]:
                self._close(stream, number)
            for start, stop in _segments(on, int(self.params["min_distinct"]) // 2):
                run = stream.runs[number]
                _extend(run, table.frames, raw, telling, way, start, stop)
                if stop < len(raw):
                    self._close(stream, number)
        stream.cleared |= bool(off_all.any())

    def _close(self, stream: _Stream, number: int) -> None:
        """End a run: keep it if it proves something."""
        run = stream.runs[number]
        if run.times:
            if run.proof >= self.params["min_proof_digits"] and len(stream.found) < MAX_FOUND:
                stream.found.append((number, run))
            stream.runs[number] = _Run()

    def _proves(self, run: _Run, stream: _Stream) -> bool:
        """Return whether a run is no chance, be it that any row of the stream might have begun one."""
        needed = self.params["min_proof_digits"] + np.log10(max(stream.judged, 1))
        return bool(run.proof >= needed and len(run.seen) >= self.params["min_distinct"])

    def finish(self) -> Iterable[Observation]:
        """Return one observation per stretch of a stream; one way through single precision names it."""
        for stream in self._streams.values():
            for number in range(len(_WAYS)):
                self._close(stream, number)
            stream.found = [found for found in stream.found if self._proves(found[1], stream)]
            yield from _observations(stream)

    def verdict(self) -> Verdict:
        """Return the rows of streams that could be decided."""
        mine = [s for s in self._streams.values() if self.concerns_sender(s.sender)]
        decided = sum(s.judged for s in mine if s.cleared or self._found(s))
        if decided or not mine:
            return Verdict(decided)
        if not any(s.judged for s in mine):
            return Verdict(0, "all positions lie within 8 degrees of the equator and Greenwich")
        return Verdict(0, "too few different positions to exclude chance")

    def _found(self, stream: _Stream) -> bool:
        runs = (*(run for _, run in stream.found), *stream.runs)
        return any(self._proves(run, stream) for run in runs)


def _observations(stream: _Stream) -> Iterator[Observation]:
    """Yield the runs of a stream; of runs that overlap the one with the most proof."""
    taken: list[_Run] = []
    for number, run in sorted(stream.found, key=lambda found: -found[1].proof):
        if run.first is None or run.last is None or any(_overlap(run, other) for other in taken):
            continue
        taken.append(run)
        lat, lon = run.where
        way = _WAYS[number]
        here = np.round(np.array([lat, lon]) / E7).astype(np.int64)
        step_lat, step_lon = (way.step(here) * E7 * DEGREE_M).tolist()
        yield Observation(
            stream.subject,
            run.first,
            run.last,
            run.times,
            {
                "way": way.words,
                "distinct": len(run.seen),
                "rows": run.times,
                "step_m": max(step_lat, step_lon * float(np.cos(np.radians(lat)))),
                "lat": lat,
                "lon": lon,
                "role": stream.role,
                "message": stream.subject.message or "",
            },
        )


def _overlap(run: _Run, other: _Run) -> bool:
    if run.first is None or run.last is None or other.first is None or other.last is None:
        return False
    return run.first.number <= other.last.number and other.first.number <= run.last.number


def _extend(
    run: _Run, frames: Frames, raw: Ints, telling: Bools, way: _Way, start: int, stop: int
) -> None:
    """Add the rows from `start` to `stop`, all on the grid, to a run."""
    if run.first is None:
        run.first = frames.place(start)
        run.where = (float(raw[start, 0]) * E7, float(raw[start, 1]) * E7)
    run.last = frames.place(stop - 1)
    run.times += stop - start
    if len(run.seen) >= MAX_DISTINCT:
        return
    values = np.unique(raw[start:stop][telling[start:stop]])
    fresh = [value for value in values.tolist() if value not in run.seen]
    if fresh:
        run.seen.update(fresh)
        run.proof += float(np.log10(way.step(np.array(fresh))).sum())


def _segments(on: Bools, least: int) -> list[tuple[int, int]]:
    """Return [start, stop) of the stretches where `on` holds, and that touch an end or have `least` rows."""
    edges = np.diff(np.concatenate(([False], on, [False])).astype(np.int8))
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    kept = (starts == 0) | (stops == len(on)) | (stops - starts >= least)
    starts, stops = starts[kept], stops[kept]
    return list(zip(starts.tolist(), stops.tolist(), strict=True))


def _counts(table: Table, tag: FieldTag) -> Bools:
    """Return (n,) rows whose field is given, not ignored, not zero and no code."""
    raw = table[tag.field].astype(np.int64)
    counts = table.present(tag.field) & (raw != 0)
    for condition in tag.when:
        counts &= np.isin(table[condition.field], condition.values)
    if tag.ignore_field:
        bit_set = (table[tag.ignore_field].astype(np.int64) & tag.ignore_bit) != 0
        counts &= bit_set != tag.ignore_when_set
    for sentinel in tag.sentinels:
        if sentinel.kind == "value":
            counts &= raw != sentinel.value
    return np.asarray(counts)


def _by_stream(table: Table, rows: Ints) -> Iterator[tuple[tuple[int, int], Ints]]:
    """Yield (sender, target) and the rows of each stream, in order."""
    if not len(rows):
        return
    sender = table.frames.sender[rows].astype(np.int64)
    aimed = "target_system" in table.layout.by_name
    target = table["target_system"][rows].astype(np.int64) if aimed else np.zeros(len(rows), int)
    stream = sender << 8 | target
    order = np.argsort(stream, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(stream[order])) + 1):
        first = int(group[0])
        yield (int(sender[first]), int(target[first])), rows[group]
