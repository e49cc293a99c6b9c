"""What the autopilot that a row is about does with it: the acceptance data as columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.semantics import acceptance
from mavframecheck.semantics.constants import entry_name
from mavframecheck.semantics.enums import AltRef
from mavframecheck.semantics.tags import FieldTag
from mavframecheck.vehicle.rows import Rows

FAMILY, VERSION = "vehicle.autopilot", "vehicle.version"


def verdicts(
    rows: Rows, message: str, field: str, pick: Callable[[acceptance.Verdict], Any]
) -> Any:
    """Return (n,) what `pick` takes from the verdict on each row's MAV_FRAME, which is in `field`."""
    frames = rows.raw(field) if field else np.zeros(len(rows), np.int64)

    def of(family: str, version: float, command: int | None, frame: int) -> Any:
        picked = pick(acceptance.accepts(family, message, frame, command, version))
        return picked.replace("%u", str(frame)) if isinstance(picked, str) else picked

    return _column(rows, frames, of)


def taken(rows: Rows, message: str) -> Any:
    """Return (n,) the frames that the autopilot of each row obeys in the message, in words."""

    def of(family: str, version: float, command: int | None, _: int) -> str:
        table = enumerate(acceptance.verdicts(family, message, command, version))
        obeyed = [f for f, verdict in table if verdict.consequence is acceptance.Consequence.OBEYED]
        return ", ".join(f"{entry_name('MAV_FRAME', f)} ({f})" for f in obeyed)

    return _column(rows, np.zeros(len(rows), np.int64), of)


def facts(rows: Rows, message: str, key: str) -> Any:
    """Return (n,) a fact about the message as text, ``unknown`` where the data has none."""

    def of(family: str, version: float, command: int | None, _: int) -> str:
        found = acceptance.fact(family, message, key, command, version)
        return "unknown" if found is None else str(found)

    return _column(rows, np.zeros(len(rows), np.int64), of)


def listed(rows: Rows, message: str, key: str, values: Any) -> Any:
    """Return (n,) ``yes`` or ``no``: whether each row's value is in the set that the data has under `key`.

    ``unknown`` where there is none, or the versions in question differ.
    """

    def of(family: str, version: float, command: int | None, value: int) -> str:
        held = acceptance.member(family, message, key, value, command, version)
        return {True: "yes", False: "no", None: "unknown"}[held]

    return _column(rows, np.broadcast_to(values, len(rows)), of)


def references(rows: Rows, message: str, tag: FieldTag) -> Any:
    """Return (n,) what each row's height `tag` is measured from, a word of `AltRef`.

    A message without a frame is read as the autopilot takes it; ``unspecified`` where nobody knows.
    """
    found = rows.references(tag)
    if AltRef.UNSPECIFIED not in found:
        return found
    taken = facts(rows, message, "z_reference")
    return np.where((found == AltRef.UNSPECIFIED) & (taken != "unknown"), taken, found)


def _column(rows: Rows, asked: npt.NDArray[np.int64], of: Callable[..., Any]) -> Any:
    """Return (n,) `of` for each row; rows of one family, version, command and value `asked` about ask once."""
    families, versions = rows.context(FAMILY), rows.context(VERSION)
    commanded = "command" in rows.table.layout.by_name
    commands = rows.raw("command") if commanded else np.zeros(len(rows), np.int64)
    number = np.nan_to_num(versions.values, nan=-1.0)
    columns = (families.values, number, commands, asked)
    if all((column == column[0]).all() for column in columns):
        kinds, which = np.array([[column[0] for column in columns]]), np.zeros(len(rows), np.int64)
    else:
        table = np.stack(columns, axis=1)
        kinds, which = np.unique(table, axis=0, return_inverse=True)
    answers = [
        of(
            _file_of(families.labels[int(family)]),
            version if version > 0 else float("nan"),
            int(command) if commanded else None,
            int(value),
        )
        for family, version, command, value in kinds.tolist()
    ]
    return np.array(answers)[which.reshape(-1)]


def _file_of(family: str) -> str:
    return family if family in acceptance.families() else acceptance.GENERIC
