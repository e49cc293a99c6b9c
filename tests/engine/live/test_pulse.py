"""Rates, losses and lateness of a link's last seconds."""

from __future__ import annotations

import pytest

from mavframecheck.engine import Settings
from mavframecheck.engine.live.pulse import Pulse, Recent
from mavframecheck.engine.live.session import Session
from mavframecheck.model.live import SenderStatus
from mavframecheck.wire.encode import stamped
from tests.engine.judged import pack_of, rule
from tests.strategies import DIALECT, frame

START_S = 1_800_000_000.0


class Link:
    """A pulse, and what it hears."""

    def __init__(self) -> None:
        self.pulse = Pulse("link", START_S)
        self._session = Session("link", "link", pack_of(rule()), Settings(), DIALECT)

    def hear(self, seq: int, t_s: float, boot_ms: int = 0) -> None:
        sent = frame("ATTITUDE", {"time_boot_ms": boot_ms}, seq=seq % 256)
        batch = self._session.take(stamped(sent, round((START_S + t_s) * 1e6)))
        self.pulse.hear(batch, [], self._session.reading.context, START_S + t_s)

    def sender(self, t_s: float) -> SenderStatus:
        return self.pulse.senders(START_S + t_s)[257]


def test_rate_and_loss() -> None:
    """Ten a second, every fifth of them lost on the way."""
    link = Link()
    for number in range(200):
        if number % 5:
            link.hear(number, number * 0.1)
    status = link.pulse.status(START_S + 19.9, None)
    assert status.rate_hz == pytest.approx(8.0, rel=0.1)
    assert status.loss == pytest.approx(0.2, rel=0.15)
    assert status.messages == 160


def test_loss_is_forgotten() -> None:
    """A gap counts for ten seconds, and a counter that goes back is none."""
    link = Link()
    for number, seq in enumerate([0, 1, 50, 51, 3, 4, *range(5, 25)]):
        link.hear(seq, number * 1.0)
    assert link.sender(25).loss == 0.0


def test_latency() -> None:
    """How much later than the fastest message the last one came, whatever the clock counts from."""
    link = Link()
    for number, late_s in enumerate([0.03, 0.02, 0.25]):
        link.hear(number, number * 0.1 + late_s, boot_ms=100_000 + number * 100)
    assert link.sender(1).latency_s == pytest.approx(0.23, abs=0.002)


def test_latency_after_a_restart() -> None:
    """A clock that begins again makes nothing late."""
    link = Link()
    link.hear(0, 0.0, boot_ms=100_000)
    link.hear(1, 1.0, boot_ms=500)
    assert link.sender(1).latency_s == 0.0


def test_recent() -> None:
    recent = Recent()
    for second in range(30):
        recent.add(second, 2.0)
    assert recent.total(29.5) == 20.0
    assert recent.total(100) == 0
