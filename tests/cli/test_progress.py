"""The bar: only for a person, only when the work is long, and gone when it is done."""

from __future__ import annotations

import io
import sys
from collections.abc import Generator
from pathlib import Path

import pytest

from mavframecheck.cli import progress
from mavframecheck.cli.progress import Progress


class Terminal(io.StringIO):
    """A standard error that somebody watches."""

    def isatty(self) -> bool:
        """Return that somebody does."""
        return True


def watch(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Watch standard error (no fixture: pytest puts its own in place before each test)."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    return terminal


def test_no_bar_in_a_pipe() -> None:
    """The engine is not even asked to count."""
    with Progress(1).of("a.tlog") as advance:
        assert advance is None


def test_no_bar_for_short_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """What ends within a second shows nothing."""
    watched = watch(monkeypatch)
    with Progress(1).of("a.tlog") as advance:
        assert advance
        advance(10)
    assert watched.getvalue() == ""


def test_bar_names_the_file_and_disappears(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A hostile name cannot write to the terminal; the next file has its own bar."""
    watched = watch(monkeypatch)
    monkeypatch.setattr(progress, "PATIENCE_S", -1.0)
    path = tmp_path / "a[red]\x1b[2J.tlog"
    path.write_bytes(bytes(100))
    both = Progress(2)
    for number in ("1/2", "2/2"):
        with both.of(str(path)) as advance:
            assert advance
            advance(50)
        assert rf"{number} a[red]\x1b[2J.tlog" in watched.getvalue()
    assert "\x1b[2J" not in watched.getvalue()


def outcomes(paths: list[str]) -> Generator[tuple[str, int]]:
    """Yield a result for each path."""
    yield from ((path, number) for number, path in enumerate(paths))


def test_files_judged_at_once_share_a_bar(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It counts files and bytes; what is written between results goes where it should."""
    paths = [str(tmp_path / name) for name in ("a.tlog", "gone.tlog")]
    Path(paths[0]).write_bytes(bytes(100))
    assert [*Progress(2).together(outcomes(paths), paths)] == [*outcomes(paths)]
    assert capsys.readouterr().err == ""
    watched = watch(monkeypatch)
    for path, _ in Progress(2).together(outcomes(paths), paths):
        print(f"report on {path}")  # noqa: T201
    assert "1/2" in watched.getvalue()
    assert "100/100 bytes" in watched.getvalue()
    assert "report on" not in watched.getvalue()
    assert capsys.readouterr().out.count("report on") == 2
