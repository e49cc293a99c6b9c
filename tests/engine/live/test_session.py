"""A link judged while it runs finds what `check` finds of the same records, and says it when it is there."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack, Settings
from mavframecheck.engine.examples import recording
from mavframecheck.engine.live.session import Session
from mavframecheck.model import Finding, Rule
from mavframecheck.model.live import Change
from mavframecheck.wire.encode import stamped
from samples.make import HERE
from tests.engine.judged import Result, judge, pack_of, rule, shipped
from tests.links import frame_size
from tests.strategies import CUTS, DIALECT, START_US, cut, frame

SAMPLES = sorted(HERE.glob("*.tlog"))[::6]
"""Some: `test_cuts` takes all, and every check is asked below."""
CORPUS = Path(__file__).parents[4] / "shared" / "corpus" / "sitl"
RECORDINGS = ("fault_px4_vision_enu", "clean_two_copters")
few = settings(max_examples=2, suppress_health_check=[HealthCheck.too_slow], deadline=None)


def live(pieces: Iterable[bytes], pack: Pack | None = None) -> tuple[Result, list[Change]]:
    """Judge records that come in pieces; asking takes no time here, so all checks are asked after each."""
    chosen = Settings(preview=True)
    session = Session("link", "made up", pack or shipped(), chosen, DIALECT, timer=lambda: 0.0)
    changes = []
    for piece in pieces:
        session.take(piece)
        session.ask()
        changes += session.changes()
    result = session.finish()
    return result, changes + session.changes()


def standing(changes: list[Change]) -> list[tuple[str, str]]:
    """Return code and subject of the findings that were said and not taken back."""
    said: list[tuple[str, str]] = []
    for change in changes:
        key = (change.finding.code, change.finding.subject)
        if change.what == "found":
            said.append(key)
        elif change.what == "withdrawn":
            said.remove(key)
    return sorted(said)


def keys(findings: Iterable[Finding]) -> list[tuple[str, str]]:
    return sorted((each.code, each.subject) for each in findings)


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.name)
@few
@given(cuts=st.lists(st.integers(0, 100_000), min_size=1, max_size=6))
def test_samples(sample: Path, cuts: list[int]) -> None:
    """Cut and asked anywhere: the report is that of `check`, and all of it was said."""
    data = sample.read_bytes()
    result, changes = live(cut(data, cuts))
    assert result == judge(data)
    assert standing(changes) == keys(result[1])


CHECKED = [each for each in shipped().rules if each.detect.check]


@pytest.mark.parametrize("one", CHECKED, ids=lambda one: one.code)
@few
@given(cuts=CUTS, order=st.randoms(use_true_random=False))
def test_asking_changes_nothing(one: Rule, cuts: list[int], order: Any) -> None:
    """A Python check that was asked on the way ends as one that was not."""
    examples = [recording(example, DIALECT) for example in one.example] * 2
    order.shuffle(examples)
    data = b"".join(examples)
    pack = pack_of(one)
    result, changes = live(cut(data, cuts), pack)
    assert result == judge(data, pack=pack)
    assert standing(changes) == keys(result[1])


@pytest.mark.skipif(not CORPUS.is_dir(), reason="no recordings in ../shared/corpus")
@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings(name: str) -> None:
    """By batches of some seconds of its own stamps, a flight gives exactly the findings of `check`."""
    data = (CORPUS / f"{name}.tlog").read_bytes()
    result, changes = live(by_time(data, 4_000_000))
    assert result == judge(data)
    assert standing(changes) == keys(result[1])


def by_time(data: bytes, span_us: int) -> list[bytes]:
    """Cut a tlog of MAVLink 2 and 1 frames where `span_us` of its stamps are over."""
    cuts, at, since = [0], 0, -1
    while at + 8 < len(data):
        t_us = int.from_bytes(data[at : at + 8], "big")
        since = t_us if since < 0 else since
        if t_us - since >= span_us:
            cuts.append(at)
            since = t_us
        at += 8 + frame_size(data[at + 8 : at + 11])
    return [data[a:b] for a, b in pairwise([*cuts, len(data)])]


def attitude(roll: float, t_s: float, number: int) -> bytes:
    return stamped(frame("ATTITUDE", {"roll": roll}, seq=number), START_US + round(t_s * 1e6))


def said(rolls: Iterable[tuple[float, float]], **changes: Any) -> list[list[str]]:
    """Return what is said after each message: pairs of roll and time, judged by the made-up rule."""
    pack = pack_of(rule(**changes))
    session = Session("link", "f", pack, Settings(), DIALECT)
    heard = []
    for number, (roll, t_s) in enumerate(rolls):
        session.take(attitude(roll, t_s, number))
        heard.append([str(each.what) for each in session.changes()])
    return heard


def test_found_at_once() -> None:
    """A mistake is said after the message that makes it, and not again while it goes on."""
    assert said([(0, 0), (2, 1), (2, 2), (2, 3)]) == [[], ["found"], [], []]


def test_found_when_it_lasts() -> None:
    """What must come three times is said with the third."""
    detect = {"persist": {"count": 3}}
    assert said([(2, 0), (2, 1), (2, 2), (2, 3)], detect=detect) == [[], [], ["found"], []]


def test_goes_on() -> None:
    """After five seconds it is said that there is more."""
    assert said([(2, 0), (2, 3), (2, 5)]) == [["found"], [], ["updated"]]


def test_ends_and_resumes() -> None:
    """Ten seconds without a hit end it; another one soon after is the same finding."""
    heard = said([(2, 0), (0, 9), (0, 11), (0, 12)])
    assert heard == [["found"], [], ["ended"], []]


def test_withdrawn() -> None:
    """A share that was reached and is not any more: the finding is taken back."""
    detect = {"persist": {"count": 1, "share": 0.5}}
    rolls = [(2, 0.0), (0, 0.1), (0, 0.2), (0, 0.3), (2, 0.4), (0, 0.5)]
    heard = said(rolls, detect=detect)
    assert heard == [["found"], [], [], [], ["withdrawn"], []]


def test_idle() -> None:
    """Nothing that came changes nothing."""
    session = Session("link", "f", pack_of(rule()), Settings(), DIALECT)
    assert not len(session.take(b""))
    assert session.changes() == []
    report, findings = session.finish()
    assert (report.messages, findings) == (0, ())
