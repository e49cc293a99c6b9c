"""Frames: what the headers of a batch say, as a struct of arrays."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

STX_V1, STX_V2 = 0xFE, 0xFD
HEADER_V1, HEADER_V2 = 6, 10
CHECKSUM, SIGNATURE, STAMP = 2, 13, 8
SIGNED_FLAG = 0x01
LONGEST_FRAME = HEADER_V2 + 255 + CHECKSUM + SIGNATURE

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
RowOrRows = TypeVar("RowOrRows", int, Ints)


def are_magic(octets: npt.NDArray[np.uint8]) -> Bools:
    """Return (n,) which of (n,) bytes may begin a frame: of all values only 0xFF is above both magic bytes."""
    return np.asarray((octets >= STX_V2) & (octets != 0xFF))


class Place(NamedTuple):
    """Where a frame, or a damaged range, is in the recording."""

    number: int
    t_us: int | None
    """Receive time, us since 1970; None where it cannot be believed."""
    offset: int
    size: int


class Frames:
    """The frames of a batch in the order in which they were received; every array is (n,).

    Frames taken from others take over a column only when somebody looks at it.
    """

    start: Ints
    """Index of the magic byte in the buffer of the batch."""
    payload: Ints
    """Index of the first payload byte there."""
    offset: Ints
    """Offset of the magic byte in the recording, bytes."""
    t_us: Ints
    """Receive time as recorded, us since 1970; 0 where the recording has none."""
    t_valid: Bools
    """Whether `t_us` may enter a duration, rate, gap or fit."""
    sysid: npt.NDArray[np.uint8]
    compid: npt.NDArray[np.uint8]
    seq: npt.NDArray[np.uint8]
    msgid: npt.NDArray[np.int32]
    length: npt.NDArray[np.uint8]
    """Payload bytes received."""
    size: Ints
    """Bytes of the whole frame."""
    version: npt.NDArray[np.uint8]
    """1 or 2."""
    signed: Bools
    known: Bools
    """Whether the dialect has the message id."""
    crc_ok: Bools
    """Whether the checksum holds; False for unknown ids, which cannot be checked."""
    checksum: npt.NDArray[np.uint16]
    """As received."""
    number: Ints
    """Running number of the frame in the whole stream: the order that context is joined by."""
    clock_us: Ints
    """Latest `t_us` that could be believed so far: the time of the recording, which never goes back."""

    def __init__(self, **columns: npt.NDArray[Any]) -> None:
        """Hold `columns` by name."""
        self.__dict__.update(columns)
        self._source: Frames | None = None
        self._rows: Ints | slice = slice(None)

    def __getattr__(self, name: str) -> Any:
        """Take a column over from the frames that these were taken from."""
        source = self.__dict__.get("_source")
        if source is None or name not in COLUMNS:
            raise AttributeError(name)
        column = self.__dict__[name] = _picked(getattr(source, name), self._rows)
        return column

    def __len__(self) -> int:
        """Return the number of frames."""
        if self._source is None:
            return len(self.start)
        rows = self._rows
        return len(range(len(self._source))[rows] if isinstance(rows, slice) else rows)

    def take(self, rows: Ints | Bools | slice) -> Frames:
        """Return the frames at `rows`."""
        taken = Frames()
        taken._source = self
        taken._rows = rows if isinstance(rows, slice) else places_of(rows)
        return taken

    def place(self, row: int) -> Place:
        """Return where the frame at `row` is; a negative one counts from the end."""
        whole, row = self._origin(row if row >= 0 else row + len(self))
        t_us = int(whole.t_us[row]) if whole.t_valid[row] else None
        return Place(int(whole.number[row]), t_us, int(whole.offset[row]), int(whole.size[row]))

    def own(self) -> Frames:
        """Return the same frames without holding on to those they were taken from."""
        whole, rows = self._origin(np.arange(len(self)))
        return Frames(**{name: getattr(whole, name).take(rows) for name in COLUMNS})

    def _origin(self, rows: RowOrRows) -> tuple[Frames, RowOrRows]:
        """Return the frames that hold the columns, and where `rows` are among them: few columns of few rows."""
        frames = self
        while frames._source is not None:
            if isinstance(frames._rows, slice):
                first, _, step = frames._rows.indices(len(frames._source))
                rows = first + rows * step
            else:
                rows = frames._rows[rows]
            frames = frames._source
        return frames, rows

    @functools.cached_property
    def sender(self) -> Ints:
        """(n,) system and component as one number: ``sysid * 256 + compid``."""
        if self._source is not None:
            return _picked(self._source.sender, self._rows)
        sender: Ints = self.sysid.astype(np.int64) * 256 + self.compid
        return sender

    @property
    def good(self) -> Bools:
        """(n,) frames whose payload can be believed."""
        return self.crc_ok


def places_of(rows: Ints | Bools) -> Ints:
    """Return rows that are given by a mask as places, which several columns are taken at faster."""
    return np.flatnonzero(rows) if rows.dtype == np.bool_ else np.asarray(rows, np.int64)


def _picked(column: npt.NDArray[Any], rows: Ints | slice) -> npt.NDArray[Any]:
    return column[rows] if isinstance(rows, slice) else column.take(rows)


COLUMNS = tuple(Frames.__annotations__)
"""Names of the columns."""


def join(parts: list[Frames]) -> Frames:
    """Return all frames of `parts`, one after the other."""
    return Frames(**{n: np.concatenate([getattr(p, n) for p in parts]) for n in COLUMNS})
