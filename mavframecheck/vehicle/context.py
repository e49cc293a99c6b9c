"""The context that rules see: as-of columns of what each vehicle and sender has said.

A row takes the last value said before it (in frame order), else the first one said soon after it; what
never comes is unknown. Names are `<subject>.<quantity>`: `vehicle.*`, `home.*` speak of the system that
the row is about, `sender.*` of the component that sent it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.semantics.names import family
from mavframecheck.vehicle import roles
from mavframecheck.vehicle.history import Asked, Bools, History, Ints, Values
from mavframecheck.wire import Batch, Table

CONTEXT_NAMES: dict[str, tuple[str, str]] = {
    "sender.role": ("roles", "role"),
    "vehicle.autopilot": ("identity", "family"),
    "vehicle.type": ("identity", "type"),
    "vehicle.version": ("versions", "version"),
    "vehicle.lat": ("position", "lat"),
    "vehicle.lon": ("position", "lon"),
    "vehicle.alt_msl": ("position", "alt_msl"),
    "vehicle.relative_alt": ("position", "relative_alt"),
    "home.lat": ("home", "lat"),
    "home.lon": ("home", "lon"),
    "home.alt_msl": ("home", "alt_msl"),
}
"""Name in an expression -> (history, quantity in it)."""


def source_of(name: str) -> str:
    """Return which history a context name is read from: names of one history come together."""
    return CONTEXT_NAMES[name][0]


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

    def take(self, rows: Ints | Bools) -> Known:
        """Return the column for some of the rows."""
        return Known(self.values[rows], self.known[rows], self.labels)

    def completed(self, later: Known) -> Known:
        """Return the column with what is unknown taken from `later`."""
        values = np.where(self.known, self.values, later.values)
        return Known(values, self.known | later.known, self.labels)


LABELS = {"role": roles.ROLES, "family": roles.FAMILIES}
"""Quantities that are words: histories keep places in these."""


class Context:
    """Everything known so far, fed batch by batch."""

    def __init__(self, autopilot: str | None = None) -> None:
        """Start knowing nothing; `autopilot` is the family to assume where no heartbeat tells one."""
        self._assumed = autopilot
        self.histories = {
            "roles": History(role=0),
            "identity": History(family=0, type=np.nan),
            "versions": History(version=np.nan),
            "position": History(lat=np.nan, lon=np.nan, alt_msl=np.nan, relative_alt=np.nan),
            "home": History(lat=np.nan, lon=np.nan, alt_msl=np.nan),
        }
        self._autopilots: dict[int, int] = {}
        """System id -> running number of the first heartbeat of its autopilot."""

    def update(self, batch: Batch) -> None:
        """Take in what `batch` says. Call `settle` once every rule has read it."""
        for message, learn in _LEARNERS.items():
            if message in batch.tables:
                learn(self, batch.tables[message])

    def settle(self) -> None:
        """Forget what only rows of the current batch could ask for."""
        for history in self.histories.values():
            history.settle()

    def lookup(self, name: str, table: Table) -> Known:
        """Return the context column `name` for the rows of `table`."""
        where, quantity = CONTEXT_NAMES[name]
        if where == "roles":
            return Known(self._roles(table), np.ones(len(table), np.bool_), roles.ROLES)
        history = self.histories[where]
        assumed = self._assumed if name == "vehicle.autopilot" else None
        answer = history.ask(self._asked(self.about(table), table), late=assumed is None)
        values = history.values(quantity, answer)
        if assumed is not None:
            values = np.where(answer.found, values, roles.FAMILIES.index(assumed))
            return Known(values, np.ones(len(table), np.bool_), roles.FAMILIES)
        return Known(values, answer.found, LABELS.get(quantity, ()))

    @staticmethod
    def _asked(key: Ints, table: Table) -> Asked:
        return Asked(key, table.frames.number, table.frames.t_us, table.frames.t_valid)

    def _roles(self, table: Table) -> Values:
        """Return (n,) the role of each sender by its heartbeats so far, else by the convention of ids."""
        sender = table.frames.sender
        answer = self.histories["roles"].ask(self._asked(sender, table), late=False)
        said = self.histories["roles"].values("role", answer)
        return np.where(answer.found, said, roles.role_table()[sender])

    def last(self, history: str, quantity: str, key: int, otherwise: Any) -> Any:
        """Return the last value of a quantity for one system or sender, `otherwise` when none was said."""
        found = self.histories[history].last(quantity, key)
        if found is None:
            return otherwise
        return LABELS[quantity][int(found)] if quantity in LABELS else found

    def about(self, table: Table) -> Ints:
        """Return (n,) the system each row is about, negative where it is not known.

        It is the target; else, for what an autopilot sends, its own system; else the sender's system where
        that has an autopilot; else the only system with one.
        """
        sysid = table.frames.sysid.astype(np.int64)
        own = self._roles(table) == roles.ROLES.index("autopilot")
        about = np.where(own, sysid, self._autopilot_for(sysid, table.frames.number))
        if "target_system" in table.layout.by_name:
            target = table["target_system"].astype(np.int64)
            about = np.where(~own & (target > 0), target, about)
        return about

    def _autopilot_for(self, sysid: Ints, index: Ints) -> Ints:
        """Return the sender's own system where its autopilot was heard, else the only one heard.

        Where none was heard yet it is the one that is heard first.
        """
        if not self._autopilots:
            return np.full(len(sysid), -1, np.int64)
        systems = np.array(list(self._autopilots), np.int64)
        first = np.array(list(self._autopilots.values()), np.int64)
        heard_from = np.full(256, np.iinfo(np.int64).max)
        heard_from[systems] = first
        heard = np.searchsorted(np.sort(first), index, side="right")
        only = np.where(heard <= 1, systems[np.argmin(first)], -1)
        return np.where(heard_from[sysid] <= index, sysid, only)

    def autopilots(self) -> tuple[int, ...]:
        """Return the systems whose autopilot was heard, ascending."""
        return tuple(sorted(self._autopilots))

    def note_autopilots(self, sysid: Ints, index: Ints) -> None:
        """Remember when the autopilot of each system was first heard."""
        for system, number in zip(sysid.tolist(), index.tolist(), strict=True):
            self._autopilots.setdefault(system, number)


def _learn_heartbeats(context: Context, table: Table) -> None:
    kinds, which = np.unique(
        table["type"].astype(np.int64) * 256 + table["autopilot"].astype(np.int64),
        return_inverse=True,
    )
    names = [roles.role_from_heartbeat(k >> 8, k & 0xFF) for k in kinds.tolist()]
    role = np.array([roles.ROLES.index(name) for name in names])[which]
    context.histories["roles"].extend(
        table.frames.sender, table.frames, table.frames.number, role=role
    )
    speaks = role == roles.ROLES.index("autopilot")
    autopilot = table.take(speaks)
    if not len(autopilot):
        return
    named = [family(k & 0xFF, k >> 8) for k in kinds.tolist()]
    families = np.array([roles.FAMILIES.index(name) for name in named])[which][speaks]
    sysid = autopilot.frames.sysid.astype(np.int64)
    first = np.unique(sysid, return_index=True)[1]
    context.note_autopilots(sysid[first], autopilot.frames.number[first])
    context.histories["identity"].extend(
        sysid,
        autopilot.frames,
        autopilot.frames.number,
        family=families,
        type=autopilot["type"].astype(float),
    )


def _learn_version(context: Context, table: Table) -> None:
    number = [
        roles.version_from_flight_sw(raw) or np.nan for raw in table["flight_sw_version"].tolist()
    ]
    _extend(context, "versions", table, ~np.isnan(number), version=np.array(number, float))


def _learn_banner(context: Context, table: Table) -> None:
    texts, which = np.unique(table["text"], return_inverse=True)
    number = np.array(
        [roles.version_from_banner(text) or np.nan for text in texts.tolist()], float
    )[which]
    _extend(context, "versions", table, ~np.isnan(number), version=number)


def _learn_position(context: Context, table: Table) -> None:
    placed = (table["lat"] != 0) | (table["lon"] != 0)
    _extend(
        context,
        "position",
        table,
        placed & _from_autopilot(context, table),
        lat=table["lat"] * 1e-7,
        lon=table["lon"] * 1e-7,
        alt_msl=table["alt"] * 1e-3,
        relative_alt=table["relative_alt"] * 1e-3,
    )


def _learn_home(context: Context, table: Table) -> None:
    _extend(
        context,
        "home",
        table,
        _from_autopilot(context, table),
        lat=table["latitude"] * 1e-7,
        lon=table["longitude"] * 1e-7,
        alt_msl=table["altitude"] * 1e-3,
    )


def _from_autopilot(context: Context, table: Table) -> Bools:
    return context.lookup("sender.role", table).among("autopilot".__eq__)


def _extend(context: Context, name: str, table: Table, rows: Bools, **values: Values) -> None:
    """Add the `rows` of a table that an autopilot sent about itself."""
    kept = table.take(rows)
    context.histories[name].extend(
        kept.frames.sysid.astype(np.int64),
        kept.frames,
        kept.frames.number,
        **{n: v[rows] for n, v in values.items()},
    )


_LEARNERS = {
    "HEARTBEAT": _learn_heartbeats,
    "AUTOPILOT_VERSION": _learn_version,
    "STATUSTEXT": _learn_banner,
    "GLOBAL_POSITION_INT": _learn_position,
    "HOME_POSITION": _learn_home,
}
"""Message -> how it adds to the context; HEARTBEAT comes first because it says who is an autopilot."""

MISSING: dict[str, str] = {
    "vehicle.autopilot": "no HEARTBEAT of the autopilot says what it is (--autopilot tells)",
    "vehicle.type": "no HEARTBEAT of the autopilot says what it is",
    "vehicle.version": "neither AUTOPILOT_VERSION nor a boot banner says the version",
    "vehicle.lat": "no GLOBAL_POSITION_INT with a position",
    "vehicle.lon": "no GLOBAL_POSITION_INT with a position",
    "vehicle.alt_msl": "no GLOBAL_POSITION_INT with a position",
    "vehicle.relative_alt": "no GLOBAL_POSITION_INT with a position",
    "home.lat": "no HOME_POSITION",
    "home.lon": "no HOME_POSITION",
    "home.alt_msl": "no HOME_POSITION",
}
"""Context name -> what the recording lacks when it is unknown, for people."""
