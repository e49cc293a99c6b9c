"""The wheel works alone: what is needed at run time is inside it."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that holds the content of a freshly built wheel and nothing of the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    subprocess.run([*build, str(ROOT)], check=True, capture_output=True)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        wheel.extractall(folder / "site")
    return folder / "site"


def python(installed: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python elsewhere, with the installed package ahead of the checkout on its path."""
    environment = os.environ | {"PYTHONPATH": str(installed)}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, env=environment, cwd=installed.parent, capture_output=True, text=True, check=False
    )


def test_wheel_holds_rules_data_and_types(installed: Path) -> None:
    """The rule pack, the data files and the marker for type checkers travel with the code."""
    package = installed / "mavframecheck"
    shipped = {path.name for path in (package / "rules").rglob("*.toml")}
    data = {p.relative_to(ROOT) for p in (ROOT / "mavframecheck").rglob("data/*") if p.is_file()}

    assert shipped == {path.name for path in (ROOT / "rules").rglob("*.toml")}
    assert shipped
    assert not {path for path in data if not (installed / path).is_file()}
    assert (package / "py.typed").is_file()


def test_wheel_checks_a_clean_and_a_faulty_sample(installed: Path) -> None:
    """`check` of the installed package ends as documented, and it is not the checkout that ran."""
    check = ("-m", "mavframecheck", "check")
    origin = python(installed, "-c", "import mavframecheck; print(mavframecheck.__file__)")
    clean = python(installed, *check, str(ROOT / "samples" / "clean_copter.tlog"))
    faulty = python(installed, *check, str(ROOT / "samples" / "bad_covariance.tlog"))

    assert Path(origin.stdout.strip()).is_relative_to(installed)
    assert clean.returncode == 0, clean.stdout + clean.stderr
    assert faulty.returncode == 1, faulty.stdout + faulty.stderr
    assert "MFC502" in faulty.stdout
