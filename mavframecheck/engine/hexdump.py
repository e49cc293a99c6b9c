"""The frames that findings begin with, fetched from the recording again and decoded for people."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mavframecheck.engine.settings import Settings
from mavframecheck.model import ByteLocation, Finding
from mavframecheck.model.trace import FrameBytes, Value
from mavframecheck.semantics import catalogue
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.sources import SourceError, open_recording
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.rows import Rows
from mavframecheck.wire import Chunk, Dialect, read_batches, whole

_LONGEST = 4096
"""Bytes of a damaged range that are shown at most."""
_MOST_ELEMENTS = 12


def first_frames(
    path: str, findings: Iterable[Finding], settings: Settings, dialect: Dialect
) -> list[FrameBytes | None]:
    """Return the first frame of each finding; None where it cannot be read again (standard input)."""
    places = [each.location for each in findings]
    wanted = {
        (each.offset, min(each.length, _LONGEST))
        for each in places
        if isinstance(each, ByteLocation)
    }
    found = {} if path == "-" else _fetched(path, settings, sorted(wanted))
    frames = {offset: _decoded(offset, data, dialect) for offset, data in found.items()}
    return [frames.get(each.offset) if isinstance(each, ByteLocation) else None for each in places]


def _fetched(path: str, settings: Settings, wanted: list[tuple[int, int]]) -> dict[int, bytes]:
    """Return the bytes at some offsets; a frame that lies in several pieces of a capture is left out."""
    found: dict[int, bytes] = {}
    try:
        with open_recording(path, settings.input_kind) as recording:
            tails: dict[int, Chunk] = {}
            for group in recording.chunks():
                for chunk in group:
                    _look(_after(tails.get(chunk.flow), chunk), wanted, found)
                    tails[chunk.flow] = chunk
                if len(found) == len({offset for offset, _ in wanted}):
                    break
    except (SourceError, OSError):
        return found
    return found


def _after(before: Chunk | None, chunk: Chunk) -> Chunk:
    """Return a chunk with the end of the one before it, where the two continue each other in the file."""
    if before is None or len(before.starts) > 1 or len(chunk.starts) > 1:
        return chunk
    tail = before.data[-_LONGEST:]
    return whole(tail + chunk.data, int(chunk.offsets[0]) - len(tail))


def _look(chunk: Chunk, wanted: list[tuple[int, int]], found: dict[int, bytes]) -> None:
    ends = np.append(chunk.starts[1:], len(chunk.data))
    for offset, length in wanted:
        piece = int(np.searchsorted(chunk.offsets, offset, side="right")) - 1
        if piece < 0:
            continue
        at = int(chunk.starts[piece]) + offset - int(chunk.offsets[piece])
        if at + length <= int(ends[piece]):
            found.setdefault(offset, chunk.data[at : at + length])


def _decoded(offset: int, data: bytes, dialect: Dialect) -> FrameBytes:
    """Return a frame with its fields in words, as far as it can be decoded."""
    for batch in read_batches([[whole(data, 0)]], dialect, stamped=False):
        for name in batch.tables:
            rows = Rows(batch.tables[name].take(np.zeros(1, np.int64)), Context())
            values = tuple(_value(rows, field.name) for field in rows.table.layout.fields)
            return FrameBytes(offset=offset, data=data, message=name, values=values)
    return FrameBytes(offset=offset, data=data, message=None)


def _value(rows: Rows, field: str) -> Value:
    raw = rows.table[field][0]
    tag = next((t for t in catalogue.tags_of(rows.table.name, field) if _holds(rows, t)), None)
    return Value(name=field, raw=_raw(raw), says="" if tag is None else _says(rows, tag))


def _holds(rows: Rows, tag: FieldTag) -> bool:
    return all(rows.has(c).all() for c in tag.when if c.field in rows.table.layout.by_name)


def _raw(value: object) -> str:
    if isinstance(value, bytes):
        return value.rstrip(b"\0").decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        items = [_raw(each) for each in value[:_MOST_ELEMENTS]]
        return ", ".join(items + (["..."] if len(value) > _MOST_ELEMENTS else []))
    return f"{float(value):.8g}" if isinstance(value, np.floating) else str(value)


def _says(rows: Rows, tag: FieldTag) -> str:
    """Return what a field means: a code, a value in SI, a mask or frame in words."""
    if not rows.used(tag).all():
        return "left out by its mask"
    if tag.enum:
        return rows.words(tag.field, tag)[0]
    raw = rows.raw(tag.field)
    if raw.ndim > 1 or raw.dtype.kind not in "if":
        return tag.unit
    if rows.unknown(tag).any():
        return "unknown"
    value = float(rows.si(tag)[0])
    unit = tag.si_unit or tag.unit
    return f"{value:.9g} {unit}".strip() if unit else ""
