"""`check --watch DIR`: recordings judged as they appear, until Ctrl-C."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any

from mavframecheck.cli.audit import Audit
from mavframecheck.cli.files import attempt
from mavframecheck.cli.output import complain
from mavframecheck.cli.settings import Chosen
from mavframecheck.report.escape import sentence
from mavframecheck.sources.arrivals import Arrivals

POLL_S = 1.0
"""Time between two looks at the directory, s."""


class Vigil(Audit):
    """The recordings that appear in one directory."""

    def __init__(self, directory: Path, chosen: Chosen, *, draw: bool = False) -> None:
        super().__init__([str(directory)], chosen, draw=draw)
        self._directory = directory

    def _files(self) -> list[str]:
        """Return nothing: what is there already is left alone."""
        return []

    def outcomes(self, _files: Sequence[str]) -> Generator[tuple[str, Any]]:
        """Judge each recording once it is complete."""
        arrivals = Arrivals(self._directory)
        complain(f"watching {sentence(str(self._directory))} for new recordings; Ctrl-C ends it")
        while True:
            for path in arrivals.complete(time.monotonic()):
                yield str(path), attempt(self._read, str(path), None)
            time.sleep(POLL_S)

    def stopped(self) -> None:
        """Take note of the way in which every watch ends."""
        complain("end of the watch")
