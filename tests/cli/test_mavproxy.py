"""MAVProxy, a real ground station without a screen: beside it, behind it, and inside it."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from samples.make import HERE
from tests.links import PATIENCE_S, free_port, peer, records, wait_for

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("MAVProxy") is None,
    reason="MAVProxy is not installed: pip install -e '.[mavproxy]'",
)
SAMPLE = HERE / "degrees_in_scaled_field.tlog"


@contextmanager
def mavproxy(folder: Path, master: str, *arguments: str) -> Iterator[Path]:
    """Run MAVProxy on a link; give the file that its console is written to."""
    said = folder / "console.txt"
    command = [sys.executable, "-m", "MAVProxy.mavproxy", f"--master={master}", "--non-interactive"]
    command += ["--default-modules=", f"--state-basedir={folder}", *arguments]
    with said.open("wb") as console:
        running = subprocess.Popen(command, stdout=console, stderr=console, cwd=folder)
        try:
            yield said
        finally:
            running.kill()
            running.wait()


def send_until(master: str, happened: object) -> None:
    """Send the sample over and over until something happened."""
    assert callable(happened)
    with peer(master) as vehicle:

        def sent() -> object:
            for _, data in records(SAMPLE.read_bytes()):
                vehicle.write(data)
            return happened()

        wait_for(sent)


def test_module(tmp_path: Path) -> None:
    """`module load mavframecheck` shows findings in the console of MAVProxy."""
    port = free_port()
    with mavproxy(tmp_path, f"udpin:127.0.0.1:{port}", "--cmd=module load mavframecheck") as said:
        send_until(f"udpout:127.0.0.1:{port}", lambda: "MFC302" in said.read_text())
        assert "Loaded module mavframecheck" in said.read_text()


def test_behind_it(tmp_path: Path) -> None:
    """MAVProxy forwards what it receives; `watch` listens where it sends."""
    port, ours = free_port(), free_port()
    record = tmp_path / "seen.tlog"
    command = [sys.executable, "-m", "mavframecheck", "watch", f"udpin:127.0.0.1:{ours}", "--plain"]
    command += ["--record", str(record), "--exit-on", "error"]
    out = f"--out=udpout:127.0.0.1:{ours}"
    with mavproxy(tmp_path, f"udpin:127.0.0.1:{port}", out):
        watch = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            send_until(f"udpout:127.0.0.1:{port}", lambda: watch.poll() is not None)
            text, _ = watch.communicate(timeout=PATIENCE_S)
        finally:
            watch.kill()
    assert watch.returncode == 1
    assert "error MFC302" in text
    assert record.stat().st_size
