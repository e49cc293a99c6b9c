"""From the bytes of a mission file to its items, by what the content is."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from mavframecheck.missions.planned import Planned
from mavframecheck.missions.text import MOST_BYTES, Text, decode
from mavframecheck.sources import Kind, Recording


def read_mission(file: Recording) -> Planned:
    """Return the mission in an open file; MissionError names the place of what cannot be read."""
    planned = _reader(file.kind)(decode(file.name, file.content(MOST_BYTES + 1)))
    planned.notes += file.notes
    return planned


@contextmanager
def uncollected() -> Iterator[None]:
    """Do not look for garbage meanwhile: of a large mission nearly all objects stay, and looking takes a tenth of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _reader(kind: Kind) -> Callable[[Text], Planned]:
    """Return the reader of a kind; each is imported when it is used."""
    if kind is Kind.PLAN:
        from mavframecheck.missions.plan import read_plan

        return read_plan
    if kind is Kind.WPL:
        from mavframecheck.missions.wpl import read_wpl

        return read_wpl
    from mavframecheck.missions.points import read_points, read_rally

    return read_points if kind is Kind.POINTS else read_rally
