"""What the autopilot that a row is about does with it: the acceptance data as columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.rows import Rows
from mavframecheck.semantics import acceptance

FAMILY, VERSION = "vehicle.autopilot", "vehicle.version"


def verdicts(
    rows: Rows, message: str, field: str, pick: Callable[[acceptance.Verdict], Any]
) -> Any:
    """Return (n,) what `pick` takes from the verdict on each row's MAV_FRAME, which is in `field`."""
    frames = rows.raw(field) if field else np.zeros(len(rows), np.int64)

    def of(family: str, version: float, command: int | None, frame: int) -> Any:
        return pick(acceptance.accepts(family, message, frame, command, version))

    return _column(rows, frames, of)


def facts(rows: Rows, message: str, key: str) -> Any:
    """Return (n,) a fact about the message as text, ``unknown`` where the data has none."""

    def of(family: str, version: float, command: int | None, _frame: int) -> str:
        found = acceptance.fact(family, message, key, command, version)
        return "unknown" if found is None else str(found)

    return _column(rows, np.zeros(len(rows), np.int64), of)


def _column(rows: Rows, frames: npt.NDArray[np.int64], of: Callable[..., Any]) -> Any:
    """Return (n,) `of` for each row; rows of one family, version, command and frame ask once."""
    families, versions = rows.context(FAMILY), rows.context(VERSION)
    commanded = "command" in rows.table.layout.by_name
    commands = rows.raw("command") if commanded else np.zeros(len(rows), np.int64)
    number = np.nan_to_num(versions.values, nan=-1.0)
    kinds, which = np.unique(
        np.stack([families.values, number, commands, frames], axis=1), axis=0, return_inverse=True
    )
    answers = [
        of(
            _file_of(families.labels[int(family)]),
            version if version > 0 else float("nan"),
            int(command) if commanded else None,
            int(frame),
        )
        for family, version, command, frame in kinds.tolist()
    ]
    return np.array(answers)[which.reshape(-1)]


def _file_of(family: str) -> str:
    return family if family in acceptance.families() else acceptance.GENERIC
