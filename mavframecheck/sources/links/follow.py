"""A tlog that another program is writing."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from mavframecheck.sources.recording import BATCH_BYTES
from mavframecheck.sources.sniff import REFUSALS, Kind, sniff
from mavframecheck.sources.stream import SourceError


class Follower:
    """Reads what a growing tlog holds, and then what is added."""

    def __init__(self, path: Path) -> None:
        """Open the tlog at `path`; SourceError when it cannot be read or is none."""
        self.name = str(path)
        self._path = path
        self._file: BinaryIO
        self._open()

    def _open(self) -> None:
        try:
            self._file = self._path.open("rb")
            head = self._file.read(1 << 18)
        except OSError as error:
            raise SourceError(
                f"{self.name}: {error.strerror}; name a tlog that is being written"
            ) from error
        kind = sniff(head) if head else Kind.TLOG
        if kind not in (Kind.TLOG, Kind.UNKNOWN):
            why = REFUSALS.get(
                kind, "is not a tlog: only those can be followed; give it to 'check'"
            )
            self._file.close()
            raise SourceError(f"{self.name}: this {why}")
        self._file.seek(0)

    def read(self) -> bytes:
        """Return what was added since the last call, a bounded part of it; b"" if nothing was."""
        return self._file.read(BATCH_BYTES)

    def began_again(self) -> bool:
        """Return whether the file is shorter than what was read of it; if so, read from its start."""
        if self._path.stat().st_size >= self._file.tell():
            return False
        self._file.seek(0)
        return True

    def close(self) -> None:
        """Close the file."""
        self._file.close()
