"""Reading a recording from end to end: batches, and what is counted on the way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np

from mavframecheck.engine.settings import Settings
from mavframecheck.model import Damage, Vehicle
from mavframecheck.semantics.names import type_name
from mavframecheck.sources import Kind
from mavframecheck.vehicle import Context, Traffic
from mavframecheck.vehicle.roles import version_text
from mavframecheck.vehicle.traffic import MAX_SENDERS, MAX_STREAMS
from mavframecheck.wire import Batch, Chunk, Dialect, Ranges, read_batches

MAX_DAMAGE = 100
"""Damaged ranges that a report lists; all are counted."""

Progress = Callable[[int], None]


class Readable(Protocol):
    """What can be read: an open file, or a link."""

    @property
    def name(self) -> str:
        """What findings call it."""

    @property
    def kind(self) -> Kind:
        """What its bytes are."""

    @property
    def stamped(self) -> bool:
        """Whether a receive time precedes each frame in the bytes."""

    @property
    def notes(self) -> Sequence[str]:
        """What was damaged or left out."""

    def chunks(self) -> Iterator[list[Chunk]]:
        """Yield one batch after another: a chunk for every flow that has bytes in it."""


class Reading:
    """A recording on its way through: its batches, its context, and what was counted."""

    def __init__(self, recording: Readable, settings: Settings, dialect: Dialect) -> None:
        """Read `recording` with `dialect`, assuming what `settings` say."""
        self.context = Context(settings.autopilot)
        self.traffic = Traffic(dialect)
        self.damage: list[Damage] = []
        self.damage_total = 0
        self.counts = {"messages": 0, "unknown": 0, "bad_crc": 0, "skipped_bytes": 0}
        self.remarks: list[str] = []
        """What a reader of the report should know besides."""
        self._recording = recording
        self._dialect = dialect
        self._ranges = Ranges()

    def batches(self, progress: Progress | None = None) -> Iterator[Batch]:
        """Yield the batches of the recording; `progress` is told how many bytes were read so far."""
        chunks = self._recording.chunks()
        for batch in read_batches(chunks, self._dialect, stamped=self._recording.stamped):
            self._count(batch)
            admitted = self.traffic.admit(batch.frames)
            if self.traffic.refused:
                batch.restrict(admitted)
            yield batch
            if progress is not None and len(batch):
                progress(int(batch.frames.offset[-1]))
            del batch, admitted  # not in memory while the next one is read
        self._list(self._ranges.close())

    def understood(self, progress: Progress | None = None) -> Iterator[Batch]:
        """Yield the batches, each while the context knows what it says."""
        for batch in self.batches(progress):
            self.context.update(batch)
            yield batch
            self.context.settle()

    def _count(self, batch: Batch) -> None:
        """Count the frames and the damage of a batch."""
        frames = batch.frames
        self.counts["messages"] += int(np.count_nonzero(frames.good))
        self.counts["unknown"] += int(np.count_nonzero(~frames.known))
        self.counts["bad_crc"] += int(np.count_nonzero(frames.known & ~frames.crc_ok))
        self.counts["skipped_bytes"] += sum(damage.length for damage in batch.damage)
        self._list(self._ranges.add(batch.damage))

    def _list(self, ranges: Iterable[Damage]) -> None:
        for damage in ranges:
            self.damage_total += 1
            if len(self.damage) < MAX_DAMAGE:
                self.damage.append(damage)

    def summary(self) -> dict[str, Any]:
        """Return what every report says of a file, by the names of its struct's fields."""
        return {
            "path": self._recording.name,
            "kind": str(self._recording.kind),
            **self.counts,
            "duration_s": self.traffic.duration_s,
            "time_start": self.traffic.t_first,
            "notes": tuple(self._notes()),
        }

    def _notes(self) -> Iterator[str]:
        yield from self._recording.notes
        yield from self.remarks
        if self.traffic.refused:
            yield (
                f"{self.traffic.refused} frames of further senders or streams were read but not "
                f"judged: more than {MAX_SENDERS} senders or {MAX_STREAMS} streams"
            )

    def vehicles(self) -> tuple[Vehicle, ...]:
        """Return every sender, with what it said it is."""
        frames: dict[tuple[int, int], int] = {}
        for stream in self.traffic.streams():
            key = (stream.sysid, stream.compid)
            frames[key] = frames.get(key, 0) + stream.frames
        return tuple(self._vehicle(*sender, count) for sender, count in frames.items())

    def _vehicle(self, sysid: int, compid: int, messages: int) -> Vehicle:
        role = self.context.role(sysid * 256 + compid)
        if role != "autopilot":
            return Vehicle(sysid=sysid, compid=compid, role=role, messages=messages)
        mav_type = self.context.last("vehicle.type", sysid)
        return Vehicle(
            sysid=sysid,
            compid=compid,
            role=role,
            autopilot=self.context.last("vehicle.autopilot", sysid),
            type=None if mav_type is None else type_name(int(mav_type)),
            version=version_text(self.context.last("vehicle.version", sysid)),
            messages=messages,
        )
