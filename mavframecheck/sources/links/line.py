"""What can be watched, as tlog records: a link with its relay, or a tlog that another program writes."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol

from mavframecheck.model import Damage
from mavframecheck.model.live import Happening
from mavframecheck.sources.links.clock import Clock
from mavframecheck.sources.links.follow import Follower
from mavframecheck.sources.links.link import Inbox, Link
from mavframecheck.wire.dialect import Dialect
from mavframecheck.wire.records import Records


class Notice(NamedTuple):
    """What happened to the port or the file."""

    what: Happening
    text: str


class Line(Protocol):
    """Delivers records as they come."""

    name: str
    damage: list[Damage]
    """What held no frame in the bytes taken last, and is in no record."""

    def start(self) -> None:
        """Begin to read; SourceError when that cannot be."""

    def take(self) -> bytes:
        """Return the records that came since the last call, or parts of them; b"" for none."""

    def notices(self) -> list[Notice]:
        """Return what happened since the last call."""

    def close(self) -> bytes:
        """Stop, and return the records that are left."""


class LinkLine:
    """A link, and perhaps a second one that hears and says the same."""

    def __init__(self, address: str, relay: str | None, dialect: Dialect, clock: Clock) -> None:
        """Watch the link at `address`; SourceError when it, or `relay`, is no link."""
        inbox = Inbox(clock)
        self.name = address
        self.damage: list[Damage] = []
        self._inbox = inbox
        self._link = Link(address, inbox)
        self._relay = None if relay is None else Link(relay, inbox)
        if self._relay is not None:
            self._link.forward, self._relay.forward = self._relay.send, self._link.send
        self._links = [self._link] if self._relay is None else [self._relay, self._link]
        self._records = Records(dialect)

    def start(self) -> None:
        """Begin to read; SourceError when a port of this computer cannot be had."""
        for link in self._links:
            link.start()

    def take(self) -> bytes:
        """Return the records that are certain by now."""
        records = self._records.take(self._inbox.chunks())
        self.damage = self._records.damage
        return records

    def notices(self) -> list[Notice]:
        """Return whether ports opened or closed, and what was dropped."""
        notices = []
        for link in self._links:
            while link.news:
                news = link.news.popleft()
                who = "the relay" if link is self._relay else "the link"
                what: Happening = (
                    "note" if link is self._relay else "open" if news.open else "closed"
                )
                how = "is open" if news.open else f"is down: {news.why}; trying again"
                notices.append(Notice(what, f"{who} {how}"))
        if dropped := self._inbox.dropped():
            notices.append(Notice("garbage", f"{dropped} bytes dropped: they came too fast"))
        return notices

    def close(self) -> bytes:
        """Close the ports and return the records that are left."""
        for link in self._links:
            link.close()
        rest = self.take()
        damage = self.damage
        rest += self._records.close()
        self.damage = damage + self._records.damage
        return rest


class FileLine:
    """A tlog that grows."""

    def __init__(self, path: Path) -> None:
        """Follow the tlog at `path`; SourceError when it cannot be read or is none."""
        self._follower = Follower(path)
        self.name = self._follower.name
        self.damage: list[Damage] = []
        self._begun = False

    def start(self) -> None:
        """Do nothing: the file is open already."""

    def take(self) -> bytes:
        """Return what was added."""
        return self._follower.read()

    def notices(self) -> list[Notice]:
        """Return whether the file is open, gone or shorter than before."""
        notices = [] if self._begun else [Notice("open", "the file is open")]
        self._begun = True
        try:
            if self._follower.began_again():
                notices.append(
                    Notice("note", "the file is shorter than before: read from its start")
                )
        except OSError:
            pass
        return notices

    def close(self) -> bytes:
        """Close the file."""
        self._follower.close()
        return b""
