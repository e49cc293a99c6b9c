"""The clock bench: each kind of mistake is told apart, and clean recordings stay quiet."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Pack
from mavframecheck.engine.pack import read_rule
from mavframecheck.model import Severity
from tests.engine.judged import judge
from tests.vehicle.clock_bench import CLEAN, FAULTY

RULES = Path(__file__).parents[2] / "rules"
FILES = [*sorted((RULES / "time").glob("*.toml")), *(RULES / "stream").glob("MFC006*.toml")]
PACK = Pack(
    tuple(read_rule(file)[0] for file in FILES), {read_rule(f)[0].code: f.name for f in FILES}
)


def codes(data: bytes) -> set[str]:
    """Return the codes of the errors and warnings in a recording."""
    return {f.code for f in judge(data, pack=PACK)[1] if f.severity != Severity.INFO}


@pytest.mark.parametrize("name", CLEAN)
def test_clean_recordings_are_quiet(name: str) -> None:
    assert codes(CLEAN[name]) == set()


@pytest.mark.parametrize("name", FAULTY)
def test_each_mistake_is_told_apart(name: str) -> None:
    """The code for it, and no other one: what follows from it is no second mistake."""
    code, data = FAULTY[name]
    assert codes(data) == {code}


def test_a_restart_is_information() -> None:
    found = [f.code for f in judge(CLEAN["restart"], pack=PACK)[1]]
    assert found == ["MFC808"]


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    name=st.sampled_from([*CLEAN, *FAULTY]),
    cuts=st.lists(st.integers(0, 100_000), min_size=1, max_size=6),
)
def test_findings_do_not_depend_on_batches(name: str, cuts: list[int]) -> None:
    data = CLEAN[name] if name in CLEAN else FAULTY[name][1]
    assert judge(data, cuts, PACK) == judge(data, pack=PACK)
