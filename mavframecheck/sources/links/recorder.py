"""A tlog that grows by whole records, each batch in one write: a kill leaves all but the last one."""

from __future__ import annotations

from pathlib import Path

from mavframecheck.sources.stream import SourceError


class Recorder:
    """Appends records to a file of its own."""

    def __init__(self, path: Path) -> None:
        """Make the file at `path`; SourceError when it is there already or cannot be made."""
        self.path = path
        self.size = 0
        """Bytes written."""
        self.failed = ""
        """Why it stopped, empty while it goes on."""
        try:
            self._file = path.open("xb", buffering=0)
        except FileExistsError as error:
            raise SourceError(f"{path}: there is such a file; record under another name") from error
        except OSError as error:
            raise SourceError(f"{path}: cannot be written: {error.strerror}") from error

    def write(self, records: bytes) -> None:
        """Write whole records; when the disk is full, keep those before and say so in `failed`."""
        if self.failed or not records:
            return
        try:
            written = self._file.write(records)
            if written != len(records):
                self._file.truncate(self.size)
                self.failed = "the disk is full"
                return
        except OSError as error:
            self.failed = error.strerror or str(error)
            return
        self.size += len(records)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
