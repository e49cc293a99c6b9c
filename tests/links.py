"""Real peers on loopback: pymavlink sends, a link receives, and nothing waits for a fixed time."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from pymavlink import mavutil

PATIENCE_S = 30.0
"""What does not happen within this time (s) does not happen."""


def wait_for(happened: Callable[[], object]) -> None:
    """Return once something happened."""
    give_up = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < give_up, "it did not happen"
        time.sleep(0.00005)


def free_port(kind: int = socket.SOCK_DGRAM) -> int:
    """Return a port of this computer that nobody uses."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def peer(address: str) -> Iterator[Any]:
    """Give an open link of pymavlink."""
    link = mavutil.mavlink_connection(address, retries=50, reconnect_delay=0.1)
    try:
        yield link
    finally:
        link.close()


def records(tlog: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield receive time (us) and frame of each record of an undamaged tlog."""
    at = 0
    while at < len(tlog):
        size = frame_size(tlog[at + 8 : at + 11])
        yield int.from_bytes(tlog[at : at + 8], "big"), tlog[at + 8 : at + 8 + size]
        at += 8 + size


def frame_size(head: bytes) -> int:
    """Return the bytes of a frame that begins with `head`."""
    return head[1] + 8 if head[0] == 0xFE else head[1] + 12 + 13 * (head[2] & 1)
