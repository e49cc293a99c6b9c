"""Real recordings: every frame that pymavlink reads is ours, and every further frame of ours is right.

The recordings are not part of the repository (see CONTRIBUTING.md). By default all from the field and
every third of the simulator; MAVFRAMECHECK_FULL_CORPUS=1, or `make corpus-frames`, takes all.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mavframecheck.sources import Kind, open_recording
from mavframecheck.wire import Batch, Layout, read_batches
from tests.sources.made import CORPUS, NO_CORPUS
from tests.strategies import DIALECT, MESSAGES, STAMP

FULL = os.environ.get("MAVFRAMECHECK_FULL_CORPUS") == "1"
EVERY = 1 if FULL else 3


def recordings() -> list[Path]:
    """Return the recordings to compare."""
    field = [p for s in ("tlog", "raw", "pcap") for p in sorted((CORPUS / "real" / s).iterdir())]
    return field + sorted((CORPUS / "sitl").glob("*.tlog"))[::EVERY]


class Ours(NamedTuple):
    """What we read of a file."""

    data: dict[int, bytes]
    """Bytes of each good frame by the offset of its first byte."""
    values: dict[int, tuple[Layout, Any]]
    """Layout and row of each good frame by offset."""
    unknown: set[int]
    """Offsets of frames with an id that the dialect lacks."""


class Theirs(NamedTuple):
    """What `recv_match` of pymavlink reads."""

    offset: int
    data: bytes
    message: Any


def frame_bytes(batch: Batch, row: int) -> bytes:
    """Return the bytes of a frame."""
    start = int(batch.frames.start[row])
    return batch.buffer[start : start + int(batch.frames.size[row])]


def ours(path: Path) -> Ours:
    """Read a file as `check` does."""
    found = Ours({}, {}, set())
    with open_recording(path) as recording:
        for batch in read_batches(recording.chunks(), DIALECT, stamped=recording.stamped):
            frames = batch.frames
            offsets = frames.offset.tolist()
            for row in np.flatnonzero(frames.good).tolist():
                found.data[offsets[row]] = frame_bytes(batch, row)
            found.unknown.update(frames.offset[~frames.known].tolist())
            for table in batch.tables.values():
                for offset, values in zip(table.frames.offset.tolist(), table.columns):
                    found.values[offset] = (table.layout, values)
    return found


def theirs(path: Path, *, stamped: bool) -> Iterator[Theirs]:
    """Read a file with pymavlink, and find where each message of it stands."""
    content = path.read_bytes()
    source = mavutil.mavlink_connection(str(path), notimestamps=not stamped)
    after = 0
    while (message := source.recv_match()) is not None:
        if message.get_type() == "BAD_DATA" or message.get_type().startswith("UNKNOWN"):
            continue
        data = bytes(message.get_msgbuf())
        offset = source.f.tell() - len(data) - source.mav.buf_len()
        if content[offset : offset + len(data)] != data:
            # behind damage pymavlink holds bytes back in a buffer that it does not count
            offset = content.index(data, after)
        after = offset + len(data)
        yield Theirs(offset, data, message)
    source.close()


class Columns:
    """Messages of one type as pymavlink has decoded them, to compare with ours column by column."""

    def __init__(self, layout: Layout, kind: Any) -> None:
        self.layout = layout
        names = [f"_{n}_raw" if _is_text(layout, n) else n for n in kind.fieldnames]
        self.names = list(kind.fieldnames)
        self._get = attrgetter(*names, "_type")
        self.expected: list[tuple[Any, ...]] = []
        self.rows: list[Any] = []

    def add(self, message: Any, row: Any) -> None:
        """Remember a message of pymavlink and our row for it."""
        self.expected.append(self._get(message))
        self.rows.append(row)

    def assert_equal(self) -> None:
        """Compare all fields of all messages."""
        columns = np.array(self.rows, self.layout.dtype)
        *fields, types = zip(*self.expected)
        assert set(types) == {self.layout.name}
        for name, expected in zip(self.names, fields):
            column = columns[name]
            if column.dtype.kind == "S":
                assert column.tolist() == [text.rstrip(b"\0") for text in expected], name
            else:
                assert_same(column, expected, f"{self.layout.name}.{name}")


def _is_text(layout: Layout, name: str) -> bool:
    return layout.by_name[name].type == "char"


def assert_same(column: npt.NDArray[Any], expected: tuple[Any, ...], what: str) -> None:
    """Compare one column of numbers bit for bit, NaN being NaN."""
    them = np.array(expected, column.dtype)
    assert np.array_equal(column, them, equal_nan=column.dtype.kind == "f"), what


class Comparison:
    """Counts what both read, and compares it."""

    def __init__(self, found: Ours) -> None:
        self.found = found
        self.columns: dict[int, Columns] = {}
        self.seen: set[int] = set()

    def add(self, offset: int, data: bytes, message: Any) -> None:
        """Take a frame that pymavlink has decoded from `data` at `offset`."""
        assert self.found.data.get(offset) == data, (offset, message.get_type())
        layout, row = self.found.values[offset]
        columns = self.columns.get(layout.msgid)
        if columns is None:
            kind = MESSAGES[message.get_msgId()]
            columns = self.columns[layout.msgid] = Columns(layout, kind)
        columns.add(message, row)
        self.seen.add(offset)

    def add_further(self) -> int:
        """Decode with pymavlink every frame that it had not read; return how many it can decode."""
        decoder = mavlink.MAVLink(None)
        further = sorted(set(self.found.data) - self.seen)
        for offset in further:
            message = decoder.decode(bytearray(self.found.data[offset]))  # raises on a bad checksum
            if not isinstance(message, mavlink.MAVLink_unknown):
                self.add(offset, self.found.data[offset], message)
            else:
                assert self.found.values[offset][0].msgid not in MESSAGES
        return len(further)

    def assert_equal(self) -> None:
        """Compare all columns."""
        for columns in self.columns.values():
            columns.assert_equal()


@pytest.fixture(scope="module")
def table() -> Iterator[list[str]]:
    """Collect a line per file; `pytest -s` shows them."""
    lines: list[str] = []
    yield lines
    print(f"\n{'pymavlink':>10}{'further':>9}{'unknown':>9}")  # noqa: T201
    print("\n".join(lines))  # noqa: T201


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """One test a recording, by its name."""
    found = recordings() if CORPUS.is_dir() else []
    names = [str(path.relative_to(CORPUS)) for path in found]
    if "recording" in metafunc.fixturenames:
        metafunc.parametrize("recording", found or [None], ids=names or ["absent"])


def test_frames_are_those_of_pymavlink(recording: Path | None, table: list[str]) -> None:
    """At the same offset, with the same bytes and equal values; frames beyond those decode equally."""
    if recording is None:
        pytest.skip(NO_CORPUS)
    found = ours(recording)
    comparison = Comparison(found)
    with open_recording(recording) as opened:
        kind, stamped = opened.kind, opened.stamped
    if kind in (Kind.TLOG, Kind.RAW):  # pymavlink cannot read a capture: all frames are "further"
        for one in theirs(recording, stamped=stamped):
            if one.message.get_msgId() in MESSAGES:
                comparison.add(*one)
    read_by_both = len(comparison.seen)
    further = comparison.add_further()
    comparison.assert_equal()
    name = recording.relative_to(CORPUS)
    table.append(f"{read_by_both:10}{further:9}{len(found.unknown):9}  {name}")


def test_stamps_stand_before_their_frames() -> None:
    """The receive time of each frame of a tlog is the eight bytes before it."""
    if not CORPUS.is_dir():
        pytest.skip(NO_CORPUS)
    path = CORPUS / "sitl" / "clean_copter_speed5.tlog"
    content = path.read_bytes()
    with open_recording(path) as recording:
        for batch in read_batches(recording.chunks(), DIALECT, stamped=True):
            for offset, t_us in zip(batch.frames.offset.tolist(), batch.frames.t_us.tolist()):
                assert int.from_bytes(content[offset - STAMP : offset], "big") == t_us
