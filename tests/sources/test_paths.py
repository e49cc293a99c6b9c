"""From arguments to recordings."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import pytest

from mavframecheck.sources import STDIN, SourceError, expand
from tests.sources.made import frames, pcap_file, tlog


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make a directory of recordings under misleading names, missions and other files."""
    (tmp_path / "b" / "deep").mkdir(parents=True)
    (tmp_path / "b" / "deep" / "notes.txt").write_bytes(tlog(frames(9)))
    (tmp_path / "b" / "capture").write_bytes(pcap_file([]))
    (tmp_path / "a.bin").write_bytes(b"".join(frames(9)))
    (tmp_path / "packed").write_bytes(gzip.compress(tlog(frames(9))))
    (tmp_path / "late.tlog").write_bytes(bytes(600_000) + tlog(frames(9)))
    (tmp_path / "words.tlog").write_text("not a recording")
    (tmp_path / "empty.tlog").touch()
    (tmp_path / "mission.txt").write_text("QGC WPL 110\n")
    (tmp_path / "mission.plan").write_text('{"fileType": "Plan"}')
    return tmp_path


def names(folder: Path, *paths: str) -> list[str]:
    return [Path(path).relative_to(folder).as_posix() for path in expand(paths).recordings]


def test_a_directory_is_searched_by_content_in_a_fixed_order(folder: Path) -> None:
    found = expand([str(folder)])
    assert names(folder, str(folder)) == [
        "a.bin",
        "late.tlog",
        "packed",
        "b/capture",
        "b/deep/notes.txt",
    ]
    assert [path.name for path in found.missions] == ["mission.plan", "mission.txt"]


def test_a_directory_without_recordings(tmp_path: Path) -> None:
    (tmp_path / "readme").write_text("nothing here")
    assert expand([str(tmp_path)]) == ([], [])


def test_named_files_are_taken_as_they_are(folder: Path) -> None:
    assert names(folder, str(folder / "words.tlog")) == ["words.tlog"]
    assert expand([STDIN, STDIN]).recordings == [STDIN]


def test_each_file_once(folder: Path) -> None:
    assert names(folder, str(folder / "packed"), str(folder / "p*"), str(folder / "packed")) == [
        "packed"
    ]


def test_patterns(folder: Path) -> None:
    assert names(folder, str(folder / "[ab].b*")) == ["a.bin"]
    assert names(folder, str(folder / "**" / "notes.*")) == ["b/deep/notes.txt"]
    assert names(folder, str(folder / "?")) == ["b/capture", "b/deep/notes.txt"]


def test_a_name_with_brackets_is_first_a_name(folder: Path) -> None:
    (folder / "log[1].tlog").touch()
    assert names(folder, str(folder / "log[1].tlog")) == ["log[1].tlog"]


@pytest.mark.parametrize("text", ["missing.tlog", "missing*.tlog", ""])
def test_nothing_behind_a_path(tmp_path: Path, text: str) -> None:
    with pytest.raises(SourceError, match="check"):
        expand([str(tmp_path / "no" / text)])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_pipes_and_links_in_a_directory_do_not_hang_it(folder: Path) -> None:
    os.mkfifo(folder / "pipe")
    (folder / "b" / "loop").symlink_to(folder, target_is_directory=True)
    assert len(expand([str(folder)]).recordings) == 5
