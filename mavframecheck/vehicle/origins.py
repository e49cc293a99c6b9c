"""Where local frames begin, where home is and where vehicles set out: three places, each with its history.

The registry is append-only: an origin once entered stays, and every local position refers to the one that was
in force when it was made. What is established in one boot of a vehicle does not hold in the next.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.vehicle.asking import Asking
from mavframecheck.vehicle.boots import FALL_MS, BootClock
from mavframecheck.vehicle.established import (
    ASKED,
    INFERRED,
    MSL,
    SAID,
    Event,
    Geodetic,
    Home,
    Launch,
    Move,
    Origin,
    Request,
)
from mavframecheck.vehicle.pairs import NEAR_M, PAIR, SHARE, Pairing, Rows, metres
from mavframecheck.wire import Batch, Frames, Place, Table

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

MAX_ENTRIES = 200
"""Origins, moves, homes and launches that are kept of one vehicle."""
SETTLE_MS = 1_000
"""An origin is inferred when positions agree on it for this long (ms of the vehicle's clock) ..."""
SETTLE_PAIRS = 3
"""... and this often."""
STEP_M = 0.3
"""An origin or home that is said anew, closer to the last one than this, is the same."""
ASKED_US = 60_000_000
"""A request counts as what moved an origin or home for this long."""
LEAP_S = 3.0
"""Which of two positions leapt is told from the pair right before, no longer ago than this."""
UNIX_US = 10**15
"""Stamps above are no time since boot."""
ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
CLOCKS = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ATTITUDE", "SYSTEM_TIME")
MESSAGES = (*CLOCKS, "HEARTBEAT", "HOME_POSITION", SAID)
"""What the registry reads of autopilots."""


class Registry:
    """The origins, homes and launch points of all vehicles of a recording."""

    def __init__(self) -> None:
        """Know no vehicle yet."""
        self.origins: list[Origin] = []
        """In the order in which they were established; one that is said more exactly stands there again."""
        self.moves: list[Move] = []
        self.homes: list[Home] = []
        self.launches: list[Launch] = []
        self.lost: list[tuple[int, Place]] = []
        """System and frame of each restart: no origin holds until the next one is established."""
        self._vehicles: dict[int, _Vehicle] = {}
        self._news: dict[str, int] = {"origins": 0, "launches": 0}
        self._asking = Asking()

    def update(self, batch: Batch, tables: Mapping[str, Table]) -> None:
        """Take in a batch, and of it what autopilots say in `tables`."""
        self._news = {name: len(getattr(self, name)) for name in self._news}
        requests = list(self._asking.requests(batch))
        systems = {int(s) for table in tables.values() for s in np.unique(table.frames.sysid)}
        for system in sorted(systems | ({*self._vehicles} if requests else set())):
            vehicle = self._vehicles.get(system)
            if vehicle is None:
                vehicle = self._vehicles[system] = _Vehicle(system, self)
            own = {name: table.only(table.frames.sysid == system) for name, table in tables.items()}
            asked = [event for event in requests if event.what.target in (0, system)]
            vehicle.update(batch.frames, {n: t for n, t in own.items() if len(t)}, asked)

    @property
    def systems(self) -> list[int]:
        """The vehicles of which an origin, a home or a launch point is known."""
        entered: list[Sequence[Origin | Home | Launch]] = [self.origins, self.homes, self.launches]
        return sorted({each.system for entries in entered for each in entries})

    def in_force(self, system: int) -> Origin | None:
        """Return the origin that holds for a vehicle at the end of the batch."""
        vehicle = self._vehicles.get(system)
        return None if vehicle is None else vehicle.origin

    def of(self, system: int) -> list[Origin]:
        """Return the origins of a vehicle, each once, as last said."""
        return list({o.origin_id: o for o in self.origins if o.system == system}.values())

    def at(self, system: int, number: Ints) -> Ints:
        """Return (n,) places in `origins` of what was in force for a vehicle before each frame, -1: none."""
        entered = [(o.seen.number, k) for k, o in enumerate(self.origins) if o.system == system]
        lost = [(seen.number, -1) for lost_by, seen in self.lost if lost_by == system]
        order = sorted([(-1, -1), *lost, *entered])
        place = np.searchsorted([since for since, _ in order], number, side="left") - 1
        return np.array([k for _, k in order])[place]

    def boots(self, system: Ints, number: Ints) -> Ints:
        """Return (n,) how often each system had been started anew when each frame came."""
        boots = np.zeros(len(system), np.int64)
        for lost in sorted({lost for lost, _ in self.lost}):
            since = sorted(seen.number for each, seen in self.lost if each == lost)
            boots = np.where(system == lost, np.searchsorted(since, number, side="left"), boots)
        return boots

    def news(self, subject: str) -> Iterator[tuple[int, Place, dict[str, float]]]:
        """Yield system, frame and quantities of each ``origin`` or ``launch`` that the batch establishes."""
        if subject == "launch":
            for launch in self.launches[self._news["launches"] :]:
                place = {} if launch.at is None else launch.at._asdict()
                yield launch.system, launch.seen, {"boot": launch.boot, **place}
        else:
            for origin in self.origins[self._news["origins"] :]:
                values = {"id": origin.origin_id, "boot": origin.boot, **origin.at._asdict()}
                yield origin.system, origin.seen, values


class _Vehicle:
    """What holds for one vehicle, brought forward event by event."""

    def __init__(self, system: int, registry: Registry) -> None:
        self.system = system
        self.origin: Origin | None = None
        self._registry = registry
        self._clock = BootClock()
        self._pairing = Pairing()
        self._compid: int | None = None
        self._first = 0
        """The first frame of the vehicle."""
        self._boot = 0
        self._highest_ms = -1
        """Highest stamp of a pair in this boot."""
        self._open: Rows = np.zeros(0, PAIR)
        """Pairs in a row, up to now, that disagree with the origin: the first and the last few."""
        self._good: Rows = np.zeros(0, PAIR)
        """The last pair that agreed with it, 0 or 1 rows."""
        self._place: Geodetic | None = None
        self._said: dict[str, Geodetic] = {}
        """The last ``origin`` and ``home`` that was said."""
        self._armed: bool | None = None
        self._armed_us: int | None = None
        """Time of the recording at arming, -1: before it began; None: not armed."""
        self._asked: dict[str, Request] = {}
        self._clock_us = 0
        self._kept: Counter[str] = Counter()
        self._ids = 0

    @property
    def _who(self) -> tuple[int, int, int]:
        """System, component and boot, as entries begin."""
        return self.system, self._compid or 0, self._boot

    def update(self, frames: Frames, tables: dict[str, Table], requests: list[Event]) -> None:
        """Take in what the vehicle says in a batch, and what others ask of it."""
        own = self._own(tables)
        restarts = self._restarts(own, frames)
        events = [*(event for event in requests if event.seen.number > self._first), *restarts]
        events += self._armings(own.get("HEARTBEAT"), own.get("GLOBAL_POSITION_INT"))
        for message, kind in ((SAID, "origin"), ("HOME_POSITION", "home")):
            if message in own:
                events += self._changes(own[message], kind, restarts)
            elif restarts:
                self._said.pop(kind, None)
        pairs = self._pairing.update(own.get("LOCAL_POSITION_NED"), own.get("GLOBAL_POSITION_INT"))
        done, first = 0, int(frames.number[0])
        for event in sorted(events, key=lambda each: each.seen.number):
            clock_us = int(frames.clock_us[event.seen.number - first])
            if event.kind == "home":
                self._on_home(event, clock_us)
                continue
            upto = int(np.searchsorted(pairs["number"], event.seen.number))
            if upto > done:
                self._infer(pairs[done:upto])
            done, self._clock_us = upto, clock_us
            getattr(self, f"_on_{event.kind}")(event)
        if len(pairs) > done:
            self._infer(pairs[done:])

    def _own(self, tables: dict[str, Table]) -> dict[str, Table]:
        """Return the rows of one component: the autopilot of the system that was heard first."""
        if self._compid is None:
            first = min(tables.values(), key=lambda table: int(table.frames.number[0])).frames
            self._compid, self._first = int(first.compid[0]), int(first.number[0])
        own = {n: table.only(table.frames.compid == self._compid) for n, table in tables.items()}
        return {name: table for name, table in own.items() if len(table)}

    def _restarts(self, own: dict[str, Table], frames: Frames) -> list[Event]:
        """Return where the vehicle is known to have been started anew."""
        tables = [own[name] for name in CLOCKS if name in own]
        if not tables:
            return []
        number = np.concatenate([table.frames.number for table in tables])
        t_ms = np.concatenate([table["time_boot_ms"].astype(np.int64) for table in tables])
        order = np.argsort(number, kind="stable")
        restarts = self._clock.update(number[order], t_ms[order])
        first = int(frames.number[0])
        return [Event(frames.place(each.certain - first), "restart", each) for each in restarts]

    def _changes(self, table: Table, kind: str, restarts: list[Event]) -> Iterator[Event]:
        """Yield where a message says another position than before in this boot."""
        at = np.column_stack(
            (table["latitude"] / 1e7, table["longitude"] / 1e7, table["altitude"] / 1e3)
        )
        placed = np.flatnonzero((at[:, 0] != 0) | (at[:, 1] != 0))
        number = table.frames.number[placed]
        cuts = np.searchsorted(number, [event.seen.number for event in restarts])
        for k, rows in enumerate(np.split(placed, cuts)):
            if k:
                self._said.pop(kind, None)
            yield from self._changed(table, at, rows, kind)

    def _changed(self, table: Table, at: Floats, rows: Ints, kind: str) -> Iterator[Event]:
        while len(rows):
            last = self._said.get(kind)
            far = (
                np.arange(len(rows))
                if last is None
                else np.flatnonzero(_away(at[rows], last) > STEP_M)
            )
            if not len(far) or not self._room(f"{kind} said"):
                return
            row, rows = int(rows[far[0]]), rows[far[0] + 1 :]
            said = self._said[kind] = Geodetic(*at[row].tolist())
            stamp = int(table["time_usec"][row])
            boot_ms = stamp // 1000 if 0 < stamp < UNIX_US else None
            yield Event(table.frames.place(row), kind, said, boot_ms)

    def _armings(self, beats: Table | None, globe: Table | None) -> Iterator[Event]:
        """Yield where the vehicle is armed and disarmed, with the last position before."""
        if beats is not None:
            armed = (beats["base_mode"] & ARMED) != 0
            first = self._armed is None
            held = not armed[0] if self._armed is None else self._armed
            before: Bools = np.concatenate(([held], armed[:-1]))
            for row in np.flatnonzero(armed != before).tolist():
                seen = beats.frames.place(row)
                place = None if first and not row else _last_place(globe, seen.number, self._place)
                clock_us = -1 if first and not row else int(beats.frames.clock_us[row])
                yield Event(seen, "arming", (bool(armed[row]), clock_us, place))
            self._armed = bool(armed[-1])
        if globe is not None:
            self._place = _last_place(globe, int(globe.frames.number[-1]) + 1, self._place)

    def _on_restart(self, event: Event) -> None:
        """Start anew; what was said since the clock began anew belongs to the new boot."""
        begun, registry = event.what.begun, self._registry
        self._boot += 1
        self._open, self._good, self._highest_ms = self._open[:0], self._good[:0], -1
        early, self.origin = self.origin, None
        registry.lost.append((self.system, event.seen))
        late = [
            m for m in registry.moves if m.after.system == self.system and m.seen.number >= begun
        ]
        registry.moves[:] = [move for move in registry.moves if move not in late]
        for k, home in enumerate(registry.homes):
            if home.system == self.system and home.seen.number >= begun:
                registry.homes[k] = home._replace(boot=self._boot)
        if early is not None and early.seen.number >= begun:
            self._enter(early._replace(origin_id=0, boot=self._boot, seen=event.seen))

    def _on_arming(self, event: Event) -> None:
        armed, clock_us, place = event.what
        self._armed_us = clock_us if armed else None
        if armed and self._room("launches"):
            launch = Launch(*self._who, place, event.seen)
            self._registry.launches.append(launch)

    def _on_home(self, event: Event, clock_us: int) -> None:
        """Enter a home; it has no part in which origin holds."""
        if self._room("homes"):
            armed_s, asked = self._armed_s(clock_us), self._asker("home", event.what, clock_us)
            home = Home(*self._who, event.what, event.seen, armed_s, asked)
            self._registry.homes.append(home)

    def _on_request(self, event: Event) -> None:
        """Remember who asks; where no origin is known the one asked for is taken to hold."""
        request: Request = event.what
        self._asked[request.kind] = request._replace(clock_us=self._clock_us)
        if request.kind == "origin" and self.origin is None and request.at is not None:
            asked = Origin(0, *self._who, request.at, MSL, event.seen, None, ASKED, request.sender)
            self._enter(asked)

    def _on_origin(self, event: Event) -> None:
        """Enter the origin that a message says: the one in force more exactly, or another one."""
        at, old = event.what, self.origin
        asked = self._asker("origin", at, self._clock_us)
        said = Origin(0, *self._who, at, MSL, event.seen, event.boot_ms, SAID, asked)
        if old is not None and old.source != SAID and self._alike(old.at, at):
            self._confirm(said._replace(origin_id=old.origin_id))
            return
        if old is not None and (old.source == SAID or len(self._good)):
            entered = self._enter(said)
            self._move(old, entered, event.seen, self._armed_s(self._clock_us), said=True)
        else:
            self._enter(said)
        self._open, self._good = self._open[:0], self._good[:0]

    def _confirm(self, said: Origin) -> None:
        """Enter the origin in force again, now that a message says it; a move to it is said too."""
        self._enter(said)
        moves = self._registry.moves
        for k, move in enumerate(moves):
            if move.after.origin_id == said.origin_id:
                moves[k] = move._replace(said=True)

    def _infer(self, pairs: Rows) -> None:
        """Bring the origin forward by pairs of positions: those that disagree with it for long replace it."""
        rows, known = np.concatenate((self._open, self._in_this_boot(pairs))), len(self._open)
        while len(rows) > known and self._kept["origins"] < MAX_ENTRIES:
            off = self._disagree(rows)
            joined = np.concatenate(([False], _agree(rows[:-1], rows[1:]) & off[:-1]))
            joined[1:known] = True
            start = np.maximum.accumulate(np.where(off & joined, 0, np.arange(len(rows))))
            lasts = rows["t_ms"] - rows["t_ms"][start] >= SETTLE_MS
            often = np.arange(len(rows)) - start >= SETTLE_PAIRS - 1
            settled = np.flatnonzero(off & lasts & often)
            upto = int(settled[0]) + 1 if len(settled) else len(rows)
            agreed = np.flatnonzero(~off[:upto])
            if len(agreed):
                self._good = rows[agreed[-1] :][:1]
            run = rows[start[upto - 1] : upto]
            if not len(settled):
                self._open = _thinned(run) if off[-1] else run[:0]
                return
            self._settle(run)
            rows, known = rows[upto:], 0

    def _in_this_boot(self, pairs: Rows) -> Rows:
        """Return the pairs that are not from before a restart or, before one is certain, from behind it."""
        if not len(pairs):
            return pairs
        highest = np.maximum.accumulate(np.maximum(pairs["t_ms"], self._highest_ms))
        self._highest_ms = int(highest[-1])
        return pairs.take(np.flatnonzero(pairs["t_ms"] >= highest - FALL_MS))

    def _disagree(self, rows: Rows) -> Bools:
        """Return (n,) pairs that do not fit the origin in force; all of them where there is none."""
        if self.origin is None:
            return np.ones(len(rows), np.bool_)
        at = self.origin.at
        north, east = metres(rows["lat0"], rows["lon0"], np.asarray(at.lat), np.asarray(at.lon))
        allowed = rows["slack"] + SHARE * np.hypot(rows["x"], rows["y"])
        far = np.hypot(north, east) > allowed
        return np.asarray(far | (np.abs(rows["alt0"] - at.alt_msl) > rows["slack"]))

    def _settle(self, run: Rows) -> None:
        """Enter the origin that a run of pairs agrees on."""
        first, best = run[0], run[-SETTLE_PAIRS:][np.argmin(run["slack"][-SETTLE_PAIRS:])]
        at = Geodetic(float(best["lat0"]), float(best["lon0"]), float(best["alt0"]))
        old, good = self.origin, self._good
        boot_ms = int(first["t_ms"])
        asked = self._asker("origin", at, self._clock_us)
        seen = _seen_in(run[-1])
        entered = self._enter(Origin(0, *self._who, at, MSL, seen, boot_ms, INFERRED, asked))
        if old is not None and len(good):
            armed_s = self._armed_s(int(first["t_us"]))
            self._move(old, entered, _seen_in(first), armed_s, leaps=_leaps(good[0], first))
        self._good = run[-1:]

    def _enter(self, origin: Origin) -> Origin:
        """Let an origin hold from now on, with the next id unless it has one."""
        if not origin.origin_id:
            self._ids += 1
            origin = origin._replace(origin_id=self._ids)
        if self._room("origins"):
            self._registry.origins.append(origin)
        self.origin = origin
        self._open, self._good = self._open[:0], self._good[:0]
        return origin

    def _move(
        self,
        old: Origin,
        new: Origin,
        seen: Place,
        armed_s: float | None,
        *,
        said: bool = False,
        leaps: tuple[float, float] | None = None,
    ) -> None:
        if self._room("moves"):
            shift = old.at.shift_to(new.at)
            local_m, global_m = leaps or (None, None)
            move = Move(old, new, shift, seen, armed_s, said, local_m, global_m)
            self._registry.moves.append(move)

    def _room(self, what: str) -> bool:
        """Return whether one more entry may be kept: memory is bounded, whatever a recording says."""
        self._kept[what] += 1
        return self._kept[what] <= MAX_ENTRIES

    def _alike(self, one: Geodetic, other: Geodetic) -> bool:
        """Return whether two positions are one origin, as exactly as pairs can tell."""
        north, east, down = one.shift_to(other)
        far = float(np.hypot(self._good["x"], self._good["y"])[0]) if len(self._good) else 0.0
        return bool(np.hypot(north, east) <= NEAR_M + SHARE * far and abs(down) <= NEAR_M)

    def _asker(self, kind: str, at: Geodetic, clock_us: int) -> int | None:
        """Return who asked for an origin or home not long before `clock_us`."""
        asked = self._asked.get(kind)
        if asked is None or clock_us - asked.clock_us > ASKED_US:
            return None
        north, east, _ = asked.at.shift_to(at) if asked.at is not None else (0.0, 0.0, 0.0)
        return asked.sender if np.hypot(north, east) <= 2 * NEAR_M else None

    def _armed_s(self, t_us: int) -> float | None:
        """Return for how long the vehicle was armed at a time, s; None when it was not."""
        if self._armed_us is None or 0 <= t_us < self._armed_us:
            return None
        return (t_us - self._armed_us) * 1e-6 if self._armed_us >= 0 <= t_us else np.inf


def _leaps(good: Any, first: Any) -> tuple[float, float] | None:
    """Return how far the local and the global position leapt from one pair to the next, m, velocity set off."""
    dt = (int(first["t_ms"]) - int(good["t_ms"])) * 1e-3
    if not 0 <= dt <= LEAP_S:
        return None
    flown = [(good[v] + first[v]) / 2 * dt for v in ("vx", "vy", "vz")]
    local = np.array([first[a] - good[a] - d for a, d in zip("xyz", flown, strict=True)])
    before, after = (Geodetic(*(float(r[n]) for n in ("lat", "lon", "alt"))) for r in (good, first))
    return float(np.linalg.norm(local)), float(
        np.linalg.norm(before.shift_to(after) - np.array(flown))
    )


def _agree(one: Rows, other: Rows) -> Bools:
    """Return (n,) whether two pairs imply the same origin."""
    north, east = metres(one["lat0"], one["lon0"], other["lat0"], other["lon0"])
    slack = np.maximum(one["slack"], other["slack"])
    return np.asarray(
        (np.hypot(north, east) <= slack) & (np.abs(one["alt0"] - other["alt0"]) <= slack)
    )


def _thinned(run: Rows) -> Rows:
    """Return what of an open run is still needed: its first pair and its last ones."""
    return run if len(run) <= SETTLE_PAIRS else np.concatenate((run[:1], run[-SETTLE_PAIRS:]))


def _away(at: Floats, last: Geodetic) -> Floats:
    """Return (n,) how far positions (n, 3) are from one, m."""
    north, east = metres(at[:, 0], at[:, 1], np.asarray(last.lat), np.asarray(last.lon))
    away: Floats = np.sqrt(north**2 + east**2 + (at[:, 2] - last.alt_msl) ** 2)
    return away


def _last_place(globe: Table | None, number: int, before: Geodetic | None) -> Geodetic | None:
    """Return the last global position before a frame."""
    if globe is None:
        return before
    upto = int(np.searchsorted(globe.frames.number, number))
    lat, lon = globe["lat"][:upto], globe["lon"][:upto]
    placed = np.flatnonzero((lat != 0) | (lon != 0))
    if not len(placed):
        return before
    row = int(placed[-1])
    return Geodetic(float(lat[row] / 1e7), float(lon[row] / 1e7), float(globe["alt"][row] / 1e3))


def _seen_in(pair: Any) -> Place:
    t_us = int(pair["t_us"])
    return Place(
        int(pair["number"]), t_us if t_us >= 0 else None, int(pair["offset"]), int(pair["size"])
    )
