"""An engine that finds what a test tells it to, so that the command line is tested alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from mavframecheck.report import Checked
from tests.report import made_up


class FakeEngine:
    """Answers by file name, and remembers what it was asked."""

    def __init__(self) -> None:
        self.answers: dict[str, Checked | BaseException] = {}
        self.settings: Any = None
        self.checked: list[str] = []
        rules = made_up.rules()
        self.pack = SimpleNamespace(rules=rules, by_code={rule.code: rule for rule in rules})

    def load_pack(self, _directories: Sequence[Path] = ()) -> Any:
        """Return the made-up rules."""
        return self.pack

    def check_file(
        self, path: str, _pack: Any, settings: Any, progress: Callable[[int], None] | None = None
    ) -> Checked:
        """Return or raise what the test has laid down for this name; otherwise a clean flight."""
        self.settings = settings
        self.checked.append(Path(path).name)
        if progress:
            progress(1)
        answer = self.answers.get(Path(path).name, made_up.clean())
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def draw_file(self, *asked: Any) -> tuple[Any, ...]:
        """Return the same, with nothing drawn."""
        answer = self.check_file(*asked)
        return answer.file, answer.findings, None


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> FakeEngine:
    """Put the fake engine in the place of the real one."""
    fake = FakeEngine()
    monkeypatch.setattr("mavframecheck.engine.load_pack", fake.load_pack)
    monkeypatch.setattr("mavframecheck.engine.check_file", fake.check_file)
    monkeypatch.setattr("mavframecheck.engine.draw_file", fake.draw_file)
    return fake


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with two recordings, which only the fake engine reads."""
    for name in ("a.tlog", "b.tlog"):
        (tmp_path / name).write_bytes(b"\0")
    monkeypatch.chdir(tmp_path)
    return tmp_path


Run = Callable[..., Result]


@pytest.fixture
def run() -> Run:
    """Return a function that runs the command in this process."""

    def invoke(*arguments: str) -> Result:
        return CliRunner().invoke(main, list(arguments), catch_exceptions=False)

    return invoke
