"""Who sends what: counts and times per stream, and the bound on how many are judged."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.wire import Dialect, Frames

MAX_SENDERS = 256
MAX_STREAMS = 4096

Bools = npt.NDArray[np.bool_]


class Stream(NamedTuple):
    """One message id of one sender."""

    sysid: int
    compid: int
    message: str
    frames: int


class Traffic:
    """Counts frames per (sender, message); admits the first 256 senders and 4 096 streams."""

    def __init__(self, dialect: Dialect) -> None:
        """Count messages of `dialect`."""
        self._names = list(dialect.by_name)
        size = max(dialect.layouts, default=0) + 2
        self._message_slot = np.full(size, -1, np.int32)
        self._message_slot[[dialect.by_name[name].msgid for name in self._names]] = np.arange(
            len(self._names)
        )
        self._sender_slot = np.full(65536, -1, np.int32)
        self._senders: list[int] = []
        self._counts = np.zeros(MAX_SENDERS * len(self._names), np.int64)
        self._known = np.zeros(MAX_SENDERS * len(self._names), np.bool_)
        self._streams = 0
        self.refused = 0
        """Frames of senders or streams beyond the bounds: read, not judged."""
        self.t_first: float | None = None
        self.t_last: float | None = None
        """Receive time of the first and last frame with a valid stamp, s since 1970."""

    @property
    def duration_s(self) -> float | None:
        """Receive time from the first to the last frame, s; None without stamps."""
        if self.t_first is None or self.t_last is None:
            return None
        return self.t_last - self.t_first

    def admit(self, frames: Frames) -> Bools:
        """Count `frames`; return (n,) which of them are to be judged."""
        self._note_times(frames)
        slots = self._sender_slots(frames.sender, frames.good)
        seen = frames.good & (slots >= 0)
        message = self._message_slot.take(frames.msgid, mode="clip")
        stream = np.where(seen, slots * np.int64(len(self._names)) + message, 0)
        seen &= self._admit_streams(stream, seen)
        self._counts += np.bincount(stream.compress(seen), minlength=len(self._counts))
        self.refused += int(np.count_nonzero(frames.good)) - int(np.count_nonzero(seen))
        return seen

    def _note_times(self, frames: Frames) -> None:
        t_us = frames.t_us[frames.t_valid]
        if len(t_us):
            low, high = float(t_us.min()) * 1e-6, float(t_us.max()) * 1e-6
            self.t_first = low if self.t_first is None else min(self.t_first, low)
            self.t_last = high if self.t_last is None else max(self.t_last, high)

    def _sender_slots(self, senders: npt.NDArray[np.int64], good: Bools) -> npt.NDArray[np.int32]:
        slots = self._sender_slot.take(senders)
        fresh = senders[good & (slots < 0)]
        if len(fresh) and len(self._senders) < MAX_SENDERS:
            new, first = np.unique(fresh, return_index=True)
            for sender in new[np.argsort(first)].tolist()[: MAX_SENDERS - len(self._senders)]:
                self._sender_slot[sender] = len(self._senders)
                self._senders.append(sender)
            slots = self._sender_slot[senders]
        return slots

    def _admit_streams(self, stream: npt.NDArray[np.int64], seen: Bools) -> Bools:
        known = self._known.take(stream)
        fresh = stream[seen & ~known]
        if len(fresh) and self._streams < MAX_STREAMS:
            new, first = np.unique(fresh, return_index=True)
            taken = new[np.argsort(first)][: MAX_STREAMS - self._streams]
            self._known[taken] = True
            self._streams += len(taken)
            known = self._known.take(stream)
        return known

    def streams(self) -> list[Stream]:
        """Return every admitted stream by sender and message name."""
        found = []
        for place in np.flatnonzero(self._counts).tolist():
            slot, message = divmod(place, len(self._names))
            sender = self._senders[slot]
            found.append(
                Stream(sender >> 8, sender & 0xFF, self._names[message], int(self._counts[place]))
            )
        return sorted(found)
