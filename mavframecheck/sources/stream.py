"""Bytes read once, front to back, with a look ahead; gzip is unpacked on the way.

Nothing seeks, so a pipe will do.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import BinaryIO

GZIP_MAGIC = b"\x1f\x8b\x08"
_GZIP_WINDOW = 31  # zlib's way to say: expect a gzip header and trailer, and verify the checksum
_PIECE = 1 << 14
_MOST_ZEROS = 1 << 26  # a longer run of zeros is not a gap in a recording but an empty disk image


class SourceError(Exception):
    """A source cannot be read; the message tells a person what, where, and what to do about it."""


class NoRecordingError(SourceError):
    """What was named can be read, but is no MAVLink recording; the message says what it is instead."""


class ByteStream:
    """A forward-only stream over `pull(n)`, which gives at most n bytes, and b"" at the end."""

    def __init__(self, pull: Callable[[int], bytes]) -> None:
        self.position = 0
        """How many bytes were read."""
        self._pull = pull
        self._zeros = 0  # looked at and not kept; they come before `_ahead`
        self._ahead = b""

    def peek(self, size: int) -> bytes:
        """Return the next `size` bytes, fewer only at the end, without taking them."""
        zeros = bytes(min(self._zeros, size))
        return zeros + self._fill(size - len(zeros))

    def peek_past_zeros(self, size: int, keep: int) -> bytes:
        """Peek from `keep` zeros before the first other byte.

        A crash leaves files that begin with megabytes of zeros; those are not kept in memory.
        """
        while self._zeros < _MOST_ZEROS:
            head = self._fill(size)
            blank = len(head) - len(head.lstrip(b"\0")) - keep
            if blank <= 0:
                break
            self._zeros += blank
            self._ahead = self._ahead[blank:]
        return self._fill(size)

    def read(self, size: int) -> bytes:
        """Take the next `size` bytes, fewer only at the end."""
        data = bytes(min(self._zeros, size))
        self._zeros -= len(data)
        wanted = size - len(data)
        ahead, self._ahead = self._ahead[:wanted], self._ahead[wanted:]
        data += ahead
        if len(data) < size:
            data += self._take(size - len(data))
        self.position += len(data)
        return data

    def _fill(self, size: int) -> bytes:
        """Have `size` bytes in front, if there are so many, and return them."""
        if len(self._ahead) < size:
            self._ahead += self._take(size - len(self._ahead))
        return self._ahead[:size]

    def _take(self, size: int) -> bytes:
        """Pull until `size` bytes have come: a pipe and gzip hand over less than asked."""
        pieces: list[bytes] = []
        while size > 0 and (piece := self._pull(size)):
            pieces.append(piece)
            size -= len(piece)
        return b"".join(pieces)


class Gunzip:
    """Unpacks gzip as far as it goes; what stopped it early is said in `notes`."""

    def __init__(self, packed: ByteStream, notes: list[str]) -> None:
        self._packed = packed
        self._notes = notes
        self._member = zlib.decompressobj(_GZIP_WINDOW)
        self._input = b""
        self._ready = b""
        self._done = False

    def read(self, size: int) -> bytes:
        """Return at most `size` unpacked bytes, b"" at the end."""
        while not self._ready and not self._done:
            self._advance(size)
        data, self._ready = self._ready[:size], self._ready[size:]
        return data

    def _advance(self, size: int) -> None:
        """Take one step: unpack some input, go to the next member, or stop."""
        self._input = self._input or self._packed.read(_PIECE)
        if not self._input and not self._member.eof:
            self._stop("the gzip data ends early")
        elif self._member.eof:
            self._next_member()
        else:
            self._ready = self._unpack(size)

    def _unpack(self, size: int) -> bytes:
        """Unpack some of the input; if it is corrupt, save every byte before the bad place."""
        before = self._member.copy()
        try:
            data = self._member.decompress(self._input, size)
        except zlib.error:
            self._stop("the gzip data is corrupt")
            return _bytes_before_error(before, self._input)
        self._input = self._member.unconsumed_tail or self._member.unused_data
        return data

    def _next_member(self) -> None:
        """Gzip files may be joined end to end; zeroes behind the last are padding."""
        self._input = self._input.lstrip(b"\0")
        if self._input.startswith(GZIP_MAGIC[: len(self._input)]) and self._input:
            self._member = zlib.decompressobj(_GZIP_WINDOW)
        elif self._input:
            self._stop("bytes that are not gzip follow the gzip data")
        else:
            self._done = not self._packed.peek(1)

    def _stop(self, why: str) -> None:
        self._done = True
        self._notes.append(f"{why} (near packed byte {self._packed.position}); read up to there")


def _bytes_before_error(member: zlib._Decompress, packed: bytes) -> bytes:
    """Unpack byte by byte, because zlib drops the output of the call that fails."""
    saved = b""
    try:
        for at in range(len(packed)):
            saved += member.decompress(packed[at : at + 1])
    except zlib.error:
        pass
    return saved


def open_stream(file: BinaryIO, notes: list[str]) -> ByteStream:
    """Return the bytes of `file`, unpacked when they are gzip."""
    plain = ByteStream(file.read)
    if plain.peek(len(GZIP_MAGIC)) != GZIP_MAGIC:
        return plain
    return ByteStream(Gunzip(plain, notes).read)
