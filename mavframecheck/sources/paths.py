"""From what a user named on the command line to the recordings behind it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from glob import glob, has_magic
from pathlib import Path
from typing import Final, Literal, NamedTuple

from mavframecheck.sources.sniff import MISSIONS, RECORDINGS, Kind, sniff_stream
from mavframecheck.sources.stream import SourceError, open_stream

Stdin = Literal["-"]
STDIN: Final[Stdin] = "-"
"""Names standard input, on the command line and in `open_recording`."""


class Inputs(NamedTuple):
    """What the given paths stand for, in the order given, each once."""

    recordings: list[Path | Stdin]
    """Files named by the user, whatever they are, and the recordings found in directories."""
    missions: list[Path]
    """Mission files met in directories."""


def expand(paths: Sequence[str]) -> Inputs:
    """Resolve files, directories (searched recursively), glob patterns and `-`.

    Raises SourceError for a path or a pattern with nothing behind it.
    """
    recordings: dict[Path | Stdin, None] = {}
    missions: dict[Path, None] = {}
    for text in paths:
        if text == STDIN:
            recordings[STDIN] = None
            continue
        for path in _named(text):
            if path.is_dir():
                _search(path, recordings, missions)
            else:
                recordings[path] = None
    return Inputs(list(recordings), list(missions))


def _named(text: str) -> list[Path]:
    """Return what one argument names; a pattern is expanded because not every shell does it."""
    if os.path.lexists(text):
        return [Path(text)]
    if not has_magic(text):
        raise SourceError(f"{text}: no such file or directory; check the spelling of the path")
    found = glob(text, recursive=True)  # noqa: PTH207  (Path.glob takes no absolute pattern)
    matches = sorted(Path(match) for match in found)
    if not matches:
        raise SourceError(f"{text}: no file matches this pattern; check it or name a directory")
    return matches


def _search(
    directory: Path, recordings: dict[Path | Stdin, None], missions: dict[Path, None]
) -> None:
    """Add the recordings and missions under `directory`, judged by content."""
    for path in files_under(directory):
        kind = kind_of(path)
        if kind is None or kind in RECORDINGS:
            recordings[path] = None
        elif kind in MISSIONS:
            missions[path] = None


def files_under(directory: Path) -> Iterator[Path]:
    """Walk the regular files under `directory` in a fixed order; links to directories end there."""
    for folder, subfolders, names in os.walk(directory, onerror=_refuse):
        subfolders.sort()
        yield from (path for name in sorted(names) if (path := Path(folder, name)).is_file())


def _refuse(error: OSError) -> None:
    raise SourceError(
        f"{error.filename}: this directory cannot be searched: {error.strerror}"
    ) from error


def kind_of(path: Path) -> Kind | None:
    """Sniff a file; None when it cannot be read, so that opening it can say why."""
    try:
        with path.open("rb") as file:
            return sniff_stream(open_stream(file, []))
    except OSError:
        return None
