"""The time of what a link delivers."""

from __future__ import annotations

import time

JUMP_S = 0.5
"""The clock of this computer was set when it moved this much (s) against one that nobody sets."""


class Clock:
    """Gives stamps that never step: the time of day when it was made, and what went by since then."""

    def __init__(self) -> None:
        """Take the time of day."""
        self._began_us = time.time_ns() // 1000
        self._began_ns = time.monotonic_ns()
        self._offset_s = 0.0

    def now_us(self) -> int:
        """Return the time, us since 1970."""
        return self._began_us + (time.monotonic_ns() - self._began_ns) // 1000

    def jump_s(self) -> float | None:
        """Return by how much the clock of this computer was set since the last call, s; None if it was not."""
        offset_s = time.time() - self.now_us() * 1e-6
        moved = offset_s - self._offset_s
        if abs(moved) < JUMP_S:
            return None
        self._offset_s = offset_s
        return moved
