"""Memory that a batch freed is there for the next one."""

from __future__ import annotations

import ctypes
import subprocess
import sys

import pytest

from mavframecheck.engine.memory import keep_freed_memory

PAGES_TOUCHED_ANEW = """
import resource, sys
import numpy as np
from mavframecheck.engine.memory import keep_freed_memory

if sys.argv[1] == "kept":
    keep_freed_memory()

def batch():
    return [np.ones(1 << 18) for _ in range(20)]

batch()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(10):
    batch()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "mallopt"),
    reason="the C library has no mallopt",
)
def test_pages_are_touched_once() -> None:
    def touched(how: str) -> int:
        command = [sys.executable, "-c", PAGES_TOUCHED_ANEW, how]
        return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    assert touched("kept") < touched("given back") / 10


def test_elsewhere_nothing_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The call by which another system would be asked is not even looked for."""
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delattr(ctypes, "CDLL")
    keep_freed_memory()
