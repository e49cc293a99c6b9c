"""Findings for the ground station: as STATUSTEXT, so that the operator reads them where he looks.

A station lists a STATUSTEXT under the system that sends it. So it is sent as a component of its own of the
system that the finding is about, and only to the link that the user names.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator

from mavframecheck.model import Finding, Severity
from mavframecheck.model.live import Change
from mavframecheck.semantics.constants import constant
from mavframecheck.wire import Dialect
from mavframecheck.wire.encode import encode_frame, encode_payload

COMPONENT = 89
"""MAV_COMP_ID_USER65: left to users by MAVLink, and unlike any autopilot's, camera's or companion's."""
EVERY_S = 2.0
"""At most one finding is sent in this time (s)."""
MOST_WAITING = 20
"""Findings that wait to be sent; beyond these the least bad are left out."""
_SEVERITIES = {
    Severity.ERROR: constant("MAV_SEVERITY.ERROR"),
    Severity.WARNING: constant("MAV_SEVERITY.WARNING"),
    Severity.INFO: constant("MAV_SEVERITY.INFO"),
}
_CHUNK = 50
_MOST_CHUNKS = 4
_SAID = ("found", "worse")


class Notifier:
    """Sends what is found, the worst first and not too fast."""

    def __init__(self, send: Callable[[bytes], None], dialect: Dialect) -> None:
        """Send frames with `send`; `dialect` has STATUSTEXT."""
        self._send = send
        self._layout = dialect.by_name["STATUSTEXT"]
        self._waiting: list[tuple[int, int, Finding]] = []
        self._told = self._seq = self._id = 0
        self._next = 0.0

    def tell(self, changes: Iterable[Change], now: float) -> None:
        """Take changes of findings, and send the worst that waits if it is time (`now`, s)."""
        for change in changes:
            if change.what in _SAID:
                self._told += 1
                heapq.heappush(
                    self._waiting, (-change.finding.severity.rank, self._told, change.finding)
                )
        self._waiting = heapq.nsmallest(MOST_WAITING, self._waiting)
        if self._waiting and now >= self._next:
            self._next = now + EVERY_S
            for frame in self._frames(heapq.heappop(self._waiting)[2]):
                self._send(frame)

    def _frames(self, finding: Finding) -> Iterator[bytes]:
        """Yield the frames of a finding: a text of more than 50 bytes comes in chunks."""
        text = f"{finding.code} {finding.subject}: {finding.text}".encode("ascii", "replace")
        chunks = [text[at : at + _CHUNK] for at in range(0, len(text), _CHUNK)][:_MOST_CHUNKS]
        self._id = self._id % 65535 + 1
        for number, chunk in enumerate(chunks):
            values = {
                "severity": _SEVERITIES[finding.severity],
                "text": chunk,
                "id": self._id if len(chunks) > 1 else 0,
                "chunk_seq": number,
            }
            payload = encode_payload(self._layout, values)
            sysid = finding.sysid or 1
            yield encode_frame(self._layout, payload, sysid=sysid, compid=COMPONENT, seq=self._seq)
            self._seq += 1
