"""How a link does: rates, loss and latency of the last seconds, silence, restarts and newcomers."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mavframecheck.model import Damage
from mavframecheck.model.live import Event, Happening, LinkStatus, SenderStatus, State
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.traffic import MAX_SENDERS
from mavframecheck.wire import Batch, Frames, Table

WINDOW_S = 10
"""Rates and losses are those of the last so many seconds."""
SILENT_S = 5.0
"""A link, or a vehicle, that says nothing for so long (s) is silent: heartbeats come every second."""
GARBAGE_S = 10.0
"""Garbage is said again after so long (s)."""
MAX_GAP = 128
"""A sequence counter that moved further (of 256) went back."""
_FORGET_S = 60.0
"""The fastest message of the last so many seconds tells what latency counts from."""
_RESTART_S = 30.0
_STAMP = "time_boot_ms"

Ints = npt.NDArray[np.int64]


class Recent:
    """A sum over the last ten seconds."""

    def __init__(self) -> None:
        """Start with nothing, at no time."""
        self._parts: deque[tuple[int, float]] = deque()

    def add(self, now: float, amount: float) -> None:
        """Add an amount at a time (s)."""
        second = int(now)
        if self._parts and self._parts[-1][0] >= second:
            second, before = self._parts.pop()
            amount += before
        self._parts.append((second, amount))
        self._forget(now)

    def total(self, now: float) -> float:
        """Return the sum."""
        self._forget(now)
        return sum(amount for _, amount in self._parts)

    def _forget(self, now: float) -> None:
        while self._parts and self._parts[0][0] <= now - WINDOW_S:
            self._parts.popleft()


@dataclass(slots=True)
class _Counts:
    """Frames that came, and those that did not, in the last seconds."""

    began: float
    came: Recent = field(default_factory=Recent)
    lost: Recent = field(default_factory=Recent)

    def rate_hz(self, now: float) -> float:
        return self.came.total(now) / min(max(now - self.began, 1.0), WINDOW_S)

    def loss(self, now: float) -> float | None:
        came, lost = self.came.total(now), self.lost.total(now)
        return lost / (came + lost) if came + lost else None


@dataclass(slots=True)
class _Sender:
    """A component: its counter, and how late its messages are."""

    counts: _Counts
    seq: int
    heard: float
    fastest: deque[tuple[float, float]] = field(default_factory=deque)
    """Time and least lag (s) of each recent batch, ever greater."""
    lag_s: float | None = None

    def latency_s(self) -> float | None:
        """Return how much later than the fastest one its last messages came, s."""
        return None if self.lag_s is None else max(0.0, self.lag_s - self.fastest[0][1])

    def late(self, now: float, lags: npt.NDArray[np.float64]) -> None:
        """Take receive times minus stamps, s; their least value moves when a clock begins again."""
        low, self.lag_s = float(lags.min()), float(np.median(lags))
        if self.fastest and abs(low - self.fastest[0][1]) > _RESTART_S:
            self.fastest.clear()
        while self.fastest and self.fastest[-1][1] >= low:
            self.fastest.pop()
        self.fastest.append((now, low))
        while self.fastest[0][0] < now - _FORGET_S:
            self.fastest.popleft()


@dataclass(slots=True)
class _System:
    """A vehicle or station: whether it is silent, and how often it restarted."""

    heard: float
    silent: bool = False
    boots: int = 0


class Pulse:
    """Watches one link."""

    def __init__(self, link: str, now: float) -> None:
        """Begin at `now`, s since 1970, with nothing heard on the link called `link`."""
        self._link = link
        self._counts = _Counts(now)
        self._bytes = Recent()
        self._messages = 0
        self._garbage = self._garbage_said = 0
        self._garbage_next = now
        self._heard: float | None = None
        self._open = True
        self._senders: dict[int, _Sender] = {}
        self._systems: dict[int, _System] = {}
        self._silent = False
        self._events: list[Event] = []

    def say(self, what: Happening, now: float, text: str, sysid: int | None = None) -> None:
        """Keep an event for the next `events`."""
        self._events.append(Event(what=what, time=now, link=self._link, text=text, sysid=sysid))

    def note(self, what: Happening, now: float, text: str) -> None:
        """Take what happened to the port."""
        if what in ("open", "closed"):
            self._open = what == "open"
        self.say(what, now, text)

    def hear(self, batch: Batch, damage: list[Damage], context: Context, now: float) -> None:
        """Take in what came by `now`, and the bytes that held no frame."""
        self._garbage += sum(each.length for each in damage)
        frames = batch.frames
        if not len(frames):
            return
        self._heard = now
        self._messages += len(frames)
        self._bytes.add(now, float(frames.size.sum()))
        for sender in np.unique(frames.sender).tolist():
            self._follow(sender, frames.take(frames.sender == sender), context, now)
        for table in batch.tables.values():
            if _STAMP in table.layout.by_name:
                self._time(table, now)
        self._count_boots(context, int(frames.number[-1]), now)

    def _follow(self, sender: int, frames: Frames, context: Context, now: float) -> None:
        """Count the frames of one sender, and those its counter says are missing."""
        seq = frames.seq[frames.crc_ok | ~frames.known].astype(np.int64)
        if not len(seq):
            return
        known = self._senders.get(sender)
        if known is None:
            if len(self._senders) >= MAX_SENDERS:
                return
            known = self._senders[sender] = _Sender(_Counts(now), int(seq[0]) - 1, now)
            self._meet(sender, context, now)
        step = np.diff(seq, prepend=known.seq) % 256
        lost = float((step[(step > 1) & (step <= MAX_GAP)] - 1).sum())
        for counts in (known.counts, self._counts):
            counts.came.add(now, len(seq))
            counts.lost.add(now, lost)
        known.seq, known.heard = int(seq[-1]), now
        self._systems[sender >> 8].heard = now

    def _meet(self, sender: int, context: Context, now: float) -> None:
        system = sender >> 8
        if system not in self._systems:
            self._systems[system] = _System(now)
            role = context.role(sender)
            self.say(
                "appeared",
                now,
                f"system {system} appeared: component {sender & 255}, {role}",
                system,
            )

    def _time(self, table: Table, now: float) -> None:
        """Note how late the messages of a table are by their senders' clocks."""
        frames = table.frames
        timed = frames.t_valid & (table[_STAMP] > 0)
        lag_s = frames.t_us * 1e-6 - table[_STAMP] * 1e-3
        for sender in np.unique(frames.sender[timed]).tolist():
            if sender in self._senders:
                self._senders[sender].late(now, lag_s[timed & (frames.sender == sender)])

    def _count_boots(self, context: Context, number: int, now: float) -> None:
        systems = np.array(sorted(self._systems), np.int64)
        boots = context.registry.boots(systems, np.full(len(systems), number + 1))
        for system, count in zip(systems.tolist(), boots.tolist()):
            if count > self._systems[system].boots:
                self._systems[system].boots = count
                self.say(
                    "reboot", now, f"system {system} restarted: its clock begins again", system
                )

    def events(self, now: float) -> list[Event]:
        """Return what happened since the last call."""
        if self._garbage > self._garbage_said and now >= self._garbage_next:
            more = self._garbage - self._garbage_said
            self._garbage_said, self._garbage_next = self._garbage, now + GARBAGE_S
            self.say("garbage", now, f"{more} bytes that hold no frame ({self._garbage} so far)")
        for event in self._silences(now):
            self._events.append(event)
        events, self._events = self._events, []
        return events

    def _silences(self, now: float) -> Iterator[Event]:
        if self._heard is not None:
            silent = now - self._heard >= SILENT_S
            if silent != self._silent:
                self._silent = silent
                yield self._silence(silent, now, "the link", None)
        for system, known in self._systems.items():
            silent = now - known.heard >= SILENT_S
            if silent != known.silent:
                known.silent = silent
                if not self._silent:
                    yield self._silence(silent, now, f"system {system}", system)

    def _silence(self, silent: bool, now: float, who: str, system: int | None) -> Event:
        text = f"{who} says nothing for {SILENT_S:.0f} s" if silent else f"{who} is back"
        return Event(
            what="silent" if silent else "back", time=now, link=self._link, text=text, sysid=system
        )

    def status(self, now: float, record_bytes: int | None) -> LinkStatus:
        """Return how the link does."""
        return LinkStatus(
            link=self._link,
            state=self._state(),
            messages=self._messages,
            rate_hz=self._counts.rate_hz(now),
            bytes_per_s=self._bytes.total(now) / min(max(now - self._counts.began, 1.0), WINDOW_S),
            loss=self._counts.loss(now),
            garbage_bytes=self._garbage,
            quiet_s=None if self._heard is None else now - self._heard,
            record_bytes=record_bytes,
        )

    def _state(self) -> State:
        if not self._open:
            return "closed"
        if self._heard is None:
            return "waiting"
        return "silent" if self._silent else "up"

    def senders(self, now: float) -> dict[int, SenderStatus]:
        """Return how each component does, by ``sysid * 256 + compid``."""
        return {
            sender: SenderStatus(
                sysid=sender >> 8,
                compid=sender & 0xFF,
                rate_hz=known.counts.rate_hz(now),
                loss=known.counts.loss(now),
                latency_s=known.latency_s(),
                quiet_s=now - known.heard,
            )
            for sender, known in sorted(self._senders.items())
        }
