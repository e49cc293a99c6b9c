"""Findings as STATUSTEXT: the worst first, not too fast, whole where the station joins chunks."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

from mavframecheck.engine.live.notify import COMPONENT, EVERY_S, MOST_WAITING, Notifier
from mavframecheck.model import Severity
from mavframecheck.model.live import Change
from tests.report.test_screen import finding
from tests.strategies import DIALECT


class Station:
    """Reads what is sent as pymavlink does."""

    def __init__(self) -> None:
        self._link = ardupilotmega.MAVLink(None)
        self.told: list[Any] = []

    def hear(self, data: bytes) -> None:
        self.told += self._link.parse_buffer(data) or []

    def texts(self) -> list[str]:
        """Return the whole texts."""
        texts: dict[int, str] = {}
        for number, each in enumerate(self.told):
            key = each.id or -number
            texts[key] = texts.get(key, "") + each.text
        return list(texts.values())


def change(severity: Severity, code: str, what: Any = "found", text: str = "Short.") -> Change:
    one = finding(severity, code=code, text=text, sysid=7)
    return Change(what=what, time=0.0, link="link", finding=one)


def test_worst_first_and_not_too_fast() -> None:
    station = Station()
    notifier = Notifier(station.hear, DIALECT)
    notifier.tell([change(Severity.INFO, "MFC001"), change(Severity.ERROR, "MFC002")], 0.0)
    notifier.tell([change(Severity.WARNING, "MFC003"), change(Severity.INFO, "MFC9", "ended")], 0.1)
    assert [text[:6] for text in station.texts()] == ["MFC002"]
    for number in range(5):
        notifier.tell([], (number + 1) * EVERY_S)
    assert [text[:6] for text in station.texts()] == ["MFC002", "MFC003", "MFC001"]
    sent = {(each.get_srcSystem(), each.get_srcComponent()) for each in station.told}
    assert sent == {(7, COMPONENT)}
    severities = [each.severity for each in station.told if each.chunk_seq == 0]
    assert severities == [
        ardupilotmega.MAV_SEVERITY_ERROR,
        ardupilotmega.MAV_SEVERITY_WARNING,
        ardupilotmega.MAV_SEVERITY_INFO,
    ]


def test_long_text() -> None:
    """A long text comes in chunks that stations join; a very long one is cut off."""
    station = Station()
    Notifier(station.hear, DIALECT).tell([change(Severity.ERROR, "MFC1", text="word " * 20)], 0.0)
    (text,) = station.texts()
    assert text.endswith("word word ")
    assert len(station.told) > 1


def test_bounded() -> None:
    """A storm of findings waits no longer than its worst twenty."""
    station = Station()
    notifier = Notifier(station.hear, DIALECT)
    notifier.tell([change(Severity.INFO, f"MFC{n:03}") for n in range(100)], 0.0)
    for number in range(100):
        notifier.tell([], (number + 1) * EVERY_S)
    assert len(station.texts()) == MOST_WAITING
