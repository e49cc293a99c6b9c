"""Opens anything that holds MAVLink and hands it out in chunks of bounded size."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from mavframecheck.sources.paths import STDIN
from mavframecheck.sources.sniff import RECORDINGS, REFUSALS, Kind, sniff_stream
from mavframecheck.sources.stream import ByteStream, NoRecordingError, SourceError, open_stream
from mavframecheck.wire.chunk import Chunk, whole

_STDIN_NAME = "<stdin>"
BATCH_BYTES = 12 * 1024 * 1024
"""How much MAVLink one batch of chunks holds, about 300 000 frames."""


class Recording:
    """An open recording: read it once with `chunks`, as a context manager or with `close`."""

    def __init__(self, name: str, file: BinaryIO, kind: Kind | None = None) -> None:
        """Judge `file`, which will be closed by us, from its first bytes unless `kind` is given."""
        self.name = name
        """What to call it in print."""
        self.notes: list[str] = []
        """What was damaged or left out, complete once all chunks are read."""
        self._file = file
        try:
            self._stream = open_stream(file, self.notes)
            self.kind = kind or sniff_stream(self._stream)
            """What it is, judged by content."""
        except OSError as error:
            raise SourceError(_plain(name, error)) from error

    @property
    def stamped(self) -> bool:
        """Whether each frame is preceded in the bytes by the time it was received."""
        return self.kind is Kind.TLOG

    def chunks(self) -> Iterator[list[Chunk]]:
        """Yield one batch after another: a chunk for every flow that has bytes in it."""
        try:
            if self.kind in (Kind.PCAP, Kind.PCAPNG):
                # A capture is rare and its reader slow to import.
                from mavframecheck.sources.pcap import read_capture

                yield from read_capture(self._stream, self.kind, self.notes, BATCH_BYTES)
            else:
                yield from _plain_chunks(self._stream)
        except OSError as error:
            raise SourceError(_plain(self.name, error)) from error

    def content(self, most: int) -> bytes:
        """Return the whole content, but no more than `most` bytes."""
        try:
            return self._stream.read(most)
        except OSError as error:
            raise SourceError(_plain(self.name, error)) from error

    def close(self) -> None:
        """Close the file behind it; standard input stays open."""
        if self.name != _STDIN_NAME:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_recording(
    path: str | Path, input_kind: str | None = None, kinds: frozenset[Kind] | None = RECORDINGS
) -> Recording:
    """Open a file, or standard input for `-`; `input_kind` overrules what the content looks like.

    Raises SourceError when it cannot be read or is none of `kinds` (None: whatever it is).
    """
    kind = _chosen(input_kind)
    name, file = _open(path)
    with ExitStack() as opened:
        if path != STDIN:
            opened.callback(file.close)
        recording = Recording(name, file, kind)
        if kinds is not None and recording.kind not in kinds:
            raise NoRecordingError(f"{name}: this {REFUSALS[recording.kind]}")
        opened.pop_all()  # from here on the recording closes it
    return recording


def _chosen(input_kind: str | None) -> Kind | None:
    """Check the kind a user insists on."""
    if input_kind is None:
        return None
    if input_kind not in RECORDINGS:
        choices = ", ".join(kind for kind in Kind if kind in RECORDINGS)
        raise SourceError(f"{input_kind}: no such kind of recording; choose one of {choices}")
    return Kind(input_kind)


def _open(path: str | Path) -> tuple[str, BinaryIO]:
    """Open the bytes of `path` and say what to call them."""
    if path == STDIN:
        if sys.stdin is None:
            raise SourceError(f"{_STDIN_NAME}: standard input is closed; give a file")
        return _STDIN_NAME, sys.stdin.buffer
    name = str(path)
    if Path(path).is_dir():
        raise SourceError(f"{name}: this is a directory; name a file in it, or expand it first")
    try:
        return name, Path(path).open("rb")
    except OSError as error:
        raise SourceError(_plain(name, error)) from error
    except ValueError as error:  # a NUL in the name
        raise SourceError(f"{name!r}: this cannot be the name of a file") from error


def _plain(name: str, error: OSError) -> str:
    """Say in plain words why the operating system refused."""
    if isinstance(error, FileNotFoundError):
        return f"{name}: no such file; check the spelling of the path"
    if isinstance(error, PermissionError):
        return f"{name}: no permission to read this file; change its permissions or copy it"
    return f"{name}: this file cannot be read: {error.strerror or error}"


def _plain_chunks(stream: ByteStream) -> Iterator[list[Chunk]]:
    """Cut a file into batches of one chunk each."""
    offset = stream.position
    while data := stream.read(BATCH_BYTES):
        yield [whole(data, offset)]
        offset = stream.position
