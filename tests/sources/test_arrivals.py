"""A recording is judged when it is complete, once, and again when it has grown."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from mavframecheck.sources.arrivals import QUIET_S, Arrivals

FRAME = (Path(__file__).parents[2] / "samples" / "clean_copter.tlog").read_bytes()[:4000]
STEP = QUIET_S + 1.0


def record(file: Path, times: int, stamp: int) -> None:
    """Append to a recording and give it a time of change."""
    with file.open("ab") as out:
        out.write(FRAME * times)
    os.utime(file, (stamp, stamp))


def seen(arrivals: Arrivals, now: float) -> list[str]:
    """Return the names of what is complete."""
    return [path.name for path in arrivals.complete(now)]


def test_a_file_is_complete_when_it_stands_still(tmp_path: Path) -> None:
    """Growing files wait, old ones are left alone, and each state is given once."""
    record(tmp_path / "old.tlog", 3, 1)
    arrivals = Arrivals(tmp_path)
    record(tmp_path / "new.tlog", 3, 2)
    assert seen(arrivals, 0.0) == []
    assert seen(arrivals, STEP - 2) == []
    record(tmp_path / "new.tlog", 3, 3)
    assert seen(arrivals, STEP) == []
    assert seen(arrivals, 2 * STEP) == ["new.tlog"]
    assert seen(arrivals, 3 * STEP) == []
    record(tmp_path / "new.tlog", 3, 4)
    record(tmp_path / "old.tlog", 3, 4)
    assert seen(arrivals, 4 * STEP) == []
    assert seen(arrivals, 5 * STEP) == ["new.tlog", "old.tlog"]


def test_what_is_no_recording_is_left_out(tmp_path: Path) -> None:
    """Empty files, text, and files that vanish; folders below are looked into."""
    arrivals = Arrivals(tmp_path)
    (tmp_path / "below").mkdir()
    (tmp_path / "empty.tlog").touch()
    (tmp_path / "notes.txt").write_text("nothing to see")
    record(tmp_path / "gone.tlog", 3, 1)
    record(tmp_path / "below" / "a.tlog", 3, 1)
    assert seen(arrivals, 0.0) == []
    (tmp_path / "gone.tlog").unlink()
    assert seen(arrivals, STEP) == ["a.tlog"]


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_dangling_links_are_nothing(tmp_path: Path) -> None:
    """What cannot be looked at is no recording yet."""
    arrivals = Arrivals(tmp_path)
    (tmp_path / "link.tlog").symlink_to(tmp_path / "nowhere")
    assert seen(arrivals, 0.0) == seen(arrivals, STEP) == []
