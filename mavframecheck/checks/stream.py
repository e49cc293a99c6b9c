"""Checks of the byte stream itself: damage, losses, duplicates, ids that nobody can judge."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Check, Observation, Verdict
from mavframecheck.model import Damage, Scalar, Subject
from mavframecheck.vehicle import Context
from mavframecheck.wire import Batch, Dialect, Frames, Place, Ranges
from mavframecheck.wire.frames import STAMP
from mavframecheck.wire.framing import CUT_OFF

MAX_COUNTERS = 256
"""Senders whose counters are followed."""
MAX_IDS = 1000
"""Unknown ids that are told apart."""

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
_SLOTS_PER_FRAME = 4
"""Keys that may be equal are told by slots: enough of them that few other keys share one."""


class _Span:
    """First and last frame of something, and how often it was there."""

    def __init__(self) -> None:
        self.first: Place | None = None
        self.last: Place | None = None
        self.count = 0

    def add(self, frames: Frames, rows: Bools) -> None:
        """Add the frames at `rows`."""
        found = np.flatnonzero(rows)
        if not len(found):
            return
        self.first = self.first or frames.place(int(found[0]))
        self.last = frames.place(int(found[-1]))
        self.count += len(found)

    def observation(
        self, subject: Subject, count: int | None = None, **values: Scalar
    ) -> Iterator[Observation]:
        """Yield an observation, if there was anything."""
        if self.first is not None and self.last is not None:
            yield Observation(subject, self.first, self.last, count or self.count, values)


class ChecksumFailures(Check):
    """Frames of known messages whose checksum fails, with a record right behind them."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Count nothing yet."""
        super().__init__(params, dialect)
        self._span = _Span()
        self._known = 0
        self._failed: Counter[int] = Counter()
        self._held: set[str] = set()

    def update(self, batch: Batch, _context: Context) -> None:
        """Count the frames whose checksum holds and fails, by message id."""
        frames = batch.frames
        failed = frames.known & ~frames.crc_ok
        self._known += int(np.count_nonzero(frames.known))
        self._span.add(frames, failed)
        self._failed.update(frames.msgid[failed].tolist())
        self._held.update(batch.tables)

    def finish(self) -> Iterable[Observation]:
        """Return one observation for the whole recording."""
        failed = {self.dialect.layouts[i].name: n for i, n in self._failed.most_common()}
        enough = self.params["min_always"]
        always = [name for name, n in failed.items() if n >= enough and name not in self._held]
        hint = ""
        if always:
            hint = (
                f" {', '.join(always)} never has a good checksum: its sender uses another "
                "definition of the message (--dialect tells which)."
            )
        return self._span.observation(
            Subject(),
            frames=self._span.count,
            share=self._span.count / max(self._known, 1),
            messages=", ".join(list(failed)[:5]),
            hint=hint,
        )

    def verdict(self) -> Verdict:
        """Return the frames of known messages."""
        return Verdict(self._known)


class StrayBytes(Check):
    """Byte ranges that hold no frame."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Count nothing yet."""
        super().__init__(params, dialect)
        self._frames = 0
        self._before: Place | None = None
        self._first: Place | None = None
        self._last: Place | None = None
        self._ranges = Ranges()
        self._opened: Place | None = None
        """The frame before the open range."""
        self._count = 0
        self._bytes = 0
        self._end = 0

    def update(self, batch: Batch, _context: Context) -> None:
        """Count damaged ranges; ranges that touch are one."""
        frames = batch.frames
        for damage in batch.damage:
            self._take(self._ranges.add([damage]))
            if self._ranges.open is damage:
                row = int(np.searchsorted(frames.offset, damage.offset)) - 1
                self._opened = frames.place(row) if row >= 0 else self._before
        if len(frames):
            self._frames += len(frames)
            self._before = frames.place(len(frames) - 1)
            self._end = max(self._end, self._before.offset + self._before.size)

    def _take(self, ranges: Iterable[Damage]) -> None:
        """Count complete ranges, placed by the number and time of the frame before them."""
        for damage in ranges:
            before = self._opened
            number, t_us = (before.number, before.t_us) if before is not None else (0, None)
            self._last = Place(number, t_us, damage.offset, damage.length)
            self._first = self._first or self._last
            self._count += 1
            self._bytes += damage.length

    def finish(self) -> Iterable[Observation]:
        """Return one observation for the whole recording."""
        last_range = self._ranges.open
        self._take(self._ranges.close())
        if self._first is None or self._last is None:
            return
        torn = (
            self._count == 1
            and last_range is not None
            and last_range.offset >= self._end
            and (last_range.reason == CUT_OFF or last_range.length <= STAMP)
        )
        values = {"ranges": self._count, "bytes": self._bytes, "only_torn_tail": torn}
        yield Observation(Subject(), self._first, self._last, self._count, values)

    def verdict(self) -> Verdict:
        """Return the frames read."""
        return Verdict(self._frames)


class UnknownIds(Check):
    """Frames whose message id the dialect lacks."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Count nothing yet."""
        super().__init__(params, dialect)
        self._span = _Span()
        self._frames = 0
        self._ids: Counter[int] = Counter()

    def update(self, batch: Batch, _context: Context) -> None:
        """Count unknown ids."""
        unknown = ~batch.frames.known
        self._frames += len(batch.frames)
        self._span.add(batch.frames, unknown)
        ids, first, counts = np.unique(
            batch.frames.msgid[unknown], return_index=True, return_counts=True
        )
        for k in np.argsort(first).tolist():
            if int(ids[k]) in self._ids or len(self._ids) < MAX_IDS:
                self._ids[int(ids[k])] += int(counts[k])

    def finish(self) -> Iterable[Observation]:
        """Return one observation for the whole recording."""
        listed = ", ".join(f"{msgid} ({count})" for msgid, count in self._ids.most_common(10))
        return self._span.observation(
            Subject(), frames=self._span.count, ids=listed, dialect=self.dialect.name
        )

    def verdict(self) -> Verdict:
        """Return the frames read."""
        return Verdict(self._frames)


class LostFrames(Check):
    """Gaps in the sequence counter of a sender."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Know no sender yet."""
        super().__init__(params, dialect)
        self._last: dict[int, int] = {}
        self._received: Counter[int] = Counter()
        self._lost: Counter[int] = Counter()
        self._backwards: Counter[int] = Counter()
        self._spans: dict[int, _Span] = {}

    def update(self, batch: Batch, _context: Context) -> None:
        """Follow each counter through the batch."""
        frames = batch.frames
        counted = frames.crc_ok | ~frames.known
        rows = np.flatnonzero(counted)
        sender = frames.sender[rows]
        order = np.argsort(sender.astype(np.uint16), kind="stable")
        edges = np.flatnonzero(np.diff(sender[order])) + 1
        groups = [group for group in np.split(rows[order], edges) if len(group)]
        for group in sorted(groups, key=lambda group: int(group[0])):
            first = int(group[0])
            self._follow(int(frames.sysid[first]) << 8 | int(frames.compid[first]), frames, group)

    def _follow(self, sender: int, frames: Frames, rows: Ints) -> None:
        if sender not in self._last and len(self._last) >= MAX_COUNTERS:
            return
        seq = frames.seq.take(rows)
        before = self._last.get(sender, int(seq[0]) - 1)
        step = np.diff(seq, prepend=np.uint8(before % 256))  # modulo 256, as they count
        max_gap = min(self.params["max_gap"], 255)
        gap = (step > 1) & (step <= max_gap)
        self._backwards[sender] += int(np.count_nonzero((step == 0) | (step > max_gap)))
        self._received[sender] += len(rows)
        self._lost[sender] += int(step[gap].sum()) - int(np.count_nonzero(gap))
        self._last[sender] = int(seq[-1])
        span = self._spans.setdefault(sender, _Span())
        if gap.any():
            holes = np.zeros(len(frames), np.bool_)
            holes[rows[gap]] = True
            span.add(frames, holes)

    def finish(self) -> Iterable[Observation]:
        """Return one observation per sender that lost more than the rule allows."""
        for sender in sorted(self._spans):
            received, lost = self._received[sender], self._lost[sender]
            share = lost / max(received + lost, 1)
            if (
                self._one_counter(sender)
                and lost >= self.params["min_lost"]
                and share >= self.params["min_share"]
            ):
                subject = Subject(sender >> 8, sender & 0xFF)
                yield from self._spans[sender].observation(
                    subject, lost=lost, share=share, received=received
                )

    def _one_counter(self, sender: int) -> bool:
        """Return whether the counter of a sender runs forward, as one on a single link does."""
        allowed = self.params["max_backwards_share"] * self._received[sender]
        return bool(self._backwards[sender] <= allowed)

    def verdict(self) -> Verdict:
        """Return the frames of senders with one running counter."""
        judged = sum(n for sender, n in self._received.items() if self._one_counter(sender))
        if self._received and not judged:
            return Verdict(
                0, "every sender's sequence counter runs backwards: several links in one recording"
            )
        return Verdict(judged)


class DuplicatedTraffic(Check):
    """The same frame twice within a short stretch: two links merged, or a routing loop."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Remember nothing yet."""
        super().__init__(params, dialect)
        self._window = max(1, int(params["window"]))
        self._recent: Ints = np.zeros(0, np.int64)
        """Keys of the frames that are still near, and their numbers."""
        self._recent_number: Ints = np.zeros(0, np.int64)
        self._frames: Counter[int] = Counter()
        self._twice: Counter[int] = Counter()
        self._spans: dict[int, _Span] = {}

    def update(self, batch: Batch, _context: Context) -> None:
        """Look each frame up among those of the last `window` frames."""
        frames, near = batch.frames, len(self._recent)
        if not frames.crc_ok.any():
            return
        told = np.concatenate((self._recent >> 24, _told(frames)))
        numbers = np.concatenate((self._recent_number, frames.number))
        may_repeat = self._may_repeat(told, numbers)
        may_repeat[near:] &= frames.crc_ok
        some = np.flatnonzero(may_repeat)
        numbers = numbers.take(some)
        keys = np.concatenate(
            (self._recent[some[some < near]], _keys(frames.take(some[some >= near] - near)))
        )
        shared = np.flatnonzero(self._may_repeat(keys ^ keys >> 20 ^ keys >> 37, numbers))
        some, keys, numbers = some.take(shared), keys.take(shared), numbers.take(shared)
        order = np.argsort(keys, kind="stable")
        same = (np.diff(keys[order]) == 0) & (np.diff(numbers[order]) <= self._window)
        again = some[order[1:][same]]
        self._count(frames, again[again >= near] - near)
        self._remember(frames)

    def _may_repeat(self, told: Ints, numbers: Ints) -> Bools:
        """Return (n,) all that occur again within the window, by a part of what tells frames apart, and few others.

        The stream is cut in two ways into stretches of two windows: what is near lies in one stretch of either.
        """
        slots = 1 << (2 * self._window * _SLOTS_PER_FRAME).bit_length()
        since = numbers - (numbers[0] if len(numbers) else 0)
        near = np.zeros(len(told), np.bool_)
        for shift in (0, self._window):
            stretch = (since + shift) // (2 * self._window)
            near |= _shared(stretch * slots + (told & (slots - 1)))
        return near

    def _remember(self, frames: Frames) -> None:
        """Keep what the next frames may repeat."""
        oldest = int(frames.number[-1]) - self._window
        last = max(len(frames) - self._window, 0)
        ones = frames.take(last + np.flatnonzero(frames.crc_ok[last:]))
        kept = self._recent_number > oldest
        self._recent = np.concatenate((self._recent[kept], _keys(ones)))
        self._recent_number = np.concatenate((self._recent_number[kept], ones.number))

    def _count(self, frames: Frames, repeated: Ints) -> None:
        for sysid, count in enumerate(np.bincount(frames.sysid.compress(frames.crc_ok)).tolist()):
            if count:
                self._frames[sysid] += count
        systems = frames.sysid[repeated]
        for sysid in np.unique(systems).tolist():
            mine = np.zeros(len(frames), np.bool_)
            mine[repeated[systems == sysid]] = True
            self._twice[sysid] += int(np.count_nonzero(mine))
            self._spans.setdefault(sysid, _Span()).add(frames, mine)

    def finish(self) -> Iterable[Observation]:
        """Return one observation per system of which more came twice than the rule allows."""
        for sysid, twice in sorted(self._twice.items()):
            share = twice / self._frames[sysid]
            if twice >= self.params["min_frames"] and share >= self.params["min_share"]:
                yield from self._spans[sysid].observation(Subject(sysid), frames=twice, share=share)

    def verdict(self) -> Verdict:
        """Return the frames looked at."""
        return Verdict(sum(self._frames.values()))


def _keys(frames: Frames) -> Ints:
    """Return (n,) sender, checksum, sequence number and message as one number."""
    return (frames.sender << 24 | _told(frames)) << 24 | (frames.msgid & 0xFFFFFF)


def _told(frames: Frames) -> Ints:
    """Return (n,) the part of each key that tells most frames apart: checksum and sequence number."""
    return frames.checksum.astype(np.int64) << 8 | frames.seq


def _shared(slots: Ints) -> Bools:
    """Return (n,) which of the numbers, small ones, occur more than once."""
    size = int(slots.max(initial=0)) + 1
    owner = np.empty(size, np.int32)
    places = np.arange(len(slots), dtype=np.int32)
    owner[slots] = places
    twice = np.zeros(size, np.bool_)
    twice[slots[owner.take(slots) != places]] = True
    return twice.take(slots)
