"""The command as a process: start-up, closed pipes, plain streams, its own mistakes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = {"rich", "jinja2", "dpkt", "pymavlink", "jsonschema", "multiprocessing", "xml"}
ROOT = Path(__file__).parents[2]

_LIST_MODULES = """
import sys
from mavframecheck.cli import main
try:
    main({arguments!r}, prog_name="mavframecheck")
except SystemExit:
    pass
import json
print(json.dumps(sorted({{name.partition(".")[0] for name in sys.modules}})), file=sys.stderr)
"""


def python(*arguments: str) -> subprocess.CompletedProcess[bytes]:
    """Run this Python on `arguments`."""
    return subprocess.run([sys.executable, *arguments], capture_output=True, check=False, cwd=ROOT)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a raw recording of heartbeats with a broken one in between."""
    from pymavlink.dialects.v20 import ardupilotmega

    link = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    frames = []
    for _ in range(50):
        frames.append(link.heartbeat_encode(2, 3, 81, 0, 4).pack(link))
        link.seq = (link.seq + 1) % 256
    path = tmp_path_factory.mktemp("recording") / "heartbeats.raw"
    path.write_bytes(b"".join(frames))
    return path


@pytest.mark.parametrize("arguments", [["check", "--help"], ["check"], ["rules"], ["RECORDING"]])
def test_light_start(arguments: list[str], recording: Path) -> None:
    """What only some runs use is imported only in those."""
    given = ["check", str(recording)] if arguments == ["RECORDING"] else arguments
    result = python("-c", _LIST_MODULES.format(arguments=given))
    assert not HEAVY & set(json.loads(result.stderr.splitlines()[-1]))


def test_help_needs_no_numpy() -> None:
    """Help is read often and should come at once."""
    result = python("-c", _LIST_MODULES.format(arguments=["check", "--help"]))
    assert "numpy" not in json.loads(result.stderr.splitlines()[-1])


def test_closed_pipe_is_quiet(recording: Path) -> None:
    """`check ... | head` ends without a traceback."""
    command = [sys.executable, "-m", "mavframecheck", "check", str(recording), "--format", "jsonl"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT
    ) as process:
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141


def test_closed_pipe_leaves_the_other_reports_whole(recording: Path, tmp_path: Path) -> None:
    """Whoever stopped reading standard output did not ask for half a file."""
    wanted = tmp_path / "report.json"
    command = [sys.executable, "-m", "mavframecheck", "check", str(recording)]
    with subprocess.Popen(
        [*command, "--output", f"json={wanted}"], stdout=subprocess.PIPE, cwd=ROOT
    ) as process:
        assert process.stdout
        process.stdout.close()
    assert process.returncode == 141
    assert len(json.loads(wanted.read_bytes())["files"]) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
def test_full_disk_is_said(recording: Path) -> None:
    """A report that cannot be written is no clean run."""
    with Path("/dev/full").open("wb") as full:
        result = subprocess.run(
            [sys.executable, "-m", "mavframecheck", "check", str(recording)],
            stdout=full,
            stderr=subprocess.PIPE,
            check=False,
            cwd=ROOT,
        )
    assert result.returncode == 2
    assert result.stderr.startswith(b"mavframecheck: cannot write the report")
    assert b"Traceback" not in result.stderr


def test_stream_that_lacks_characters(recording: Path, tmp_path: Path) -> None:
    """A console without Unicode gets escapes, not a traceback."""
    copy = tmp_path / "\u6771\u4eac.raw"
    copy.write_bytes(recording.read_bytes())
    result = subprocess.run(
        [sys.executable, "-m", "mavframecheck", "check", str(copy)],
        env=os.environ | {"PYTHONIOENCODING": "cp1252"},
        capture_output=True,
        check=False,
        cwd=ROOT,
    )
    assert rb"\u6771\u4eac.raw" in result.stdout
    assert b"Traceback" not in result.stderr


def test_internal_error_is_not_taken_for_findings() -> None:
    """Python leaves with 1 after a traceback, which is the code for findings: ours leaves with 2."""
    broken = (
        "import sys; sys.argv = ['mavframecheck', 'rules']\n"
        "import mavframecheck.cli as c\n"
        "import mavframecheck.engine as e; e.load_pack = lambda d: 1 / 0\n"
        "c.main(prog_name='mavframecheck')"
    )
    result = python("-c", broken)
    assert b"ZeroDivisionError" in result.stderr
    assert result.returncode == 2
