"""Several recordings at once: the same report, in the same order, and an end that comes at once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
COMMAND = [sys.executable, "-m", "mavframecheck", "check"]


def check(*arguments: str, folder: Path = ROOT) -> subprocess.CompletedProcess[bytes]:
    """Run `check` in a process of its own."""
    return subprocess.run([*COMMAND, *arguments], capture_output=True, check=False, cwd=folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of samples, one of them no recording and one with a name that is no UTF-8."""
    folder = tmp_path_factory.mktemp("logs")
    for number, sample in enumerate(sorted(SAMPLES.glob("*.tlog"))[:5]):
        (folder / f"{number}.tlog").write_bytes(sample.read_bytes())
    (folder / "3.ulg").write_bytes(b"ULog\x01\x12\x35" + bytes(50))
    odd = os.fsencode(folder) + b"/\xff\x1b[2J.tlog"
    try:
        Path(os.fsdecode(odd)).write_bytes((folder / "1.tlog").read_bytes())
    except OSError:
        (folder / "odd.tlog").write_bytes((folder / "1.tlog").read_bytes())
    return folder


def test_two_processes_say_what_one_says(folder: Path) -> None:
    """Byte for byte: findings, order, complaints and exit code."""
    names = sorted((path.name for path in folder.iterdir()), reverse=True)
    one = check(*names, "--format", "json", folder=folder)
    two = check(*names, "--format", "json", "--jobs", "2", folder=folder)
    assert (two.stdout, two.stderr, two.returncode) == (one.stdout, one.stderr, one.returncode)
    assert one.returncode == 2
    assert b"3.ulg" in one.stderr
    assert b"\x1b" not in one.stdout + one.stderr


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a process on Windows")
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_reports_what_is_done(jobs: str, tmp_path: Path) -> None:
    """No traceback of any process, what was finished in the report, exit code 130."""
    content = (SAMPLES / "degrees_in_scaled_field.tlog").read_bytes()
    (tmp_path / "0.tlog").write_bytes(content)
    for number in (1, 2):
        (tmp_path / f"{number}.tlog").write_bytes(content * 1000)
    with subprocess.Popen(
        [*COMMAND, str(tmp_path), "--jobs", jobs, "--format", "jsonl"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        cwd=ROOT,
    ) as process:
        assert process.stdout
        first = process.stdout.readline()
        assert process.stdout.readline().startswith(b'{"type":"file","path":"'), "the file is done"
        os.killpg(process.pid, signal.SIGINT)
        rest, complaints = process.communicate()
    assert first.startswith(b'{"type":"finding"')
    assert rest.count(b'{"type":"file"') < 2
    assert complaints == b"mavframecheck: interrupted: what follows is not all\n"
    assert process.returncode == 130
