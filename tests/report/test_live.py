"""What `watch` writes as it happens, for people and for programs."""

from __future__ import annotations

import json
from typing import Any

import pytest

from mavframecheck.model.contract import Deviation
from mavframecheck.model.live import Change, Event
from mavframecheck.report import Context
from mavframecheck.report.contract import contract_lines
from mavframecheck.report.layout import Page
from mavframecheck.report.live import clock, json_line, plain_lines
from tests.report.test_screen import NOW, finding

PAGE = Page(Context("0"))


def change(what: Any, **changes: Any) -> Change:
    return Change(what=what, time=NOW, link="udpin:0.0.0.0:1", finding=finding(**changes))


def test_found() -> None:
    """Time, how bad, which rule and stream, what is wrong, what to do."""
    lines = list(plain_lines(change("found", text="It is wrong."), PAGE, links=False))
    text = " ".join(" ".join(lines).split())
    assert text == (
        "08:00:00 warning MFC302 1/191 SET_POSITION_TARGET_GLOBAL_INT: It is wrong. "
        "fix: Multiply by 1e7 and round."
    )
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize("what", ["ended", "resumed", "withdrawn"])
def test_short(what: str) -> None:
    (line,) = plain_lines(change(what, subject="1/1 X"), PAGE, links=True)
    assert line == f"08:00:00 udpin:0.0.0.0:1 {what} MFC302 1/1 X: 6 times so far"


def test_goes_on() -> None:
    """That a finding goes on is not worth a line."""
    assert list(plain_lines(change("updated"), PAGE, links=False)) == []


def test_hostile() -> None:
    """What came over the link cannot move the cursor."""
    event = Event(what="note", time=NOW, link="\x1b[2J", text="a\x1b[31mb\nc")
    lines = list(plain_lines(event, PAGE, links=True))
    assert all(line.isprintable() for line in lines)


def test_json() -> None:
    said = json.loads(json_line(change("found", evidence={"left": float("nan")})))
    assert (said["type"], said["what"], said["finding"]["code"]) == ("change", "found", "MFC302")
    assert said["finding"]["evidence"] == {"left": "NaN"}
    event = Event(what="reboot", time=NOW, link="l", text="t", sysid=3)
    assert json.loads(json_line(event)) == {
        "type": "event",
        "what": "reboot",
        "time": NOW,
        "link": "l",
        "text": "t",
        "sysid": 3,
    }


def test_impossible_time() -> None:
    assert clock(1e18) == "--:--:--"


def test_contract() -> None:
    differ = Deviation(
        what="frames", sender="1/1", message="ODOMETRY", expected="LOCAL_NED", observed="LOCAL_FRD"
    )
    lines = list(contract_lines([differ], PAGE))
    assert "1 difference from the contract" in lines
    assert "  1/1 ODOMETRY: frames expected LOCAL_NED, found LOCAL_FRD" in lines
    assert "as agreed" in " ".join(contract_lines([], PAGE))
