"""One frame of a recording, and the stream that it belongs to, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO

import numpy as np

from mavframecheck.engine.reading import Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.engine.survey import Survey
from mavframecheck.model import ByteLocation
from mavframecheck.model.survey import FieldSurvey
from mavframecheck.report.fields import meaning, refers_to, values
from mavframecheck.report.words import scalar
from mavframecheck.semantics.references import height_reference, reference
from mavframecheck.sources import Recording
from mavframecheck.wire import Table, load_dialect
from mavframecheck.wire.frames import CHECKSUM, HEADER_V1, HEADER_V2, STAMP, STX_V2
from mavframecheck.wire.table import join
from tools.pages.markdown import code, fence, table, text

_BYTES_A_LINE = 16
_SAMPLES = 6
_MOST_COLUMNS = 7
_LONGEST_ARRAY = 4


class Tlog:
    """A small recording in memory, read once."""

    def __init__(self, data: bytes) -> None:
        """Read `data`, a telemetry log."""
        self.data = data
        reading = Reading(Recording("example.tlog", BytesIO(data)), Settings(), load_dialect())
        batches = list(reading.batches())
        names = dict.fromkeys(name for batch in batches for name in batch.tables)
        self.tables = {
            name: join([batch.tables[name] for batch in batches if name in batch.tables])
            for name in names
        }

    def frame(self, where: ByteLocation) -> bytes:
        """Return the bytes at a place."""
        return self.data[where.offset : where.offset + where.length]

    def stream(self, where: ByteLocation) -> Table | None:
        """Return all messages like the one at a place by the same sender, None where it is no good frame."""
        for rows in self.tables.values():
            (found,) = np.flatnonzero(rows.frames.offset == where.offset)[:1].tolist() or (None,)
            if found is not None:
                return rows.take(rows.frames.sender == rows.frames.sender[found])
        return None

    def fields(self, where: ByteLocation) -> list[FieldSurvey]:
        """Return what `inspect` says of each field of the message at a place."""
        alone = self.data[where.offset - STAMP : where.offset + where.length]
        reading = Reading(Recording("frame", BytesIO(alone)), Settings(), load_dialect())
        survey = Survey()
        for batch in reading.batches():
            survey.update(batch, reading.context)
        views = [
            view
            for sender in survey.finish(reading.vehicles())
            for stream in sender.streams
            for view in stream.views
        ]
        return list(views[0].fields) if views else []


def hexadecimal(frame: bytes) -> str:
    """Return the bytes of a frame, header, payload and checksum told apart."""
    header = HEADER_V2 if frame[0] == STX_V2 else HEADER_V1
    end = header + frame[1]
    parts = {"header": frame[:header], "payload": frame[header:end]}
    parts["checksum"] = frame[end : end + CHECKSUM]
    if len(frame) < end + CHECKSUM:
        parts = {"bytes": frame}
    return fence("\n".join(line for name, part in parts.items() for line in _lines(name, part)))


def _lines(name: str, part: bytes) -> Iterator[str]:
    for at in range(0, max(len(part), 1), _BYTES_A_LINE):
        label = "" if at else name
        yield f"{label:10}{part[at : at + _BYTES_A_LINE].hex(' ')}"


def field_table(stream: Table, where: ByteLocation, fields: list[FieldSurvey]) -> str:
    """Return a table of the fields of one message: on the wire, in words, what it says."""
    row = int(np.flatnonzero(stream.frames.offset == where.offset)[0])
    given = [field for field in fields if field.present]
    return table(
        ("field", "on the wire", "what it is", "what it says"),
        (
            (code(f.name), _raw(stream, f.name, row), text(_meaning(f)), text(_said(f)))
            for f in given
        ),
    )


def _meaning(field: FieldSurvey) -> str:
    names = [each.reference for each in field.frames]
    labels = {name: reference(name).label for name in names}
    labels |= {h.reference: height_reference(h.reference).label for h in field.heights}
    parts = (meaning(field), refers_to(field, labels, "")[0])
    return "; ".join(part for part in parts if part and part != "-")


def _said(field: FieldSurvey) -> str:
    """Return what came in words; the share of a single message is always all of it."""
    return ", ".join(values(field)).replace(" 100 %", "").replace(", (", " (")


def _raw(rows: Table, name: str, row: int) -> str:
    """Return a value as the sender wrote it."""
    value = rows[name][row]
    if isinstance(value, bytes):
        return text(value.decode("ascii", "replace"))
    single = rows[name].dtype == np.float32
    shown = [_number(each, single=single) for each in np.atleast_1d(value).tolist()]
    return _array(shown) if len(shown) > _LONGEST_ARRAY else ", ".join(shown)


def _number(value: float, *, single: bool) -> str:
    """Return a number in the digits that its type holds: seven for a 32-bit float."""
    return f"{value:.7g}".replace("nan", "NaN") if single else scalar(value)


def _array(shown: list[str]) -> str:
    """Return a long array: the same value once, others up to where only zeros follow."""
    if len(set(shown)) == 1:
        return f"{len(shown)} times {shown[0]}"
    last = max(k for k, each in enumerate(shown) if each != shown[-1])
    return ", ".join(shown[: last + 1]) + f", then {len(shown) - last - 1} times {shown[-1]}"


def samples(stream: Table) -> str:
    """Return a few rows of a stream from its beginning to its end: time and the fields that change."""
    names = [name for name in stream.columns.dtype.names or () if _changes(stream, name)]
    if len(stream) < _SAMPLES or not names:
        return ""
    t_us = stream.frames.t_us
    rows = np.linspace(0, len(stream) - 1, _SAMPLES).round().astype(int).tolist()
    return table(
        ("s", *(code(name) for name in names[:_MOST_COLUMNS])),
        (
            (
                f"{(t_us[r] - t_us[0]) / 1e6:.1f}",
                *(_raw(stream, n, r) for n in names[:_MOST_COLUMNS]),
            )
            for r in rows
        ),
    )


def _changes(stream: Table, name: str) -> bool:
    """Return whether a field, short enough for a cell, holds more than one value."""
    column = stream[name]
    if column.dtype.kind not in "iuf":
        return False
    short = column.ndim == 1 or column.shape[1] <= _LONGEST_ARRAY
    same = np.array_equal(column, np.broadcast_to(column[0], column.shape), equal_nan=True)
    return short and not same
