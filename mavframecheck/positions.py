"""Positions as types, and the positions of a recording: the library behind `inspect --positions`.

```python
from mavframecheck.positions import AltRef, Origin, read

home = Origin("home", 47.397742, 8.545594, 488.0, AltRef.MSL)
for extract in read("flight.tlog", messages=["GLOBAL_POSITION_INT"]):
    ned = extract.position.above("ellipsoid").to_local(home)   # LocalPosition, (n, 3) m
    print(extract.measured.source, ned.xyz)
```

A position plus a position, metres of two origins, heights of two references, zones of two maps: all raise
`MixingError`, which says what does not fit and what to do. `docs/conventions.md` has the list of types.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from mavframecheck.engine.conversion import Converter, Target
from mavframecheck.engine.positions import Extract, positions
from mavframecheck.engine.reading import Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.semantics.enums import AltRef, Clock, RefPoint
from mavframecheck.semantics.positions import (
    NO_TIME,
    BodyVector,
    EcefPosition,
    EcefVector,
    GeodeticPosition,
    LocalPosition,
    LocalVector,
    MapVector,
    Measured,
    MixingError,
    Origin,
    Position,
    ProjectedPosition,
)
from mavframecheck.sources import open_recording
from mavframecheck.wire import load_dialect

__all__ = [
    "NO_TIME",
    "AltRef",
    "BodyVector",
    "Clock",
    "EcefPosition",
    "EcefVector",
    "Extract",
    "GeodeticPosition",
    "LocalPosition",
    "LocalVector",
    "MapVector",
    "Measured",
    "MixingError",
    "Origin",
    "Position",
    "ProjectedPosition",
    "RefPoint",
    "Target",
    "read",
]


def read(
    path: str | Path,
    messages: Collection[str] = (),
    target: Target | None = None,
    *,
    dialect: str = "ardupilotmega",
    input_kind: str | None = None,
) -> Iterator[Extract]:
    """Yield the positions of a recording as typed columns, batch by batch; memory stays flat.

    `messages`: only these, empty for all. `target`: what to convert them to. Rows that are no position
    say why in `Extract.problem`. Raises `mavframecheck.sources.SourceError` when the recording cannot be
    read.
    """
    converter = Converter(target or Target())
    settings = Settings(dialect=dialect, input_kind=input_kind)
    with open_recording(path, input_kind) as recording:
        reading = Reading(recording, settings, load_dialect(dialect))
        for found in positions(reading, frozenset(messages)):
            yield from converter.convert(found)
