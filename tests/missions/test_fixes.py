"""What is certain is mended; every other byte stays."""

from __future__ import annotations

import gzip
import os
import stat
from pathlib import Path

import pytest

from mavframecheck.missions import fixes
from mavframecheck.missions.fixes import FRAME, LONGITUDE, Mended
from mavframecheck.sources import SourceError
from tests.missions.made import item, plan, written

BOTH = {FRAME, LONGITUDE}
WPL = (
    "QGC WPL 110\r\n"
    "0\t1\t0\t16\t0\t0\t0\t0\t-16.8\t179.9\t3\t1\r\n"
    "# kept  \r\n"
    "1\t0\t6\t16\t0\t0\t0\t0\t-16.80\t180.10000\t20.000\t1\r\n"
    "2 0  11 16 0 0 0 0 -16.8 -190.5 20 1\r\n"
    "3\t0\t3\t178\t0\t0\t0\t0\t0\t200\t0\t1\r\n"
)


def mended(file: Path, codes: set[str] = BOTH) -> Mended:
    found = fixes.mend(str(file), codes)
    assert found is not None
    return found


def test_only_what_is_certain_changes(tmp_path: Path) -> None:
    file = written(tmp_path, WPL, "m.waypoints")
    found = mended(file)
    expected = WPL.replace("\t6\t16", "\t3\t16").replace(" 11 16", " 10 16")
    expected = expected.replace("180.10000", "-179.90000").replace("-190.5", "169.5")

    assert found.after == expected
    assert found.edits == 4
    assert file.read_bytes() == WPL.encode()  # nothing is written yet
    assert mended(file, {FRAME}).after.count("180.10000") == 1
    assert mended(file, {LONGITUDE}).after.count("\t6\t16") == 1


def test_writing_keeps_every_other_byte_mode_and_links(tmp_path: Path) -> None:
    file = written(tmp_path, b"\xef\xbb\xbf" + WPL.encode(), "m.waypoints")
    file.chmod(0o640)
    link = tmp_path / "link"
    link.symlink_to(file)
    fixes.write(mended(link))

    assert link.is_symlink()
    assert file.read_bytes().startswith(b"\xef\xbb\xbfQGC WPL 110\r\n0\t1\t0\t16")
    assert file.read_bytes().count(b"\r\n") == WPL.count("\r\n")
    assert os.name == "nt" or stat.S_IMODE(file.stat().st_mode) == 0o640
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "m.waypoints"]
    assert mended(file).edits == 0


def test_a_plan_keeps_its_layout(tmp_path: Path) -> None:
    made = plan(item(frame=6, lat=-16.8, lon=185.25), item(frame=8), item(lat=185.0, lon=190.0))
    file = written(tmp_path, made)
    before = file.read_text("utf-8")
    after = mended(file).after

    assert after == before.replace('"frame": 6', '"frame": 3').replace("185.25", "-174.75")
    assert mended(file).diff().splitlines()[0] == f"--- {file}"


def test_a_failing_write_leaves_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = written(tmp_path, WPL, "m.waypoints")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="No space"):
        fixes.write(mended(file))
    assert file.read_bytes() == WPL.encode()
    assert [path.name for path in tmp_path.iterdir()] == ["m.waypoints"]


def test_what_is_not_mended(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="unpack it first"):
        fixes.mend(str(written(tmp_path, gzip.compress(WPL.encode()), "m.gz")), BOTH)
    with pytest.raises(SourceError, match="standard input"):
        fixes.mend("-", BOTH)
    assert fixes.mend(str(written(tmp_path, b"\0" * 99, "m.tlog")), BOTH) is None
