"""A recording as columns that can be changed and written again: new checksums, same framing and stamps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from mavframecheck.wire import Dialect, Layout, Table, read_batches, whole
from mavframecheck.wire.encode import encode_frame, stamped
from mavframecheck.wire.frames import STAMP

Rows = npt.NDArray[np.int64]
Columns = npt.NDArray[np.void]

AUTOPILOT = 1
"""Component id of every autopilot in the recordings used here."""


class Change(NamedTuple):
    """Rows of a table, and the payloads that they get instead."""

    rows: Rows
    columns: Columns


class Log:
    """The frames of a tlog in memory, and their tables."""

    def __init__(self, data: bytes, dialect: Dialect) -> None:
        """Read `data` with the ids of `dialect`; what is no frame is left out."""
        batch = next(read_batches([[whole(data, 0)]], dialect, stamped=True))
        self.dialect = dialect
        self.frames = batch.frames
        self.tables = batch.tables
        ends = self.frames.offset + self.frames.size
        starts = self.frames.offset - STAMP
        self._records = [data[a:b] for a, b in zip(starts.tolist(), ends.tolist())]

    @property
    def seconds(self) -> npt.NDArray[np.float64]:
        """(n,) receive time of each frame since the first one, s."""
        elapsed: npt.NDArray[np.float64] = (self.frames.t_us - self.frames.t_us[0]) * 1e-6
        return elapsed

    def first(self, seconds: float) -> bytes:
        """Return the beginning of the recording."""
        return b"".join(self._records[: int(np.searchsorted(self.seconds, seconds))])

    def own(self, name: str) -> Table | None:
        """Return what the autopilot sends of a message, None when it sends none."""
        table = self.tables.get(name)
        mine = None if table is None else table.take(table.frames.compid == AUTOPILOT)
        return mine if mine is not None and len(mine) else None

    def written(
        self, changes: Mapping[str, Change], added: Mapping[int, bytes] | None = None
    ) -> bytes:
        """Return the recording with some payloads changed, and records `added` behind some frames."""
        records = list(self._records)
        for name, change in changes.items():
            table = self.tables[name].take(change.rows)
            for number, payload in zip(table.frames.number.tolist(), change.columns):
                records[number] = self._record(number, table.layout, payload.tobytes())
        for number, more in (added or {}).items():
            records[number] += more
        return b"".join(records)

    def _record(self, number: int, layout: Layout, payload: bytes) -> bytes:
        """Return the record at `number` with another payload."""
        f = self.frames
        frame = encode_frame(
            layout,
            payload,
            sysid=int(f.sysid[number]),
            compid=int(f.compid[number]),
            seq=int(f.seq[number]),
            version=cast("Literal[1, 2]", int(f.version[number])),
        )
        return stamped(frame, int(f.t_us[number]))


def put(columns: Columns, field: str, values: Any) -> None:
    """Set a field to (n,) or (n, k) values: rounded and kept in the range of its type."""
    column = columns[field]
    wanted = np.asarray(values, np.float64)
    if wanted.ndim == 1 and column.ndim == 2:
        wanted = wanted[:, None]
    if column.dtype.kind in "iu":
        limits = np.iinfo(column.dtype)
        wanted = np.clip(np.rint(wanted), float(limits.min), float(limits.max))
    column[...] = wanted.astype(column.dtype)
