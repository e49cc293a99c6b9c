"""`module load mavframecheck` in MAVProxy: findings in its console, and the command `mavframecheck`.

MAVProxy hands over what it received and decoded; it is judged as the tlog that it makes.
"""

from __future__ import annotations

from typing import Any

from MAVProxy.modules.lib import mp_module

from mavframecheck.cli.output import page_context
from mavframecheck.engine import Settings, load_pack
from mavframecheck.engine.live.session import Session
from mavframecheck.model import Severity
from mavframecheck.model.live import Change
from mavframecheck.report.layout import Page
from mavframecheck.report.live import plain_lines
from mavframecheck.sources.links.clock import Clock
from mavframecheck.wire import load_dialect
from mavframecheck.wire.encode import stamped

EVERY_S = 0.5
"""MAVProxy waits while messages are judged, so they are judged by larger batches than `watch` has (s)."""
_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "orange", Severity.INFO: "blue"}


class Module(mp_module.MPModule):  # type: ignore[misc]
    """The module that MAVProxy loads."""

    def __init__(self, mpstate: Any) -> None:
        """Judge everything that `mpstate` receives from now on."""
        super().__init__(mpstate, "mavframecheck", "meaning of MAVLink numbers", public=True)
        self._clock = Clock()
        self._session = Session("MAVProxy", "MAVProxy", load_pack(), Settings(), load_dialect())
        self._records: list[bytes] = []
        self._next_us = 0
        self._page = Page(page_context())
        self._standing: dict[tuple[str, str], Change] = {}
        self.add_command("mavframecheck", self.cmd_status, "findings so far")

    def mavlink_packet(self, packet: Any) -> None:
        """Keep a message until the next batch."""
        frame = packet.get_msgbuf()
        if frame and packet.get_type() != "BAD_DATA":
            self._records.append(stamped(bytes(frame), self._clock.now_us()))

    def idle_task(self) -> None:
        """Judge what came, when it is time."""
        now_us = self._clock.now_us()
        if now_us < self._next_us:
            return
        self._next_us = now_us + round(EVERY_S * 1e6)
        self._session.take(b"".join(self._records))
        self._records.clear()
        for change in self._session.changes():
            self._tell(change)

    def _tell(self, change: Change) -> None:
        finding = change.finding
        if change.what == "withdrawn":
            self._standing.pop((finding.code, finding.subject), None)
        else:
            self._standing[finding.code, finding.subject] = change
        for line in plain_lines(change, self._page, links=False):
            self.console.writeln(line, fg=_COLOURS[finding.severity])

    def cmd_status(self, _args: list[str]) -> None:
        """Write the findings so far."""
        for change in self._standing.values():
            finding = change.finding
            title = f"{finding.severity} {finding.code} {finding.subject}, {finding.count} times"
            self.console.writeln(f"{title}: {finding.text}")
        if not self._standing:
            self.console.writeln("mavframecheck: no findings")
