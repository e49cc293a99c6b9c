"""CRC-16/MCRF4XX (the checksum of MAVLink) over many frames at once.

The checksum is linear: that of a frame is the XOR of what each byte contributes by its distance from the
end, and of what the start value 0xFFFF contributes by the length. Frames sorted by length are therefore
checked together, one table look-up per two bytes and no loop over frames.
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
WORD = 16
"""Bytes looked up from the buffer at once."""
LONGEST = 9 + 255 + 1 + WORD
"""Bytes that a checksum covers at most (header without magic, payload, seed), and a word of room."""


@functools.cache
def _byte_table() -> npt.NDArray[np.uint16]:
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
def _distance_tables() -> npt.NDArray[np.uint16]:
    """(LONGEST, 256) contribution of a byte value followed by k further bytes."""
    step = _byte_table()
    tables = np.empty((LONGEST, 256), np.uint16)
    tables[0] = step
    for k in range(1, LONGEST):
        tables[k] = step[tables[k - 1] & 0xFF] ^ (tables[k - 1] >> 8)
    return tables


@functools.cache
def _pair_table(distance: int) -> npt.NDArray[np.uint16]:
    """(65536,) contribution of two bytes, the second of which is followed by `distance` further bytes."""
    tables = _distance_tables()
    pairs: npt.NDArray[np.uint16] = np.bitwise_xor.outer(tables[distance], tables[distance + 1])
    return pairs.reshape(-1)


@functools.cache
def _start_values() -> npt.NDArray[np.uint16]:
    """(LONGEST + 1,) contribution of the start value to a checksum over n bytes."""
    step = _byte_table()
    values = np.empty(LONGEST + 1, np.uint16)
    values[0] = START
    for n in range(1, LONGEST + 1):
        values[n] = step[values[n - 1] & 0xFF] ^ (values[n - 1] >> 8)
    return values


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
) -> npt.NDArray[np.uint16]:
    """Return the checksum of each ``buffer[start : start + length]`` followed by its seed byte.

    `starts`, `lengths` and `seeds` are (n,); ranges are at most 264 long. Result (n,).
    """
    result = np.empty(len(starts), np.uint16)
    single = np.arange(len(starts)) if len(starts) <= FEW else np.flatnonzero(starts < WORD)
    for row in single.tolist():
        covered = buffer[starts[row] : starts[row] + lengths[row]]
        result[row] = crc16(covered.tobytes() + bytes([seeds[row]]))
    if len(single) < len(starts):
        rows = np.flatnonzero(starts >= WORD) if len(single) else np.arange(len(starts))
        rows = rows[np.argsort((LONGEST - lengths[rows]).astype(np.uint16), kind="stable")]
        result[rows] = _crc16_of_sorted(buffer, starts[rows], lengths[rows], seeds[rows])
    return result


def _crc16_of_sorted(
    buffer: npt.NDArray[np.uint8],
    starts: npt.NDArray[np.int64],
    lengths: npt.NDArray[np.int64],
    seeds: npt.NDArray[np.uint8],
) -> npt.NDArray[np.uint16]:
    """Return the checksums of ranges in order of falling length, none in the first word of `buffer`.

    Bytes are looked up in pairs from the end. A range of odd length takes the byte before it along, and
    what that contributes is taken back.
    """
    crc: npt.NDArray[np.uint16] = _start_values()[lengths + 1] ^ _distance_tables()[0][seeds]
    odd = np.flatnonzero(lengths & 1)
    before = buffer.take(starts.take(odd) - 1)
    crc[odd] ^= _distance_tables().reshape(-1).take((lengths.take(odd) + 1) * 256 + before)
    words = windows(buffer, f"V{WORD}")
    ends = starts + lengths - WORD
    longer = np.searchsorted(-lengths, -np.arange(LONGEST)).tolist()
    """By number of bytes: how many ranges are longer."""
    for done in range(0, int(lengths[0]), WORD):
        pairs = words[ends[: longer[done]] - done].view("<u2").reshape(-1, WORD // 2)
        for k in range(WORD // 2):
            behind = done + WORD - 2 - 2 * k
            active = longer[behind]
            crc[:active] ^= _pair_table(1 + behind).take(pairs[:active, k])
    return crc
