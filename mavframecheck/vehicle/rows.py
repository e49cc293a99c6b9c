"""Rows of a table as rules see them: raw and SI columns, masks, sentinels, context.

Everything is computed once per table and shared by all rules that ask for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from mavframecheck.geo.covariance import squared_correlation
from mavframecheck.semantics import catalogue, masks
from mavframecheck.semantics.constants import entries, entry_name
from mavframecheck.semantics.enums import AltRef, Axis
from mavframecheck.semantics.references import selected_height
from mavframecheck.semantics.tags import Condition, FieldTag, Sentinel
from mavframecheck.vehicle.context import Context, Known
from mavframecheck.vehicle.roles import of_each_kind
from mavframecheck.wire import Table
from mavframecheck.wire.frames import places_of
from mavframecheck.wire.table import join as join_tables

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
T = TypeVar("T")
FEW = 12
"""Up to this many values, comparing with each is faster than looking them up."""


class Rows:
    """Some rows of one message, with the context that was known when they were sent."""

    def __init__(self, table: Table, context: Context) -> None:
        """See `table` in the light of `context`."""
        self.table = table
        self.known: dict[str, Known] = {}
        """Context columns looked up so far; each keeps what it has once found."""
        self._asked: set[str] = set()
        """Those looked up in this batch: asked again, it says the same."""
        self.source = context
        """Where context is looked up."""
        self._cache: dict[tuple[object, ...], Any] = {}

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.table)

    def take(self, rows: Ints | Bools) -> Rows:
        """Return some of the rows."""
        places = places_of(rows)
        taken = Rows(self.table.take(places), self.source)
        taken.known = {name: column.take(places) for name, column in self.known.items()}
        taken._asked = set(self._asked)
        return taken

    def compact(self) -> Rows:
        """Return the same rows without holding on to the batch they came in."""
        kept = Rows(self.table.compact(), self.source)
        kept.known = self.known
        return kept

    def context(self, name: str) -> Known:
        """Return a context column; a value once found stays."""
        found = self.known.get(name)
        if found is None:
            found = self.known[name] = self.source.lookup(name, self.table)
            self._asked.add(name)
        return found

    def refresh(self, names: Iterable[str]) -> None:
        """Look up again what is unknown of the context columns called `names`, once in a batch."""
        for name in names:
            old = self.known.get(name)
            if old is None or (name not in self._asked and not old.known.all()):
                new = self.source.lookup(name, self.table)
                self.known[name] = new if old is None else old.completed(new)
                self._asked.add(name)

    def complete(self, names: Iterable[str]) -> Bools:
        """Return (n,) rows of which all context columns called `names` are known."""
        complete = np.ones(len(self), np.bool_)
        for name in names:
            complete &= self.context(name).known
        return complete

    def among(self, name: str, words: tuple[str, ...], choice: Callable[[str], bool]) -> Bools:
        """Return (n,) rows whose context word is allowed by `choice`, which says the same as `words`."""
        return self.cached(("among", name, words), lambda: self.context(name).among(choice))

    @property
    def about(self) -> Ints:
        """(n,) the system each row is about, negative where unknown."""
        return self.cached(("about",), lambda: self.source.about(self.table))

    @property
    def stream(self) -> Ints:
        """(n,) sender, target and instance as one number: rows of one number follow each other."""
        return self.cached(("stream",), self._stream)

    def _stream(self) -> Ints:
        table = self.table
        stream = table.frames.sender
        if "target_system" in table.layout.by_name:
            stream = stream * 256 + self.raw("target_system")
        tags = catalogue.tags(table.name)
        instance = next((tag.instance_field for tag in tags if tag.instance_field), "")
        if instance in table.layout.by_name and table[instance].dtype.kind in "iu":
            stream = stream * 2**16 + (self.raw(instance) & 0xFFFF)
        return np.asarray(stream, np.int64)

    def raw(self, field: str) -> Any:
        """Return a column as on the wire, widened so that arithmetic on it cannot wrap."""
        return self.cached(("raw", field), lambda: widened(self.table[field]))

    def has(self, condition: Condition) -> Bools:
        """Return (n,) rows in which a selector has one of the values of a condition."""
        return self.cached(
            ("has", condition),
            lambda: self._has(condition),
        )

    def _has(self, condition: Condition) -> Bools:
        raw = self.raw(condition.field)
        if len(condition.values) > FEW:
            return np.isin(raw, condition.values)
        found = np.zeros(len(raw), np.bool_)
        for value in condition.values:
            found |= raw == value
        return found

    def si(self, tag: FieldTag) -> Any:
        """Return a tagged column in SI (degrees for latitude and longitude), NaN where it is unknown."""
        key = ("si", tag.field, tag.scale, tag.sentinels)
        return self.cached(key, lambda: self._si(tag))

    def _si(self, tag: FieldTag) -> Any:
        si = self.raw(tag.field) * tag.scale
        may_be_absent = self.table.layout.by_name[tag.field].extension
        if not tag.sentinels and not may_be_absent:
            return si
        missing = self.unknown(tag) | ~_per_row(self.present(tag.field), si)
        return np.where(missing, np.nan, si)

    def used(self, tag: FieldTag) -> Bools:
        """Return (n,) whether the row's own mask lets the field count, and the sender gave it."""
        present = self.present(tag.field)
        if not tag.ignore_field:
            return present
        bit_set = (self.raw(tag.ignore_field) & tag.ignore_bit) != 0
        used: Bools = present & (bit_set != tag.ignore_when_set)
        return used

    def unknown(self, tag: FieldTag) -> Bools:
        """Return where a field holds a sentinel that says "not known"; shape of the column."""
        return self.cached(("unknown", tag.field, tag.sentinels), lambda: self._unknown(tag))

    def _unknown(self, tag: FieldTag) -> Bools:
        raw = self.raw(tag.field)
        result = np.zeros(raw.shape, np.bool_)
        for sentinel in tag.sentinels:
            if not sentinel.known:
                result |= _matches(sentinel, raw)
        return result

    def any_unknown(self, tag: FieldTag) -> Bools:
        """Return (n,) whether any element of a field is unknown."""
        return _any_element(self.unknown(tag))

    def any_nan(self, tag: FieldTag) -> Bools:
        """Return (n,) whether any element of a field is NaN where that is no sentinel for "not known"."""
        raw = self.raw(tag.field)
        if raw.dtype.kind != "f":
            return np.zeros(len(self), np.bool_)
        return _any_element(np.isnan(raw) & ~self.unknown(tag))

    def undefined(self, tag: FieldTag) -> Any:
        """Return (n,) the bits of a mask, or the value of an enumeration, that the standard does not define."""
        raw = self.raw(tag.field)
        if tag.enum in masks.mask_enums():
            return raw & ~np.int64(sum(bit.bit for bit in masks.bits(tag.enum)))
        return np.where(np.isin(raw, list(entries(tag.enum).values())), 0, raw)

    def references(self, tag: FieldTag) -> Any:
        """Return (n,) what each row's height `tag` is measured from, a word of `AltRef`."""
        if tag.alt_ref not in (AltRef.BY_FRAME, AltRef.BY_FIELD):
            return np.full(len(self), str(tag.alt_ref))
        raw = np.nan_to_num(self.raw(tag.frame_field), nan=-1.0).astype(np.int64)
        selectors = catalogue.tags_of(tag.message, tag.frame_field)
        same_view = (each for each in selectors if set(each.when) <= set(tag.when))
        enum = next((each.enum for each in same_view if each.enum), "MAV_FRAME")
        return of_each_kind(raw, lambda value: str(selected_height(enum, value)))

    def present(self, field: str) -> Bools:
        """Return (n,) whether the sender gave the field."""
        return self.table.present(field)

    def quaternion(self, tag: FieldTag, partners: dict[str, FieldTag]) -> Any:
        """Return (n, 4) a quaternion, w first: the array that `tag` names, or the four fields it begins."""
        if tag.axis is Axis.WXYZ:
            return self.raw(tag.field)
        following = (partners[name].field for name in ("qx", "qy", "qz"))
        return np.stack([self.raw(field) for field in (tag.field, *following)], axis=-1)

    def diagonal(self, tag: FieldTag) -> Any:
        """Return (n, k) the variances of a covariance field."""
        return self.raw(tag.field)[:, list(tag.diagonal)]

    def correlation(self, tag: FieldTag) -> Any:
        """Return (n,) the largest squared correlation of a covariance field (above 1: it is none)."""
        return squared_correlation(self.raw(tag.field), tag.diagonal)

    def words(self, field: str, tag: FieldTag | None) -> list[str]:
        """Return for each row what the value of a mask, frame or enumeration field says."""
        enum = tag.enum if tag is not None else ""
        values = self.raw(field).tolist()
        if enum in masks.mask_enums():
            return ["; ".join(masks.words(enum, value)) for value in values]
        named = [(str(value), entry_name(enum, value)) for value in values]
        return [f"{value} ({name})" if name != value else value for value, name in named]

    def cached(self, key: tuple[object, ...], compute: Callable[[], T]) -> T:
        """Return what `compute` gives, computed once for `key`."""
        if key not in self._cache:
            self._cache[key] = compute()
        found: T = self._cache[key]
        return found


def join(parts: Sequence[Rows]) -> Rows:
    """Return the rows of `parts`, one after the other, with the context that each has found."""
    first = parts[0]
    joined = Rows(join_tables([part.table for part in parts]), first.source)
    for name in {name for part in parts for name in part.known}:
        columns = [part.context(name) for part in parts]
        joined.known[name] = Known(
            np.concatenate([c.values for c in columns]),
            np.concatenate([c.known for c in columns]),
            max((c.labels for c in columns), key=len),  # lists of texts only grow
        )
    return joined


def widened(column: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return integers as int64 (the largest uint64 values clipped), floats as float64, texts as they are."""
    if column.dtype.kind == "u" and column.dtype.itemsize == 8:
        column = np.minimum(column, np.uint64(2**63 - 1))
    if column.dtype.kind in "iu":
        return column.astype(np.int64)
    if column.dtype.kind == "f":
        return column.astype(np.float64)
    return column


def _matches(sentinel: Sentinel, raw: npt.NDArray[Any]) -> Bools:
    """Return where `raw` holds the sentinel; shape of `raw`."""
    if sentinel.kind == "nan":
        hit = np.isnan(raw)
    elif sentinel.kind == "below":
        hit = raw < sentinel.value
    else:
        hit = raw == np.float32(sentinel.value) if raw.dtype.kind == "f" else raw == sentinel.value
    if raw.ndim == 1 or sentinel.scope == "element":
        return np.asarray(hit)
    whole = hit[:, 0] if sentinel.scope == "first" else hit.all(axis=1)
    return np.broadcast_to(whole[:, None], raw.shape)


def _any_element(column: Bools) -> Bools:
    """Return (n,) whether any element of each row holds."""
    return np.asarray(column.reshape(len(column), -1).any(axis=1))


def _per_row(rows: Bools, column: npt.NDArray[Any]) -> Bools:
    """Return a row mask shaped to combine with `column`."""
    return rows[:, None] if column.ndim > 1 else rows
