"""The semantic map of a recording: who sends what, and what each number of it means."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import numpy as np

from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.engine.streams import Stream
from mavframecheck.model import Vehicle
from mavframecheck.model.survey import (
    FieldSurvey,
    FileSurvey,
    ReferenceCount,
    SenderSurvey,
    StreamSurvey,
)
from mavframecheck.semantics.references import height_reference, reference
from mavframecheck.sources import open_recording
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Batch, Layout, Table, load_dialect

MOST_SPLIT = 64
"""Streams, in the order they are first heard, that are split into views; a hostile log has 1 000."""


def survey_file(
    path: str,
    settings: Settings,
    messages: Collection[str] = (),
    progress: Progress | None = None,
) -> FileSurvey:
    """Map the recording at `path` (``-``: standard input); `messages`: only these, empty for all.

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` when the dialect cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    survey = Survey(messages)
    with open_recording(path, settings.input_kind) as recording:
        reading = Reading(recording, settings, dialect)
        for batch in reading.understood(progress):
            survey.update(batch, reading.context)
        return summary(reading, survey.finish(reading.vehicles()))


def summary(reading: Reading, senders: tuple[SenderSurvey, ...]) -> FileSurvey:
    """Put together what was read, with what the references named in it mean."""
    fields = [field for each in senders for field in _fields(each)]
    return FileSurvey(
        **reading.summary(),
        senders=senders,
        references=tuple(map(reference, _names(field.frames for field in fields))),
        heights=tuple(map(height_reference, _names(field.heights for field in fields))),
    )


def _fields(sender: SenderSurvey) -> Iterator[FieldSurvey]:
    for stream in sender.streams:
        for view in stream.views:
            yield from view.fields


def _names(used: Iterable[tuple[ReferenceCount, ...]]) -> list[str]:
    return sorted({each.reference for counts in used for each in counts})


class Survey:
    """Watches every stream of a recording, batch by batch."""

    def __init__(self, messages: Collection[str] = ()) -> None:
        """Watch only the messages named, or all."""
        self._wanted = frozenset(messages)
        self._streams: dict[tuple[int, str], Stream] = {}
        self._split = 0

    def update(self, batch: Batch, context: Context) -> None:
        """Take in what `batch` holds."""
        wanted = [name for name in batch.tables if not self._wanted or name in self._wanted]
        heard = [each for name in wanted for each in _by_sender(batch.tables[name])]
        for sender, table in sorted(heard, key=_first_frame):
            self._stream(sender, table.layout).add(Rows(table, context))

    def finish(self, vehicles: Iterable[Vehicle]) -> tuple[SenderSurvey, ...]:
        """Return what each of `vehicles` (the components that spoke) sent."""
        return tuple(
            SenderSurvey(
                **{name: getattr(vehicle, name) for name in Vehicle.__struct_fields__},
                streams=self._of(vehicle.sysid * 256 + vehicle.compid),
            )
            for vehicle in vehicles
        )

    def _of(self, sender: int) -> tuple[StreamSurvey, ...]:
        mine = sorted(key for key in self._streams if key[0] == sender)
        return tuple(self._streams[key].finish() for key in mine)

    def _stream(self, sender: int, layout: Layout) -> Stream:
        key = (sender, layout.name)
        stream = self._streams.get(key)
        if stream is None:
            stream = self._streams[key] = Stream(layout, split=self._split < MOST_SPLIT)
            self._split += stream.is_split
        return stream


def _first_frame(heard: tuple[int, Table]) -> int:
    return int(heard[1].frames.number[0])


def _by_sender(table: Table) -> Iterator[tuple[int, Table]]:
    """Yield each sender (``sysid * 256 + compid``) of a table with its rows."""
    sender = table.frames.sender
    found = np.unique(sender).tolist()
    for each in found:
        yield each, table if len(found) == 1 else table.take(sender == each)
