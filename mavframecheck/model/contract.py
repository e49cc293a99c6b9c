"""What a system is supposed to send, and where a link differs from it."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

Aspect: TypeAlias = Literal["missing", "unexpected", "frames", "heights", "clocks", "rate"]


class Terms(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One message of one sender: what it means and how often it comes."""

    sender: str
    """``system/component``."""
    message: str
    rate_hz: float | None = None
    """Messages per second; None: any."""
    frames: tuple[str, ...] = ()
    """Frames of its values, by name of a reference; empty: not looked at."""
    heights: tuple[str, ...] = ()
    """What its heights are above."""
    clocks: tuple[str, ...] = ()
    """Clocks of its stamps."""

    @property
    def key(self) -> tuple[str, str]:
        """Sender and message."""
        return self.sender, self.message


class Contract(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All streams that a system is supposed to send."""

    contract: Literal[1]
    """Version of this format."""
    rate_within: float = 2.0
    """A rate may be this many times higher or lower."""
    stream: tuple[Terms, ...] = ()


class Deviation(msgspec.Struct, frozen=True, kw_only=True):
    """A stream that is not as the contract says."""

    what: Aspect
    sender: str
    message: str
    expected: str
    observed: str

    @property
    def text(self) -> str:
        """Say it in a line."""
        stream = f"{self.sender} {self.message}"
        if self.what == "missing":
            return f"{stream} is missing (expected {self.expected})"
        if self.what == "unexpected":
            return f"{stream} is not in the contract ({self.observed})"
        return f"{stream}: {self.what} expected {self.expected}, found {self.observed}"
