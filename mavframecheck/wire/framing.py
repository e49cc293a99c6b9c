"""Bytes to frames: find every good frame of a byte stream, and say which bytes hold none.

All magic bytes of a buffer are looked at together (header, length, checksum); then a walk takes runs of
frames that follow each other. Where the walk meets damage it decides with the least that is certain:

* a frame of a known id counts when its checksum holds;
* a frame of an unknown id, or one whose checksum fails, counts as such only where another record follows
  it exactly and no frame whose checksum holds begins within it; otherwise the reader steps on by one byte;
* after damage the reader goes on at the next frame whose checksum holds.

No decision is made before the bytes it depends on are there, so the result does not depend on how a stream
is cut into buffers.
"""

from __future__ import annotations

import functools
from bisect import bisect_left
from typing import NamedTuple

import numpy as np

from mavframecheck.model import Damage
from mavframecheck.wire.chunk import Chunk
from mavframecheck.wire.crc import crc16_of_ranges
from mavframecheck.wire.dialect import Dialect
from mavframecheck.wire.frames import (
    CHECKSUM,
    HEADER_V1,
    HEADER_V2,
    LONGEST_FRAME,
    SIGNATURE,
    SIGNED_FLAG,
    STAMP,
    STX_V2,
    Bools,
    Frames,
    Ints,
    are_magic,
)
from mavframecheck.wire.stamps import Stamps
from mavframecheck.wire.windows import windows

PADDING = bytes(LONGEST_FRAME)
"""Zeros behind a buffer, so that a window on a header, payload or checked word may reach over its end."""

CHECKED_AT_ONCE = 1 << 17
"""Checksums computed together: few frames are long, but a buffer of magic bytes asks for millions."""
NO_RECORD, STOP = -1, -2
CUT_OFF = "the frame is cut off"
"""Why the end of a recording that was not closed holds no frame."""


class Scan(NamedTuple):
    """What one buffer of one flow held."""

    buffer: bytes
    """The bytes that `frames.start` points into, padded with zeros."""
    frames: Frames
    damage: list[Damage]


class Framer:
    """Finds the frames of one flow, buffer after buffer."""

    def __init__(self, dialect: Dialect, *, stamped: bool) -> None:
        """Read with the ids and checksum seeds of `dialect`; `stamped` where a stamp precedes each frame."""
        self._dialect = dialect
        self._gap = STAMP if stamped else 0
        self._rest = Chunk(b"", np.zeros(0, np.int64), np.zeros(0, np.int64))
        self._stamps = Stamps()
        self._lost = ""

    def feed(self, chunk: Chunk | None) -> Scan:
        """Return the frames that are certain once `chunk` has arrived; None ends the flow."""
        joined = _padded(self._rest, chunk)
        size = len(joined.data) - len(PADDING)
        walk = _Walk(joined.data, size, self._dialect, self._gap, final=chunk is None)
        walk.run(self._lost)
        self._lost = walk.lost
        frames = self._frames(walk, joined)
        damage = [
            Damage(_offset_of(joined, first), last - first, reason)
            for first, last, reason in walk.skipped
        ]
        self._rest = _drop(joined, walk.done)
        return Scan(joined.data, frames, damage)

    def _frames(self, walk: _Walk, chunk: Chunk) -> Frames:
        """Return the accepted candidates of `walk` with their headers, offsets and receive times."""
        rows = np.concatenate([*walk.accepted, np.zeros(0, np.int64)])
        c, octets = walk.candidates, walk.octets
        start = c.start.take(rows)
        v2 = c.v2.take(rows)
        piece = np.searchsorted(chunk.starts, start, side="right") - 1
        t_us, has_stamp = self._receive_times(walk, chunk, start, piece, rows)
        length = c.length.take(rows)
        fields = start + np.where(v2, 4, 2)
        payload = start + c.header.take(rows)
        tail = payload + length
        return Frames(
            start=start,
            payload=payload,
            offset=start + (chunk.offsets - chunk.starts).take(piece),
            t_us=t_us,
            t_valid=self._stamps.valid(t_us, has_stamp),
            sysid=octets[1:].take(fields),
            compid=octets[2:].take(fields),
            seq=octets.take(fields),
            msgid=c.msgid.take(rows),
            length=length.astype(np.uint8),
            size=c.end.take(rows) - start,
            version=np.where(v2, np.uint8(2), np.uint8(1)),
            signed=c.signed.take(rows),
            known=c.known.take(rows),
            crc_ok=c.good.take(rows),
            checksum=octets.take(tail) | octets[1:].take(tail).astype(np.uint16) << 8,
            number=np.zeros(len(rows), np.int64),
            clock_us=np.zeros(len(rows), np.int64),
        )

    def _receive_times(
        self, walk: _Walk, chunk: Chunk, start: Ints, piece: Ints, rows: Ints
    ) -> tuple[Ints, Bools]:
        """Return the receive time of each frame, us, and whether the recording has one."""
        if not self._gap:
            if chunk.t_us is None:
                return np.zeros(len(start), np.int64), np.zeros(len(start), np.bool_)
            return chunk.t_us[piece], np.ones(len(start), np.bool_)
        previous_end = np.concatenate(([0], walk.candidates.end[rows[:-1]])) if len(rows) else start
        has_stamp = start - STAMP >= previous_end
        at = np.where(has_stamp, start - STAMP, 0)
        stamps = np.minimum(windows(walk.octets, ">u8")[at], np.uint64(2**63 - 1)).astype(np.int64)
        return np.where(has_stamp, stamps, 0), has_stamp


class _Candidates:
    """Every magic byte of a buffer, read as if a frame began there; all arrays are (m,).

    A MAVLink 2 header with incompatibility flags that this reader does not know is none: such a frame
    must be dropped (MAVLink developer guide, "Incompatibility Flags"). Where the buffer ends before those
    flags it is not sure yet that this is a header.
    """

    def __init__(self, octets: np.typing.NDArray[np.uint8], size: int, dialect: Dialect) -> None:
        magic = np.flatnonzero(are_magic(octets[:size]))
        plain = (octets.take(magic) != STX_V2) | (octets[2:].take(magic) <= SIGNED_FLAG)
        at = self.start = magic.compress(plain)
        head = windows(octets, f"V{HEADER_V2}")[at].view(np.uint8).reshape(-1, HEADER_V2)
        self.v2: Bools = head[:, 0] == STX_V2
        self.length: Ints = head[:, 1].astype(np.int64)
        self.header: Ints = np.where(self.v2, HEADER_V2, HEADER_V1)
        self.signed: Bools = self.v2 & (head[:, 2] == SIGNED_FLAG)
        self.end: Ints = at + self.length + self.header + CHECKSUM + SIGNATURE * self.signed
        narrow, low, middle, high = (head[:, place].astype(np.int32) for place in (5, 7, 8, 9))
        self.msgid = np.where(self.v2, low | middle << 8 | high << 16, narrow)
        self.seeds = dialect.seeds(self.msgid)
        self.known: Bools = self.seeds >= 0
        self.whole: Bools = self.end <= size
        self.sure: Bools = ~self.v2 | (at + 2 < size)
        self.good: Bools = np.zeros(len(at), np.bool_)
        self.checked: Bools = np.zeros(len(at), np.bool_)

    def at(self, position: Ints | int) -> Ints:
        """Return the candidate that begins at each position, or NO_RECORD."""
        if not len(self.start):
            return np.full(np.shape(position), NO_RECORD)
        place = np.searchsorted(self.start[:-1], position)
        return np.where(self.start[place] == position, place, NO_RECORD)


class _Walk:
    """One pass over one buffer. Positions are indices into it; `done` is how far it is decided."""

    def __init__(
        self, buffer: bytes, size: int, dialect: Dialect, gap: int, *, final: bool
    ) -> None:
        self.octets = np.frombuffer(buffer, np.uint8)
        self.size = size
        self.gap = gap
        self.final = final
        self.accepted: list[Ints] = []
        self.skipped: list[tuple[int, int, str]] = []
        self.done = 0
        self.lost = ""
        """Why the reader looks for the next good frame, where it found none up to the end of the buffer."""
        self.candidates = _Candidates(self.octets, size, dialect)
        self._index_successors()

    def run(self, lost: str) -> None:
        """Walk from frame to frame until the buffer, or what is certain of it, is used up.

        `lost` is that of the buffer before: damage goes on until a frame whose checksum holds.
        """
        certain = self._certain()
        chain = np.flatnonzero(certain)
        breaks = np.flatnonzero(self.successor[chain] != np.append(chain[1:], STOP))
        going = not lost or self._resume(lost)
        while going:
            i = int(self.candidates.at(self.done + self.gap))
            if i >= 0 and certain[i]:
                first = int(np.searchsorted(chain, i))
                last = int(breaks[np.searchsorted(breaks, first)])
                self._accept(chain[first : last + 1])
            else:
                going = self._settle(i)

    def _index_successors(self) -> None:
        """Find, for each candidate, the candidate that begins where its record ends."""
        c = self.candidates
        self.successor = np.arange(1, len(c.start) + 1)
        due = c.end + self.gap
        apart = np.flatnonzero(np.append(c.start, NO_RECORD)[1:] != due)
        self.successor[apart] = c.at(due[apart])
        self.ends_file: Bools = (c.end == self.size) & self.final
        self.due: Bools = (self.successor >= 0) & ~(c.sure[self.successor] | self.final)
        """Whether the bytes that tell if a record follows are still to come."""
        self.followed: Bools = c.whole & ((self.successor >= 0) & ~self.due | self.ends_file)

    def _certain(self) -> Bools:
        """Return the candidates that count without a closer look: certain frames follow each other."""
        c = self.candidates
        self._check(np.flatnonzero(c.known & self.followed))
        after = self.successor
        leads_on = (after >= 0) & (c.good[after] | self.followed[after])
        certain = c.good | (self.followed & leads_on)
        unchecked = np.flatnonzero(certain & ~c.good)
        certain[unchecked] = ~np.any(self._overlaps(unchecked), axis=0)
        return certain

    def _overlaps(self, rows: Ints) -> tuple[Bools, Bools]:
        """Return whether a good frame begins within each record at `rows`, and whether one still may.

        What has no checksum that holds must not cost a frame that has one.
        """
        c = self.candidates
        if not len(rows):
            return np.zeros(0, np.bool_), np.zeros(0, np.bool_)
        first, last = rows + 1, np.searchsorted(c.start, c.end[rows] + self.gap)
        window = slice(int(first[0]), int(last.max()))
        first, last = first - window.start, last - window.start
        edges = np.zeros(window.stop - window.start + 1, np.int64)
        np.add.at(edges, first, 1)
        np.add.at(edges, last, -1)
        covered = np.cumsum(edges)[:-1] > 0
        whole = c.whole[window]
        self._check(window.start + np.flatnonzero(covered & c.known[window] & whole))
        may_be_good = ~whole & (not self.final)
        return _any_between(c.good[window], first, last), _any_between(may_be_good, first, last)

    def _check(self, rows: Ints) -> None:
        """Compute the checksums of the candidates at `rows` that were not computed yet."""
        c = self.candidates
        rows = rows[~c.checked[rows]]
        for first in range(0, len(rows), CHECKED_AT_ONCE):
            self._check_some(rows[first : first + CHECKED_AT_ONCE])

    def _check_some(self, rows: Ints) -> None:
        c = self.candidates
        start = c.start[rows]
        covered = c.length[rows] + c.header[rows] - 1
        crc = crc16_of_ranges(self.octets, start + 1, covered, c.seeds[rows].astype(np.uint8))
        tail = start + 1 + covered
        received = self.octets[tail] | self.octets[tail + 1].astype(np.uint16) << 8
        c.good[rows] = crc == received
        c.checked[rows] = True

    def _is_good(self, i: int) -> bool:
        c = self.candidates
        if c.known[i] and c.whole[i]:
            self._check(np.array([i]))
        return bool(c.good[i])

    def _settle(self, i: int) -> bool:
        """Decide about the record due at `done`, candidate `i`; return whether the walk can go on."""
        c = self.candidates
        if i < 0:
            waiting = self.done + self.gap >= self.size and not self.final
            return False if waiting else self._resume("no frame begins where one is due")
        if not c.whole[i]:
            return self._resume(CUT_OFF) if self.final else False
        if self._is_good(i):
            return self._accept(np.array([i]))
        follows = self._record_follows(i)
        if follows:
            (holds_good,), (may_hold_good,) = self._overlaps(np.array([i]))
            if not (holds_good or may_hold_good):
                return self._accept(np.array([i]))
            follows = False if holds_good else None
        if follows is None:
            return False
        return self._resume("no checksum that holds, and no record behind it")

    def _accept(self, run: Ints) -> bool:
        """Take a run of candidates, each of which begins where the one before ends."""
        self.accepted.append(run)
        self.done = int(self.candidates.end[run[-1]])
        return True

    def _record_follows(self, i: int) -> bool | None:
        """Return whether a record begins exactly behind candidate `i`; None when more bytes must tell."""
        c = self.candidates
        if self.ends_file[i]:
            return True
        if c.end[i] + self.gap >= self.size:
            return False if self.final else None
        following = int(self.successor[i])
        if following < 0:
            return False
        if not c.whole[following]:
            return False if self.final else None
        if self._is_good(following) or self.followed[following]:
            return True
        waiting = self.due[following] or (
            c.end[following] + self.gap >= self.size and not self.final
        )
        return None if waiting else False

    def _resume(self, reason: str) -> bool:
        """Skip to the next frame whose checksum holds; return False when the buffer has no more.

        The stamp of that frame may be what is missing, so the search begins where the last one ended.
        """
        target = self._next_good(self.done)
        if not self.final:
            unsettled = _next(self._cut_starts, self.done)
            if unsettled is None and target is None:
                unsettled = self.size
            if unsettled is not None and (target is None or unsettled < target):
                self._skip_to(unsettled - self.gap, reason)
                self.lost = reason
                return False
        if target is None:
            self._skip_to(self.size, reason)
        else:
            stamp = target - self.gap
            self._skip_to(stamp if stamp >= self.done else target, reason)
        return target is not None and self._accept(self.candidates.at(np.array([target])))

    def _next_good(self, position: int) -> int | None:
        """Return the start of the first frame from `position` on whose checksum holds."""
        c = self.candidates
        first, width = int(np.searchsorted(c.start, position)), 8
        while first < len(c.start):
            rows = np.arange(first, min(first + width, len(c.start)))
            rows = rows[c.known[rows] & c.whole[rows]]
            self._check(rows)
            good = rows[c.good[rows]]
            if len(good):
                return int(c.start[good[0]])
            first, width = first + width, width * 2
        return None

    @functools.cached_property
    def _cut_starts(self) -> list[int]:
        """Starts of what may be frames that the end of the buffer cuts off."""
        c = self.candidates
        starts: list[int] = c.start[~c.whole].tolist()
        return starts

    def _skip_to(self, position: int, reason: str) -> None:
        if position > self.done:
            self.skipped.append((self.done, position, reason))
            self.done = position


def _any_between(flags: Bools, first: Ints, last: Ints) -> Bools:
    """Return for each range ``first : last`` whether any of `flags` in it holds."""
    before = np.concatenate(([0], np.cumsum(flags)))
    holds: Bools = before[last] > before[first]
    return holds


def _next(starts: list[int], position: int) -> int | None:
    """Return the first of the ascending `starts` that is not before `position`."""
    k = bisect_left(starts, position)
    return starts[k] if k < len(starts) else None


def _padded(rest: Chunk, chunk: Chunk | None) -> Chunk:
    """Return `rest`, continued by `chunk` where there is one, and padding."""
    if chunk is None:
        return rest._replace(data=rest.data + PADDING)
    shift = len(rest.data)
    t_us = None
    if chunk.t_us is not None:
        t_us = chunk.t_us if rest.t_us is None else np.concatenate((rest.t_us, chunk.t_us))
    return Chunk(
        b"".join((rest.data, chunk.data, PADDING)),
        np.concatenate((rest.starts, chunk.starts + shift)),
        np.concatenate((rest.offsets, chunk.offsets)),
        t_us,
        chunk.flow,
    )


def _drop(padded: Chunk, done: int) -> Chunk:
    """Return what follows the first `done` bytes of a padded chunk, without the padding."""
    first = max(int(np.searchsorted(padded.starts, done, side="right")) - 1, 0)
    starts, offsets = padded.starts[first:] - done, padded.offsets[first:].copy()
    if len(starts) and starts[0] < 0:
        offsets[0] -= starts[0]
        starts[0] = 0
    t_us = None if padded.t_us is None else padded.t_us[first:]
    return Chunk(padded.data[done : -len(PADDING)], starts, offsets, t_us, padded.flow)


def _offset_of(chunk: Chunk, position: int) -> int:
    """Return the offset in the recording of an index into `chunk`."""
    piece = int(np.searchsorted(chunk.starts, position, side="right")) - 1
    return int(chunk.offsets[piece] + position - chunk.starts[piece])
