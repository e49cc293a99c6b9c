"""Contracts: written from a recording, read again, and compared."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from mavframecheck.engine import Settings
from mavframecheck.engine.contract import deviations, read_contract, terms, worth_keeping
from mavframecheck.engine.survey import survey_file
from mavframecheck.model.contract import Contract, Terms
from mavframecheck.report.contract import toml
from mavframecheck.sources import SourceError
from samples.make import HERE

AGREED = Terms(
    sender="1/1",
    message="ODOMETRY",
    rate_hz=30.0,
    frames=("LOCAL_NED",),
    heights=("origin",),
    clocks=("time_usec: boot",),
)


def compared(seen: Terms | None, wanted: Terms = AGREED) -> list[tuple[str, str, str]]:
    """Return how one stream differs."""
    found = [] if seen is None else [seen]
    differ = deviations(Contract(contract=1, stream=(wanted,)), found)
    return [(each.what, each.expected, each.observed) for each in differ]


def test_written_and_read(tmp_path: Path) -> None:
    """A recording keeps the contract that was made from it, after a way through TOML."""
    seen = terms(survey_file(str(HERE / "clean_copter.tlog"), Settings()).senders)
    path = tmp_path / "contract.toml"
    path.write_text("".join(toml(worth_keeping(seen), 'a "quoted"\nname')), "utf-8")
    contract = read_contract(path)
    assert [each.key for each in contract.stream] == [each.key for each in worth_keeping(seen)]
    assert "HEARTBEAT" in {each.message for each in contract.stream}
    assert list(deviations(contract, seen)) == []


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, []),
        ({"rate_hz": 16.0}, []),
        ({"rate_hz": 14.0}, [("rate", "30 Hz", "14 Hz")]),
        ({"rate_hz": None}, []),
        ({"frames": ("LOCAL_FRD",)}, [("frames", "LOCAL_NED", "LOCAL_FRD")]),
        ({"heights": ()}, [("heights", "origin", "none")]),
        (
            {"clocks": ("time_usec: unix",)},
            [("clocks", "time_usec: boot", "time_usec: unix")],
        ),
        ({"sender": "2/1"}, [("missing", "30 Hz", "nothing"), ("unexpected", "nothing", "30 Hz")]),
    ],
)
def test_differences(changes: dict[str, Any], expected: list[tuple[str, str, str]]) -> None:
    assert compared(msgspec.structs.replace(AGREED, **changes)) == expected


def test_missing() -> None:
    assert compared(None) == [("missing", "30 Hz", "nothing")]


def test_what_is_left_out_is_not_compared() -> None:
    assert compared(AGREED, Terms(sender="1/1", message="ODOMETRY")) == []


@pytest.mark.parametrize(
    "content",
    ["contract = 2", "not toml", "contract = 1\n[[stream]]\nsender = 1", "contract = 1\nx = 1", ""],
)
def test_no_contract(tmp_path: Path, content: str) -> None:
    path = tmp_path / "contract.toml"
    path.write_text(content)
    with pytest.raises(SourceError, match="is no contract"):
        read_contract(path)
    with pytest.raises(SourceError, match="cannot be read"):
        read_contract(tmp_path / "nothing.toml")
