"""The bench on motion: it distorts what it says, knows the answers, and counts honestly."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from benchmarks.injection import motion
from benchmarks.injection.distortions import Case, cases
from benchmarks.injection.excitation import excitation
from benchmarks.injection.log import Log
from benchmarks.injection.motion import Motions, Outcome, _Piece
from benchmarks.injection.motion_table import show_motion
from benchmarks.injection.plan import Distortion, read_plan
from mavframecheck.wire import load_dialect

SAMPLES = Path(__file__).parents[2] / "samples"
VISION = "VISION_POSITION_ESTIMATE"
AXES = Distortion(
    name="axes", message=(VISION,), permute=("x", "y", "z"), needs=("across", "climb")
)


@pytest.fixture(scope="module")
def log() -> Log:
    return Log((SAMPLES / "clean_vision.tlog").read_bytes(), load_dialect())


def test_all_wrong_permutations_and_no_other() -> None:
    """47 for a label that means north, 44 where turns are legal; 43, 3 and 1 of them by code."""
    wrong = list(cases(AXES))
    codes = Counter(case.codes for case in wrong)
    assert len({case.name for case in wrong}) == 47
    assert codes == {("MFC401",): 43, ("MFC403",): 3, ("MFC402",): 1}
    free = list(
        cases(
            Distortion(name="free", message=(VISION,), permute=("x", "y", "z"), free_heading=True)
        )
    )
    assert len(free) == 44
    assert Counter(case.codes for case in free) == {("MFC401",): 40, ("MFC402",): 4}


def enu() -> Case:
    return next(case for case in cases(AXES) if case.set == {"x": "y", "y": "x", "z": "-z"})


def test_the_answer_to_a_known_one() -> None:
    """East, north, up, by hand."""
    assert enu().codes == ("MFC401",)
    assert re.search(enu().says, "x holds East, y holds North, z is up: this is ENU")
    assert not re.search(enu().says, "x holds West, y holds North, z is up")


def test_only_the_stream_is_distorted(log: Log) -> None:
    """The other messages keep every byte; the fields are exchanged, the rest of the message is not."""
    (mine,) = motion._streams(log, VISION)
    after = Log(motion._distorted(log, mine, enu()), log.dialect)
    old, new = log.tables[VISION], after.tables[VISION]
    assert np.array_equal(new["x"], old["y"])
    assert np.array_equal(new["z"], -old["z"])
    assert np.array_equal(new["yaw"], old["yaw"])
    for name in set(log.tables) - {VISION}:
        assert after.tables[name].columns.tobytes() == log.tables[name].columns.tobytes()


def fared(log: Log, case: Case) -> list[str]:
    """Return the words of the outcomes of a case, as if there were motion enough."""
    (mine,) = motion._streams(log, VISION)
    enough = excitation(log, mine)._replace(across=True, climb=True)
    piece = _Piece(log, "sample", "whole", [])
    return [outcome.word for outcome in motion._fared(piece, mine, case, enough)]


def test_a_distortion_is_found_and_a_legal_one_leaves_silence(log: Log) -> None:
    """The words of the outcomes, on the sample."""
    legal = next(cases(Distortion(name="no change", message=(VISION,), set={"x": "x"})))
    assert fared(log, enu()) == ["found"]
    assert fared(log, legal) == ["silent"]
    assert fared(log, legal._replace(codes=("MFC401",))) == ["missed"]


def test_another_answer_is_none(log: Log) -> None:
    """The right code with the wrong words is not found, and another code is an alarm."""
    assert fared(log, enu()._replace(says="x holds West")) == ["words"]
    assert fared(log, enu()._replace(codes=("MFC404",))) == ["missed", "alarm"]


def test_a_vehicle_that_stands_has_no_excitation(log: Log) -> None:
    """Before take-off there is nothing to tell by."""
    ground = motion._cut(log, "ground")
    assert ground is None or not motion._streams(ground, VISION)
    (mine,) = motion._streams(log, VISION)
    flown = excitation(log, mine)
    assert flown.has((), 0.0)
    assert not excitation(log, mine.take(np.arange(20))).has(("across",), 0.0)


def outcome(word: str) -> Outcome:
    return Outcome("axes", "axes: x, y, -z", "sample", word)


@pytest.mark.parametrize(
    ("words", "alarms", "good"),
    [
        (["found", "thin", "early", "silent"], [], True),
        (["found"] * 99 + ["missed"], [], True),
        (["found"] * 98 + ["words"] * 2, [], False),
        (["found", "passed"], [], False),
        (["found", "alarm"], [], False),
        (["found"], ["sample: error MFC401"], False),
        (["missed"], [], False),
    ],
)
def test_what_fails_the_bench(words: list[str], alarms: list[str], *, good: bool) -> None:
    """A short recall, a pass without motion, another code, an alarm on an original."""
    found = Motions([outcome(word) for word in words], alarms, 1)
    assert show_motion([AXES], found, everything=False) is good


def test_the_split_is_a_rule() -> None:
    """About half of any names, the same in every run, and never both."""
    names = [f"recording {k}" for k in range(400)]
    reported = [name for name in names if motion.is_reported(name)]
    assert 150 < len(reported) < 250
    assert [name for name in names if motion.is_reported(name)] == reported


def test_every_field_that_is_set_exists() -> None:
    """No distortion of the plan writes into nothing."""
    layouts = load_dialect().by_name
    for distortion in read_plan().motion.distortion:
        fields = {*distortion.set, *(distortion.permute or ())}
        for message in distortion.message:
            assert fields <= set(layouts[message].by_name), (distortion.name, message)
