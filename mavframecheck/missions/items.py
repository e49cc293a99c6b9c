"""Mission items as columns, whatever message carried them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from mavframecheck.missions.planned import SAID
from mavframecheck.semantics.mavframe import GLOBAL_FRAMES, METRIC_FRAMES
from mavframecheck.wire import Frames, Table
from mavframecheck.wire.frames import join as join_frames

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


_COLUMNS = ("seq", "command", "frame", "params", "x", "y", "z")


@dataclass(slots=True)
class Items:
    """Items of a mission; every array has n rows."""

    frames: Frames
    """The frame that carried each item."""
    seq: Ints
    command: Ints
    frame: Ints
    """MAV_FRAME."""
    params: Floats
    """(n, 4) param1 to param4 as sent."""
    x: Floats
    """Latitude in degrees in a global frame, metres in a local one, else the bare number."""
    y: Floats
    """Longitude in degrees, metres, or the bare number."""
    z: Floats
    """Metres above the reference of the frame (down in NED and FRD)."""
    said: dict[str, Floats] = field(default_factory=dict)
    """What only a file says (`planned.Said`), by the names in `SAID`; empty in a log."""

    def __len__(self) -> int:
        """Return the number of items."""
        return len(self.seq)

    def take(self, rows: Ints) -> Items:
        """Return the items at `rows`."""
        columns = {name: getattr(self, name)[rows] for name in _COLUMNS}
        said = {name: column[rows] for name, column in self.said.items()}
        return replace(self, frames=self.frames.take(rows), said=said, **columns)


def items_of(table: Table) -> Items:
    """Return the rows of a MISSION_ITEM or MISSION_ITEM_INT table as items, in their order."""
    frame = table["frame"].astype(np.int64)
    scale = np.ones(len(table))
    if table.name == "MISSION_ITEM_INT":
        scale = np.where(np.isin(frame, GLOBAL_FRAMES), 1e-7, scale)
        scale = np.where(np.isin(frame, METRIC_FRAMES), 1e-4, scale)
    return Items(
        frames=table.frames,
        seq=table["seq"].astype(np.int64),
        command=table["command"].astype(np.int64),
        frame=frame,
        params=np.stack([table[f"param{k}"].astype(float) for k in (1, 2, 3, 4)], axis=1),
        x=table["x"] * scale,
        y=table["y"] * scale,
        z=table["z"].astype(float),
        said={name: table[name] for name in SAID if name in table.layout.by_name},
    )


def join(parts: list[Items]) -> Items:
    """Return the items of `parts`, one after the other."""
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS}
    said = {name: np.concatenate([part.said[name] for part in parts]) for name in parts[0].said}
    return Items(join_frames([part.frames for part in parts]), **columns, said=said)
