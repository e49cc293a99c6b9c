"""What is certain to be wrong in a mission file, and means the same when it is right: written anew in place.

Superseded frames (5 is 0, 6 is 3, 11 is 10) and longitudes between 180 and 360 degrees. What changes where the
vehicle flies is never among it. Every other character of the file stays as it is.
"""

from __future__ import annotations

import difflib
import os
import tempfile
from collections.abc import Collection, Iterator
from contextlib import suppress
from decimal import Decimal
from pathlib import Path
from shutil import copymode
from typing import NamedTuple

from mavframecheck.missions.planned import MISSION, Item, Planned
from mavframecheck.missions.reading import read_mission
from mavframecheck.semantics.commands import location_commands
from mavframecheck.semantics.enums import FrameKind
from mavframecheck.semantics.mavframe import FRAMES, GLOBAL_FRAMES
from mavframecheck.sources import MISSIONS, STDIN, SourceError, open_recording
from mavframecheck.sources.stream import GZIP_MAGIC

FRAME, LONGITUDE = "MFC111", "MFC315"
"""Rules whose findings are mended."""
_NEWER = {
    facts.id: facts.superseded_by
    for facts in FRAMES
    if facts.superseded_by is not None and facts.kind is FrameKind.GLOBAL
}
_BYTE_ORDER_MARK = "\ufeff".encode()


class Edit(NamedTuple):
    """A piece of the text to be replaced."""

    begin: int
    end: int
    new: str


class Mended(NamedTuple):
    """A mission file with what is certain put right."""

    name: str
    before: str
    after: str
    edits: int

    def diff(self) -> str:
        """Return the difference as a unified diff, without colours."""
        before, after = (text.splitlines(keepends=True) for text in (self.before, self.after))
        pieces = difflib.unified_diff(before, after, self.name, self.name)
        return "".join(piece if piece.endswith("\n") else f"{piece}\n" for piece in pieces)


def edits(planned: Planned, codes: Collection[str]) -> Iterator[Edit]:
    """Yield the edits for findings of the rules `codes`, in the order of the items."""
    for item in planned.items:
        newer = _NEWER.get(item.frame)
        if newer is not None and item.places.frame >= 0 and FRAME in codes:
            yield _replaced(planned, item.places.frame, str(newer))
        if LONGITUDE in codes and _turned_too_far(item):
            written = Decimal(planned.text.number(item.places.y))
            yield _replaced(
                planned, item.places.y, f"{written - 360 * (1 if written > 0 else -1):f}"
            )


def _replaced(planned: Planned, at: int, new: str) -> Edit:
    return Edit(at, at + len(planned.text.number(at)), new)


def _turned_too_far(item: Item) -> bool:
    """Return whether an item has a place on Earth whose longitude lies beyond 180 degrees."""
    is_place = item.mission_type != MISSION or item.command in location_commands()
    on_earth = item.frame in GLOBAL_FRAMES and abs(item.x) <= 90
    return is_place and on_earth and 180 < abs(item.y) < 360


def mend(path: str, codes: Collection[str]) -> Mended | None:
    """Return the mission file at `path` put right; None when it is a recording.

    Raises SourceError when it cannot be read, or is no file that could be written again.
    """
    if path == STDIN:
        raise SourceError("<stdin>: standard input cannot be mended; give a file")
    with open_recording(path, kinds=None) as file:
        if file.kind not in MISSIONS:
            return None
        if Path(path).read_bytes().startswith(GZIP_MAGIC):
            raise SourceError(f"{path}: a packed file is not mended; unpack it first")
        planned = read_mission(file)
    before = planned.text.content
    found = sorted(edits(planned, codes))
    pieces, here = [], 0
    for edit in found:
        pieces += [before[here : edit.begin], edit.new]
        here = edit.end
    return Mended(path, before, "".join([*pieces, before[here:]]), len(found))


def write(mended: Mended) -> None:
    """Put the mended text in the place of the file at once: no reader sees half of it.

    Raises OSError when the folder cannot be written to; the file is as it was then.
    """
    target = Path(os.path.realpath(mended.name))  # behind a link
    with target.open("rb") as old:
        mark = old.read(len(_BYTE_ORDER_MARK)) == _BYTE_ORDER_MARK
    content = (_BYTE_ORDER_MARK if mark else b"") + mended.after.encode()
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as new:
            new.write(content)
            new.flush()
            os.fsync(new.fileno())
        copymode(target, name)
        Path(name).replace(target)
    except BaseException:
        with suppress(OSError):
            Path(name).unlink()
        raise
