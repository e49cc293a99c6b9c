"""CRC-16/MCRF4XX (the checksum of MAVLink) over many frames at once.

Two bytes fill the register, so one table says what it becomes when two more are shifted in. Frames in order
of falling length take this step together, those that have ended staying behind: no loop over frames.
Source: MAVLink developer guide, "Packet Serialization"; CRC catalogue entry CRC-16/MCRF4XX.
"""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from mavframecheck.wire.windows import windows

START = 0xFFFF
FEW = 16
"""Up to this many ranges are checked one by one: that is faster than setting up the columns."""
WORD = 32
"""Bytes taken from the buffer at once."""
TOGETHER = 1 << 15
"""Ranges that take steps together: neighbours, whose bytes and registers stay in the cache."""
LONG = 64
"""Few ranges are longer than this: they take their many steps by themselves."""

Registers = npt.NDArray[np.uint16]


@functools.cache
def _byte_table() -> Registers:
    """(256,) what a byte in the low half of the register turns into after eight shifts."""
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ 0x8408, table >> 1).astype(np.uint16)
    return table


@functools.cache
def _byte_list() -> list[int]:
    """Return the same as a list, which is faster to ask for one byte."""
    table: list[int] = _byte_table().tolist()
    return table


@functools.cache
def _pair_table() -> Registers:
    """(65536,) what the whole register turns into after sixteen shifts."""
    return _shifted(_shifted(np.arange(1 << 16, dtype=np.uint16)))


def _shifted(registers: Registers) -> Registers:
    """Return registers after eight shifts."""
    return _looked_up(_byte_table(), registers & np.uint16(0xFF)) ^ (registers >> np.uint16(8))


def _looked_up(table: Registers, places: Registers) -> Registers:
    """Return a table at `places`, (n,), which lie in it: to wrap costs less than to make sure."""
    found: Registers = table.take(places, mode="wrap")
    return found


def crc16(data: bytes) -> int:
    """Return the checksum of one byte string of any length."""
    step = _byte_list()
    crc = START
    for byte in data:
        crc = step[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc


def crc16_of_ranges(
    buffer: npt.NDArray[np.uint8],
    starts: npt.NDArray[np.int64],
    lengths: npt.NDArray[np.int64],
    seeds: npt.NDArray[np.uint8],
) -> Registers:
    """Return the checksum of each ``buffer[start : start + length]`` followed by its seed byte.

    `starts`, `lengths` and `seeds` are (n,); at least `WORD` bytes lie behind every range. Result (n,).
    """
    result = np.empty(len(starts), np.uint16)
    if len(starts) <= FEW:
        for row, (start, length) in enumerate(zip(starts.tolist(), lengths.tolist(), strict=True)):
            result[row] = crc16(buffer[start : start + length].tobytes() + bytes([seeds[row]]))
        return result
    for alike in (np.flatnonzero(lengths > LONG), np.flatnonzero(lengths <= LONG)):
        for first in range(0, len(alike), TOGETHER):
            rows = alike[first : first + TOGETHER]
            falling = np.argsort((0xFFFF - lengths.take(rows)).astype(np.uint16), kind="stable")
            rows = rows.take(falling)
            result[rows] = _crc16_of_sorted(
                buffer, starts.take(rows), lengths.take(rows), seeds.take(rows)
            )
    return result


def _crc16_of_sorted(
    buffer: npt.NDArray[np.uint8],
    starts: npt.NDArray[np.int64],
    lengths: npt.NDArray[np.int64],
    seeds: npt.NDArray[np.uint8],
) -> Registers:
    """Return the checksums of ranges in order of falling length."""
    crc = np.full(len(starts), START, np.uint16)
    words, table = windows(buffer, f"V{WORD}"), _pair_table()
    as_long = np.searchsorted(-lengths, -np.arange(int(lengths[0]) + WORD), "right").tolist()
    """By number of bytes: how many ranges have them."""
    for done in range(0, int(lengths[0]) - 1, WORD):
        pairs = words[starts[: as_long[done + 2]] + done].view("<u2").reshape(-1, WORD // 2)
        for k in range(WORD // 2):
            going = as_long[done + 2 * k + 2]
            crc[:going] = _looked_up(table, crc[:going] ^ pairs[:going, k])
    odd = np.flatnonzero(lengths & 1)
    last = buffer.take(starts.take(odd) + lengths.take(odd) - 1)
    crc[odd] = _shifted(crc[odd] ^ last)
    return _shifted(crc ^ seeds)
