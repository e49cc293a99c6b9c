"""What a mask leaves in use and what it leaves out: the fields it governs, group by group.

A group is a vector or a triple of one message (position, velocity, acceleration, rates...); a field without
one is a group of its own. Which bit governs which field is in the catalogue, so a new message with a mask is
covered without a line here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mavframecheck.semantics import catalogue
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle.rows import Bools, Rows


def groups_used(rows: Rows, mask: FieldTag) -> Any:
    """Return (n,) how many groups the mask lets count, as a whole or in part."""
    return np.sum([_any_used(rows, group) for group in _groups(mask)], axis=0)


def used_zero(rows: Rows, mask: FieldTag) -> Bools:
    """Return (n,) whether everything that the mask lets count is exactly zero."""
    zero = np.ones(len(rows), np.bool_)
    for tag in _governed(mask):
        zero &= ~rows.used(tag) | ~_holds_something(rows, tag)
    return zero


def ignored_given(rows: Rows, mask: FieldTag) -> Bools:
    """Return (n,) whether a whole group is ignored, and every such group that was sent holds something."""
    every, some = np.ones(len(rows), np.bool_), np.zeros(len(rows), np.bool_)
    for group in _groups(mask):
        sent = np.any([rows.present(tag.field) for tag in group], axis=0)
        ignored = sent & ~_any_used(rows, group)
        given = np.any([_holds_something(rows, tag) for tag in group], axis=0)
        every &= ~ignored | given
        some |= ignored
    return every & some


def _governed(mask: FieldTag) -> list[FieldTag]:
    return [tag for tag in catalogue.tags(mask.message) if tag.ignore_field == mask.field]


def _groups(mask: FieldTag) -> list[list[FieldTag]]:
    groups: dict[str, list[FieldTag]] = {}
    for tag in _governed(mask):
        groups.setdefault(tag.group or tag.field, []).append(tag)
    return list(groups.values())


def _any_used(rows: Rows, group: list[FieldTag]) -> Bools:
    return np.asarray(np.any([rows.used(tag) for tag in group], axis=0))


def _holds_something(rows: Rows, tag: FieldTag) -> Bools:
    """Return (n,) whether a field holds a number other than zero."""
    raw = np.nan_to_num(rows.raw(tag.field)).reshape(len(rows), -1)
    return np.asarray((raw != 0).any(axis=1))
