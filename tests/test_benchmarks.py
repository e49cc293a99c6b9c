"""The tools that judge the software are judged themselves: a lenient judge finds nothing wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.accuracy import judge
from benchmarks.bench import SAMPLE, records, write_repeated, write_start
from benchmarks.corpus import Checked, Finding
from benchmarks.corpus_diff import Line, load, save, show_difference


def finding(code: str, severity: str = "error") -> Finding:
    """Return as much of a finding as the tools read."""
    return {"code": code, "severity": severity}


FAULTY: dict[str, Any] = {"kind": "faulty", "expect": ["MFC401", "MFC406"]}
CLEAN: dict[str, Any] = {"kind": "clean", "allow": ["MFC003"]}


@pytest.mark.parametrize(
    ("label", "findings", "word", "beside"),
    [
        (FAULTY, [finding("MFC406", "info")], "found", ()),
        (FAULTY, [finding("MFC401"), finding("MFC302")], "found", ("MFC302",)),
        (FAULTY, [finding("MFC302")], "missed", ("MFC302",)),
        (FAULTY | {"expect": ["MFC999"]}, [], "not built yet", ()),
        (CLEAN, [finding("MFC003", "warning"), finding("MFC111", "info")], "quiet", ()),
        (CLEAN, [finding("MFC401", "warning")], "false alarm", ()),
        (CLEAN | {"kind": "undecidable"}, [finding("MFC401")], "false alarm", ()),
    ],
)
def test_a_recording_is_judged_by_its_label(
    label: dict[str, Any], findings: list[Finding], word: str, beside: tuple[str, ...]
) -> None:
    """Any expected code of any severity is a hit; loud others are alarms, or stand beside a hit."""
    verdict = judge(Checked(Path("a.tlog"), findings), label, {"MFC401", "MFC302"})

    assert (verdict.word, verdict.beside) == (word, beside)


def test_a_check_that_fails_is_no_quiet_recording() -> None:
    """A crash finds nothing: it must not pass for silence."""
    verdict = judge(Checked(Path("a.tlog"), [], "exit 2: no memory"), CLEAN, set())

    assert (verdict.word, verdict.remark) == ("failed", "exit 2: no memory")


def test_corpus_diff_shows_what_came_and_what_went(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A baseline reads back as saved, and only differences are shown."""
    kept, gone, new = (Line(f"{n}.tlog", "MFC302", "error", "1/191", 1, n) for n in "abc")
    save([kept, gone], tmp_path / "new" / "baseline.jsonl")
    capsys.readouterr()

    show_difference(load(tmp_path / "new" / "baseline.jsonl"), [kept, new])

    assert capsys.readouterr().out.splitlines() == [
        f"- {gone}",
        f"+ {new}",
        "MFC302: 1 added, 1 removed",
        "2 findings before, 2 after, 2 differences",
    ]


def test_a_repeated_log_holds_every_record_again_later(tmp_path: Path) -> None:
    """Copies follow each other in time, nothing but stamps differs, and the start is cut cleanly."""
    content, starts = records(SAMPLE)
    write_repeated(SAMPLE, tmp_path / "long.tlog", 3 * len(content))
    write_start(SAMPLE, tmp_path / "start.tlog", 5000)
    long, repeated = records(tmp_path / "long.tlog")
    stamps = np.array([int.from_bytes(long[at : at + 8], "big") for at in repeated])

    assert len(repeated) == 3 * len(starts)
    assert np.all(np.diff(stamps.astype(np.int64)) >= 0)
    assert long[len(content) + 8 : len(content) + 30] == content[8:30]
    assert 4700 < (tmp_path / "start.tlog").stat().st_size <= 5000
