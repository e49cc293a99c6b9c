"""The context that rules see: as-of columns of what each vehicle and sender has said.

A row takes the last value said before it (in frame order), else the first one said soon after it; what
never comes is unknown. `facts` lists the names; those of a vehicle speak of the system that the row is
about, those of a sender of the component that sent it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.vehicle.clocks import ClockBook
from mavframecheck.vehicle.facts import (
    NAMES,
    REGISTERED,
    SOURCES,
    WORDS,
    Name,
    Source,
    ageless,
    histories,
)
from mavframecheck.vehicle.history import Answer, Asked, Bools, History, Ints, Values
from mavframecheck.vehicle.origins import MESSAGES, Registry
from mavframecheck.vehicle.roles import ROLES, Meant, RoleBook
from mavframecheck.vehicle.timing import Clocks
from mavframecheck.wire import Batch, Table

MAX_WORDS = 2000
"""Different texts of one quantity that are kept apart."""
UNKNOWN = "unknown"


class Known(NamedTuple):
    """A context column: `values` and whether each is `known`; both (n,)."""

    values: Values
    known: Bools
    labels: tuple[str, ...] = ()
    """Texts that the values are places in, for a column of words; the first one is ``unknown``."""

    @property
    def words(self) -> Values:
        """The values as they are compared and shown: texts for a column of words."""
        return np.array(self.labels)[self.values] if self.labels else self.values

    def among(self, chosen: Callable[[str], bool]) -> Bools:
        """Return (n,) rows of a column of words whose word is `chosen`."""
        return np.array([chosen(label) for label in self.labels])[self.values]

    def take(self, rows: Ints) -> Known:
        """Return the column for some of the rows."""
        return Known(self.values.take(rows), self.known.take(rows), self.labels)

    def completed(self, later: Known) -> Known:
        """Return the column with what is unknown taken from `later`."""
        values = np.where(self.known, self.values, later.values)
        return Known(values, self.known | later.known, later.labels)


class _Meaning:
    """Who sends the rows of a table, and whom they are about: nearly every rule asks for it."""

    def __init__(self, table: Table, roles: RoleBook) -> None:
        self.table = table
        self._roles = roles
        self.answers: dict[tuple[object, ...], Answer] = {}
        """Where histories hold what the rows ask for: the same place for all that one message says."""

    @functools.cached_property
    def role(self) -> Ints:
        """(n,) role of the sender, as a place in ROLES."""
        return self._roles.of(self.table)

    @functools.cached_property
    def by_autopilot(self) -> Bools:
        """(n,) rows that an autopilot sends."""
        return np.asarray(self.role == ROLES.index("autopilot"))

    @functools.cached_property
    def meant(self) -> Meant:
        """Whom each row is about."""
        table, own = self.table, self.by_autopilot
        sysid, number = table.frames.sysid.astype(np.int64), table.frames.number
        if own.all():
            return Meant(sysid, number)
        told = own
        about, since = self._roles.autopilot_for(table.frames)
        about = np.where(own, sysid, about)
        if "target_system" in table.layout.by_name:
            target = table["target_system"].astype(np.int64)
            told = own | (target > 0)
            about = np.where(~own & (target > 0), target, about)
        return Meant(about, np.where(told, number, since))

    @functools.cached_property
    def asked(self) -> Asked:
        """What the rows ask the histories of systems for."""
        key, since = self.meant
        frames = self.table.frames
        times = (frames.t_us, frames.t_valid, frames.clock_us)
        return Asked(key, frames.number, since, *times)

    @functools.cached_property
    def asked_for_command(self) -> Asked:
        """The same of the histories of systems and commands."""
        asked, table = self.asked, self.table
        commanded = "command" in table.layout.by_name
        command = table["command"].astype(np.int64) if commanded else np.full(len(table), -1)
        known = (asked.key >= 0) & (command >= 0)
        return asked._replace(key=np.where(known, asked.key << 16 | command, -1))


class Context:
    """Everything known so far, fed batch by batch."""

    def __init__(self, autopilot: str | None = None) -> None:
        """Start knowing nothing; `autopilot` is the family to assume where no heartbeat tells one."""
        self._assumed = autopilot
        self._roles = RoleBook()
        steady = ageless()
        self._histories = {
            name: History(quantities, ages=name not in steady)
            for name, quantities in histories().items()
        }
        self._words: dict[str, dict[str, int]] = {name: {UNKNOWN: 0} for name in WORDS}
        self._batch: Batch | None = None
        self._fed: set[str] = set()
        self._registry = Registry()
        self._registered = False
        self._clocks = ClockBook()
        self._clocked = False
        self._timing: Clocks | None = None
        self._meanings: dict[int, _Meaning] = {}
        """Of the tables asked about in this batch, by their identity."""

    def update(self, batch: Batch) -> None:
        """Take in what `batch` says. Call `settle` once every rule has read it."""
        self._batch = batch
        self._fed.clear()
        self._meanings.clear()
        if "HEARTBEAT" in batch.tables:
            self._roles.update(batch.tables["HEARTBEAT"])
        self._registered = False
        self._clocked = False
        self._timing = None

    @property
    def clocks(self) -> ClockBook:
        """The stamps of every stream; who wants them asks in every batch, so that none is missed."""
        if not self._clocked and self._batch is not None:
            self._clocked = True
            self._clocks.update(self._batch)
        return self._clocks

    @property
    def timing(self) -> Clocks:
        """What `clocks` show, once the whole recording is read."""
        if self._timing is None:
            self._timing = Clocks(self._clocks, self.role)
        return self._timing

    @property
    def registry(self) -> Registry:
        """Origins, homes and launch points, with all that the current batch says of them."""
        if not self._registered and self._batch is not None:
            self._registered = True
            said = {name: self._batch.tables.get(name) for name in MESSAGES}
            own = {name: self._by_autopilots(table) for name, table in said.items() if table}
            self._registry.update(
                self._batch, {name: table for name, table in own.items() if table}
            )
        return self._registry

    def _by_autopilots(self, table: Table) -> Table:
        return table.only(self._of(table).by_autopilot)

    def settle(self) -> None:
        """Forget what only rows of the current batch could ask for."""
        _ = self.registry
        for name, history in self._histories.items():
            if name not in self._fed:
                self._feed(name, only_last=True)
            history.settle()
        if self._batch is not None and len(self._batch):
            self._roles.settle(int(self._batch.frames.number[-1]))
        self._meanings.clear()
        self._batch = None

    def _of(self, table: Table) -> _Meaning:
        """Return who speaks in a table and of whom, found out once in a batch."""
        meaning = self._meanings.get(id(table))
        if meaning is None:
            meaning = self._meanings[id(table)] = _Meaning(table, self._roles)
        return meaning

    def lookup(self, name: str, table: Table, *, late: bool = True) -> Known:
        """Return the context column `name` for the rows of `table`; KeyError for an unknown name.

        Not `late`: only what was said before a row, so that one look suffices wherever batches end.
        """
        entry = NAMES[name]
        if entry.key == "sender":
            return Known(self._of(table).role, np.ones(len(table), np.bool_), ROLES)
        of = self._of(table)
        asked = of.asked_for_command if entry.key == "command" else of.asked
        if not late:
            asked = asked._replace(key=np.where(asked.since > asked.number, -1, asked.key))
        answers = [
            (self._ready(h), q, self._place(of, entry, h, asked, late)) for h, q in entry.sources
        ]
        history, quantity, answer = answers[0]
        if len(answers) == 1 or (answer.found & (history.numbers(answer) < asked.since)).all():
            return self._column(name, entry, history.values(quantity, answer), answer.found)
        return self._column(name, entry, *_best(answers, asked))

    def _column(self, name: str, entry: Name, values: Values, known: Bools) -> Known:
        """Return numbers as they are; words as places in their list of texts."""
        quantity = entry.sources[0][1]
        if quantity not in WORDS:
            return Known(values, known & ~np.isnan(values))
        words = self._words[quantity]
        places = np.nan_to_num(values).astype(np.int64)
        if name == "vehicle.autopilot" and self._assumed is not None:
            places = np.where(known, places, words.setdefault(self._assumed, len(words)))
            known = np.ones(len(known), np.bool_)
        return Known(places, known, tuple(words))

    def _place(self, of: _Meaning, entry: Name, history: str, asked: Asked, late: bool) -> Answer:
        """Return where a history holds what the rows ask for, found out once in a batch."""
        key = (history, entry.key, entry.max_age_us, entry.waits, entry.after, late)
        answer = of.answers.get(key)
        if answer is None:
            answer = of.answers[key] = self._answer(entry, history, asked, late=late)
        return answer

    def _answer(self, entry: Name, history: str, asked: Asked, *, late: bool) -> Answer:
        """Find the value before each row, else the first one soon after it (an answer: only that)."""
        kept = self._ready(history)
        if entry.after:
            return kept.after(asked, entry.max_age_us or 0)
        before = self._of_its_boot(history, asked, kept.before(asked, entry.max_age_us))
        alone = not (late and entry.waits) or (self._assumed is not None and history == "identity")
        if alone or before.found.all():
            return before
        after = self._of_its_boot(history, asked, kept.after(asked))
        return Answer(*(np.where(before.found, b, a) for b, a in zip(before, after, strict=True)))

    def _of_its_boot(self, history: str, asked: Asked, answer: Answer) -> Answer:
        """Drop what the registry says of another boot of the vehicle than the one a row was sent in."""
        if history not in REGISTERED:
            return answer
        boot = self._histories[history].values("boot", answer)
        same = boot == self.registry.boots(asked.key, asked.since)
        return answer._replace(found=answer.found & same)

    def _ready(self, name: str) -> History:
        """Return a history with all that the current batch says."""
        if name not in self._fed:
            self._fed.add(name)
            self._feed(name, only_last=False)
        return self._histories[name]

    def _feed(self, name: str, *, only_last: bool) -> None:
        """Add what the current batch says to a history: every row, or the last one of each system."""
        if name in REGISTERED:
            self._feed_registered(name)
        for source in _SOURCES_OF[name]:
            table = self._batch.tables.get(source.message) if self._batch is not None else None
            if table is not None:
                said = self._said(source, table)
                if only_last:
                    kept = table.take(_last_of_each(_keys(source, table), np.flatnonzero(said)))
                else:
                    kept = table.only(said)
                if len(kept):
                    values = {q: self._numbers(q, read(kept)) for q, read in source.reads.items()}
                    self._histories[name].extend(_keys(source, kept), kept.frames, values)

    def _feed_registered(self, name: str) -> None:
        """Add what the batch establishes of origins or launch points to a history."""
        news = sorted(self.registry.news(name), key=lambda each: each[1].number)
        if not news or self._batch is None:
            return
        frames = self._batch.frames
        rows = np.array([seen.number for _, seen, _ in news]) - frames.number[0]
        keys = np.array([system for system, _, _ in news], np.int64)
        values = {
            quantity: np.array([said.get(quantity, np.nan) for _, _, said in news])
            for quantity in REGISTERED[name]
        }
        self._histories[name].extend(keys, frames.take(rows), values)

    def _said(self, source: Source, table: Table) -> Bools:
        """Return (n,) rows of a table in which an autopilot says something."""
        speaks = self._of(table).by_autopilot
        return speaks if source.valid is None else speaks & source.valid(table)

    def _numbers(self, quantity: str, values: Values) -> Values:
        """Return a column as numbers; words as places in their list of texts."""
        if quantity not in WORDS:
            return values.astype(np.float64)
        words = self._words[quantity]
        begins = np.flatnonzero(np.append(True, values[1:] != values[:-1]))
        kinds, which = np.unique(values[begins], return_inverse=True)
        places = []
        for kind in kinds.tolist():
            text = kind.decode("utf-8", "replace") if isinstance(kind, bytes) else kind
            full = len(words) >= MAX_WORDS and text not in words
            places.append(0 if full else words.setdefault(text, len(words)))
        return np.repeat(np.array(places, np.float64)[which], np.diff(begins, append=len(values)))

    def last(self, name: str, system: int) -> Any:
        """Return the last value of a context name for one system, None when it is unknown."""
        history, quantity = NAMES[name].sources[0]
        value = self._histories[history].last(quantity, system)
        if value is None or np.isnan(value):
            return None
        return list(self._words[quantity])[int(value)] if quantity in WORDS else value

    def role(self, sender: int) -> str:
        """Return the role that a sender has by its last heartbeat, else by the convention of ids."""
        return ROLES[self._roles.last(sender)]

    def about(self, table: Table) -> Ints:
        """Return (n,) the system each row is about, negative where it is not known.

        It is the target; else, for what an autopilot sends, its own system; else the sender's system where
        that has an autopilot; else the only system with one.
        """
        return self._of(table).meant.system

    def about_then(self, table: Table) -> Ints:
        """Return (n,) the same as it was known when each row was sent."""
        meant = self._of(table).meant
        return np.where(meant.since > table.frames.number, -1, meant.system)


def _best(answers: list[tuple[History, str, Answer]], asked: Asked) -> tuple[Values, Bools]:
    """Return (n,) the value of the first source that spoke before a row, else of the first to speak."""
    values, known = np.full(len(asked.key), np.nan), np.zeros(len(asked.key), np.bool_)
    numbers = [history.numbers(answer) for history, _, answer in answers]
    earliest = np.min(numbers, axis=0)
    for (history, quantity, answer), number in zip(answers, numbers, strict=True):
        take = ~known & answer.found & ((number < asked.since) | (number == earliest))
        values = np.where(take, history.values(quantity, answer), values)
        known |= take
    return values, known


def _keys(source: Source, table: Table) -> Ints:
    system = table.frames.sysid.astype(np.int64)
    return system << 16 | table["command"] if source.key == "command" else system


def _last_of_each(keys: Ints, rows: Ints) -> Ints:
    """Return, of the `rows`, the last one of each key."""
    backwards = rows[::-1]
    return backwards[np.sort(np.unique(keys[backwards], return_index=True)[1])][::-1]


_SOURCES_OF: dict[str, list[Source]] = {
    name: [source for source in SOURCES if source.history == name] for name in histories()
}
