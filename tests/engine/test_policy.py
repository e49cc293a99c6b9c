"""What users have decided about findings, and what is said when a decision is of no use."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from mavframecheck.engine import SettingsError
from mavframecheck.engine.baseline import Baseline
from mavframecheck.engine.policy import Policy
from mavframecheck.model import FileReport, Finding, RuleRun, Severity
from mavframecheck.model.config import Config, Suppression
from tests.report import made_up

TODAY = date(2026, 5, 1)
RAN = tuple(RuleRun(code=code, status="ran") for code in ("MFC302", "MFC107"))
FILE = made_up.file(runs=RAN)


def judged(
    findings: tuple[Finding, ...], file: FileReport = FILE, folder: Path | None = None, **keys: Any
) -> tuple[list[str], list[str], list[str]]:
    """Return codes that count, reasons of those set aside, and remarks."""
    policy = Policy(Config(**keys), folder or Path.cwd(), today=TODAY)
    counting, aside = policy.apply(file, findings)
    return [x.code for x in counting], [x.reason for x in aside], list(policy.remarks())


BOTH = (made_up.finding(), made_up.mask())


@pytest.mark.parametrize(
    ("keys", "left"),
    [
        ({}, ["MFC302", "MFC107"]),
        ({"per_file_ignores": {"*.tlog": ("MFC3",)}}, ["MFC107"]),
        ({"per_file_ignores": {"*.raw": ("MFC3",)}}, ["MFC302", "MFC107"]),
        ({"per_sysid_ignores": {"1": ("MFC1",)}}, ["MFC302"]),
        ({"per_sysid_ignores": {"2": ("MFC1",)}}, ["MFC302", "MFC107"]),
        ({"per_stream_ignores": {"1/191": ("MFC",)}}, []),
        ({"per_stream_ignores": {"1/19": ("MFC",)}}, ["MFC302", "MFC107"]),
        (
            {"per_stream_ignores": {"*/191 SET_POSITION_TARGET_GLOBAL_INT.yaw": ("MFC",)}},
            ["MFC302"],
        ),
        ({"per_stream_ignores": {"1/191 SET_POSITION_TARGET_GLOBAL_INT": ("MFC",)}}, []),
        ({"per_stream_ignores": {"1/191 SET_POSITION": ("MFC",)}}, ["MFC302", "MFC107"]),
    ],
)
def test_ignores(keys: dict[str, Any], left: list[str]) -> None:
    """By path, by system, by stream or what it begins with."""
    assert judged(BOTH, **keys)[0] == left


def test_patterns_count_from_the_configuration_file(tmp_path: Path) -> None:
    """Wherever the command runs."""
    found = made_up.finding(file=str(tmp_path / "bench" / "a.tlog"))
    ignores = {"bench/*": ("MFC302",)}
    assert judged((found,), folder=tmp_path, per_file_ignores=ignores)[0] == []
    assert judged((found,), folder=tmp_path / "x", per_file_ignores=ignores)[0] == ["MFC302"]


def test_severities() -> None:
    """The longest prefix decides, and nothing else of the finding changes."""
    policy = Policy(Config(severity={"MFC": Severity.INFO, "MFC3": Severity.WARNING}), Path.cwd())
    (first, second), _ = policy.apply(FILE, BOTH)
    assert (first.severity, second.severity) == (Severity.WARNING, Severity.INFO)
    assert first.fingerprint == BOTH[0].fingerprint


def test_suppression_has_a_reason_that_is_kept() -> None:
    """What is set aside says why."""
    known = Suppression(rule="MFC302", stream="1/191", reason="mended in May", until=TODAY)
    assert judged(BOTH, suppressions=(known,)) == (["MFC107"], ["mended in May"], [])


def test_expired_suppression_suppresses_nothing() -> None:
    """And says so."""
    known = Suppression(rule="MFC302", reason="mended in May", until=date(2026, 4, 30))
    counting, aside, (remark,) = judged(BOTH, suppressions=(known,))
    assert (counting, aside) == (["MFC302", "MFC107"], [])
    assert remark == "suppression of MFC302 expired on 2026-04-30; it was: mended in May"


def test_unused_suppression_is_said_where_somebody_looked() -> None:
    """A rule that judged nothing may find it tomorrow."""
    unused = Suppression(rule="MFC107", stream="2/1", reason="old")
    idle = Suppression(rule="MFC999", reason="rare")
    _, _, remarks = judged(BOTH, suppressions=(unused, idle))
    assert remarks == [
        "suppression of MFC107 on 2/1 is not used: nothing to suppress was found; it was: old"
    ]


# ---- baseline ----


def learned(file: Path, *findings: Finding, report: FileReport = FILE) -> Path:
    """Write the baseline of a run with these findings."""
    baseline = Baseline.read(file, learning=True)
    policy = Policy(Config(), Path.cwd(), baseline)
    counting, _ = policy.apply(report, findings)
    assert counting == ()
    baseline.write(policy.judged)
    return file


def against(file: Path, *findings: Finding, report: FileReport = FILE) -> tuple[list[str], int]:
    """Return the codes that are new, and how many remarks there are."""
    policy = Policy(Config(), Path.cwd(), Baseline.read(file))
    counting, _ = policy.apply(report, findings)
    return [x.code for x in counting], len(list(policy.remarks()))


def test_a_new_recording_of_the_same_system_matches(tmp_path: Path) -> None:
    """Other bytes, times, counts, values and names; the same rule and stream."""
    known = learned(tmp_path / "known.json", *BOTH)
    again = made_up.finding(
        file="other/new.tlog", location=None, time_first=9.0, count=2, text="48 is wrong"
    )
    assert against(known, again, made_up.mask(file="other/new.tlog")) == ([], 0)


def test_what_is_new_or_worse_counts(tmp_path: Path) -> None:
    """Another stream, another rule, or a warning that became an error."""
    known = learned(tmp_path / "known.json", made_up.mask())
    worse = made_up.mask(severity=Severity.ERROR)
    milder = made_up.mask(severity=Severity.INFO)
    other = made_up.mask(subject="2/191 SET_POSITION_TARGET_GLOBAL_INT.yaw")
    assert against(known, worse, milder, other)[0] == ["MFC107", "MFC107"]


def test_stale_entries_are_said_and_removed(tmp_path: Path) -> None:
    """Only where the rule ran and its sender spoke."""
    known = learned(tmp_path / "known.json", *BOTH)
    assert against(known, made_up.mask()) == ([], 1)
    silent = made_up.file(runs=RAN, vehicles=())
    assert against(known, report=silent) == ([], 0)
    idle = made_up.file(runs=())
    assert against(known, report=idle) == ([], 0)
    learned(known, made_up.mask())
    assert [x["rule"] for x in json.loads(known.read_bytes())["entries"]] == ["MFC107"]


def test_missions_are_keyed_by_file_and_item(tmp_path: Path) -> None:
    """A mission is not made again by flying: the same mistake elsewhere in it is a new one."""
    item = made_up.mission_item()
    known = learned(tmp_path / "known.json", item)
    elsewhere = made_up.mission_item()
    elsewhere = Finding(
        **{x: getattr(item, x) for x in item.__struct_fields__} | {"file": "b.plan"}
    )
    assert against(known, item)[0] == []
    assert against(known, elsewhere)[0] == ["MFC204"]


def test_writing_again_keeps_reasons_and_order(tmp_path: Path) -> None:
    """One entry a line, sorted, so that a review sees what changed."""
    known = learned(tmp_path / "known.json", *BOTH)
    text = known.read_text()
    assert text.count("\n") == 4
    explained = text.replace('"severity":"error"', '"severity":"error","reason":"bench only"')
    known.write_text(explained)
    learned(known, *reversed(BOTH))
    assert known.read_text() == explained
    assert [x.name for x in tmp_path.iterdir()] == ["known.json"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "no such baseline; --update-baseline writes it"),
        (b"[]", "is no baseline"),
        (b"{", "is no baseline"),
        (b'{"version": 2}', "baseline of version 2, not 1"),
        (b'{"version": 1, "entries": [{"rule": "x"}]}', "is no baseline"),
    ],
)
def test_files_that_are_no_baseline(tmp_path: Path, content: bytes | None, words: str) -> None:
    """A mistake, not an empty one that lets everything through."""
    file = tmp_path / "known.json"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(SettingsError, match=words):
        Baseline.read(file)
