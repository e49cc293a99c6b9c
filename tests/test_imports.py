"""A floor imports only those below it; `model`, which all share, only what lies below all who share it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import mavframecheck

PACKAGE = Path(mavframecheck.__file__).parent
FLOORS = (
    "cli",
    "report",
    "engine",
    "checks",
    "vehicle",
    "missions",
    "sources",
    "wire",
    "semantics",
    "geo",
)
"""From the roof down; `model` holds plain structs that all share."""
SHARED = "model"
GROUND = {"semantics", "geo"}
"""The lowest floors: data and arithmetic, which `model` may speak of and which know nothing of it."""
DOORS = {"__init__.py", "__main__.py", "positions.py", "py.typed"}
"""What stands beside the floors: how the house is entered."""
FILES = sorted(p for p in PACKAGE.rglob("*.py") if p.parent != PACKAGE)


def imported(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and floor of every import of the package in a file, also those inside functions."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{file}: relative imports hide where they lead"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            head, _, rest = name.partition(".")
            if head == PACKAGE.name and rest:
                yield node.lineno, rest.partition(".")[0]


def allowed(floor: str) -> set[str]:
    """Return what a floor may import."""
    if floor == SHARED:
        return {SHARED, *GROUND}
    below = {*FLOORS[FLOORS.index(floor) :], "__version__"}
    return below if floor in GROUND else below | {SHARED}


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_nothing_climbs(file: Path) -> None:
    floor = file.relative_to(PACKAGE).parts[0]
    climbing = [(line, to) for line, to in imported(file) if to not in allowed(floor)]
    assert climbing == []


def test_every_folder_is_a_floor() -> None:
    """A new one needs its place in the house."""
    folders = {p.name for p in PACKAGE.iterdir() if p.is_dir() and (p / "__init__.py").exists()}
    assert folders == {*FLOORS, SHARED}
    beside = {p.name for p in PACKAGE.iterdir() if p.is_file()}
    assert beside <= DOORS


def test_a_climb_would_be_seen(tmp_path: Path) -> None:
    """Wherever it hides."""
    file = tmp_path / "climbs.py"
    file.write_text(
        "def f():\n    from mavframecheck.cli import main\nimport mavframecheck.engine.check\n"
    )
    assert sorted(imported(file)) == [(2, "cli"), (3, "engine")]
