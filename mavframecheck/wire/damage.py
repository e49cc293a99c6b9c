"""Damaged byte ranges, joined where they touch."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from mavframecheck.model import Damage


class Ranges:
    """Joins ranges that continue each other, across batches."""

    def __init__(self) -> None:
        """Start without a range."""
        self.open: Damage | None = None
        """The range that the next one may continue."""

    def add(self, damage: Iterable[Damage]) -> Iterator[Damage]:
        """Take ranges in order of their offsets; yield those that are complete."""
        for part in damage:
            last = self.open
            if last is not None and last.offset + last.length == part.offset:
                self.open = Damage(last.offset, last.length + part.length, last.reason)
            else:
                yield from self.close()
                self.open = part

    def close(self) -> Iterator[Damage]:
        """Yield the last range: nothing continues it any more."""
        if self.open is not None:
            yield self.open
        self.open = None
