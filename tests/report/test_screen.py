"""The screen of `watch`: always of the size of the terminal, the worst first, nothing hostile in it."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.model import Finding, Severity, Vehicle
from mavframecheck.model.contract import Deviation, Terms
from mavframecheck.model.live import Event, LinkStatus, Place, SenderStatus, Standing, View
from mavframecheck.report.screen import bars, screen

NOW = 1_800_000_000.0
SIZES = [(80, 24), (160, 50), (40, 10), (300, 100)]


def finding(severity: Severity = Severity.WARNING, **changes: Any) -> Finding:
    values: dict[str, Any] = {
        "code": "MFC302",
        "name": "degrees-in-scaled-field",
        "severity": severity,
        "confidence": "high",
        "file": "link",
        "subject": "1/191 SET_POSITION_TARGET_GLOBAL_INT",
        "sysid": 1,
        "compid": 191,
        "message_name": "SET_POSITION_TARGET_GLOBAL_INT",
        "field": None,
        "time_first": NOW - 9,
        "time_last": NOW,
        "utc_first": None,
        "utc_last": None,
        "count": 6,
        "location": None,
        "fingerprint": "0",
        "evidence": {},
        "text": "The latitude looks like plain degrees. " * 5,
        "fix": "Multiply by 1e7 and round.",
    }
    return Finding(**{**values, **changes})


def standing(one: Finding, *, active: bool = True) -> Standing:
    return Standing(finding=one, active=active, age_s=9, last_s=0, residuals=(1.0, 0.5, 0.0))


def view(state: Any = "up", *findings: Standing, name: str = "udpin:0.0.0.0:14551") -> View:
    status = LinkStatus(
        link=name,
        state=state,
        messages=5000,
        rate_hz=100.0,
        bytes_per_s=5000.0,
        loss=0.01,
        garbage_bytes=0,
        quiet_s=0.0 if state == "up" else 7.0,
        record_bytes=None,
    )
    vehicle = Vehicle(sysid=1, compid=1, role="autopilot", autopilot="px4", type="QUADROTOR")
    quiet_s = status.quiet_s or 0.0
    sender = SenderStatus(
        sysid=1, compid=1, rate_hz=90.0, loss=0.0, latency_s=0.02, quiet_s=quiet_s
    )
    home = {"lat": 47.0, "lon": 8.0, "alt_msl": 488.0}
    return View(
        status=status,
        senders=((vehicle, sender),),
        places=(Place(system=1, what="home", source="HOME_POSITION", moves=0, **home),),
        streams=tuple(
            Terms(sender="1/1", message=f"STREAM_{n}", rate_hz=5.0, frames=("LOCAL_NED",))
            for n in range(40)
        ),
        findings=findings,
        judging=41,
        deviations=None,
    )


def shown(*views: View, size: tuple[int, int] = (80, 24), log: Any = ()) -> list[str]:
    return [line.plain for line in screen(views, log, NOW, *size)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("state", ["up", "waiting", "silent", "closed"])
@pytest.mark.parametrize("number", [0, 1, 30])
def test_fits(size: tuple[int, int], state: Any, number: int) -> None:
    """As many lines as the terminal has, none longer."""
    lines = shown(view(state, *[standing(finding())] * number), size=size)
    assert len(lines) == size[1]
    assert max(map(len, lines)) <= size[0]


def test_quiet() -> None:
    """When all is well it says so, how much was judged, and shows the streams."""
    lines = shown(view())
    assert "ALL WELL" in lines[0]
    assert any("41 rules had something to judge" in line for line in lines)
    assert any("STREAM_0" in line and "LOCAL_NED" in line for line in lines)
    assert any("more streams" in line for line in lines)


def test_warning() -> None:
    """A finding that goes on: in the first line, in words, with what to do and how it looks."""
    lines = shown(view("up", standing(finding())))
    assert "1 WARNING" in lines[0]
    text = "\n".join(lines)
    assert "warning MFC302 1/191 SET_POSITION_TARGET_GLOBAL_INT 6x, for 9 s" in text
    assert "do: Multiply by 1e7" in text
    assert "█▅▁" in text


def test_ended() -> None:
    """A finding that ended is a line, and raises no alarm."""
    lines = shown(view("up", standing(finding(), active=False)))
    assert "ALL WELL" in lines[0]
    assert not any("do: " in line for line in lines)


@pytest.mark.parametrize("state", ["silent", "closed"])
def test_lost(state: Any) -> None:
    """A lost link comes before every finding."""
    lines = shown(view(state, standing(finding(Severity.ERROR))))
    assert "LINK LOST 7 s" in lines[0]
    assert any("silent for 7 s" in line for line in lines)
    assert any("last heard 7 s ago, 5000 messages" in line for line in lines)


def test_more_than_fits() -> None:
    lines = shown(view("up", *[standing(finding())] * 30))
    assert any(line.startswith("and ") and line.endswith("more findings") for line in lines)


def test_contract() -> None:
    broken = Deviation(
        what="missing", sender="1/1", message="ODOMETRY", expected="30 Hz", observed="nothing"
    )
    seen = msgspec.structs.replace(view(), deviations=(broken,))
    lines = shown(seen)
    assert "NOT AS AGREED" in lines[0]
    assert any("1/1 ODOMETRY is missing (expected 30 Hz)" in line for line in lines)


@given(text=st.text(max_size=60))
def test_hostile(text: str) -> None:
    """Whatever came over the link, no control character and no markup reaches the terminal."""
    hostile = finding(text=text, fix=text, subject=text)
    event = Event(what="note", time=NOW, link=text, text=text)
    lines = shown(view("up", standing(hostile), name=text), log=[event])
    assert len(lines) == 24
    assert all(line.isprintable() for line in lines)


def test_bars() -> None:
    assert bars([0.0, 4.0, 8.0]) == "▁▅█"
    assert bars([0.0, 0.0]) == "▁▁"
    assert bars([float("nan"), 1.0]) == " █"
