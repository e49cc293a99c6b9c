"""A link from its bytes to what is said of it: recorded first, then judged."""

from __future__ import annotations

from mavframecheck.engine.contract import deviations
from mavframecheck.engine.live.meaning import Meaning
from mavframecheck.engine.live.pulse import Pulse
from mavframecheck.engine.live.session import Session
from mavframecheck.model import FileReport, Finding
from mavframecheck.model.contract import Contract, Deviation, Terms
from mavframecheck.model.live import Change, Event, LinkStatus
from mavframecheck.sources.links.line import Line
from mavframecheck.sources.links.recorder import Recorder
from mavframecheck.wire import Dialect


class Watched:
    """One link under watch."""

    def __init__(self, line: Line, session: Session, now: float) -> None:
        """Watch `line` from `now` on (s since 1970), and judge it in `session`."""
        self.line = line
        self.session = session
        self.pulse = Pulse(line.name, now)
        self.streams: list[Terms] = []
        """What every stream means, where somebody wants to know."""
        self.deviations: tuple[Deviation, ...] | None = None
        """Where they differ from the contract; None without one."""
        self._contract: Contract | None = None
        self._meaning: Meaning | None = None
        self._recorder: Recorder | None = None
        self.recording_failed = False

    def record(self, recorder: Recorder) -> None:
        """From now on, write down what comes."""
        self._recorder = recorder

    def learn_meaning(self, dialect: Dialect, contract: Contract | None) -> None:
        """From now on, find out what every stream means, and compare it with a contract."""
        self._meaning = Meaning(self.session.reading, dialect)
        self._contract = contract
        self._compare()

    def _compare(self) -> None:
        if self._meaning is not None:
            self.streams = self._meaning.streams
        if self._contract is not None:
            self.deviations = tuple(deviations(self._contract, self.streams))

    def tick(self, now: float) -> list[Change | Event]:
        """Take in what came by `now`; return what is to be said."""
        for notice in self.line.notices():
            self.pulse.note(notice.what, now, notice.text)
        self._hear(self.line.take(), now)
        changes = self.session.changes()
        return [*self.pulse.events(now), *changes]

    def _hear(self, records: bytes, now: float) -> None:
        if self._recorder is not None:
            self._recorder.write(records)
            if self._recorder.failed and not self.recording_failed:
                self.recording_failed = True
                why = f"the recording stopped after {self._recorder.size} bytes: {self._recorder.failed}"
                self.pulse.say("record", now, why)
        batch = self.session.take(records)
        damage = [*self.line.damage, *batch.damage]
        self.pulse.hear(batch, damage, self.session.reading.context, now)
        if self._meaning is not None and self._meaning.take(records, now):
            self._compare()

    def status(self, now: float) -> LinkStatus:
        """Return how the link does."""
        written = None if self._recorder is None else self._recorder.size
        return self.pulse.status(now, written)

    def finish(self, now: float) -> tuple[list[Change | Event], FileReport, tuple[Finding, ...]]:
        """Close the link; return what is still to be said, the report, and all findings."""
        self._hear(self.line.close(), now)
        if self._recorder is not None:
            self._recorder.close()
        report, findings = self.session.finish()
        if self._meaning is not None:
            self._meaning.look(now)
            self._compare()
        return [*self.pulse.events(now), *self.session.changes()], report, findings
