"""Links to records: every frame byte for byte, whatever came between and however it was cut."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.wire import Chunk
from mavframecheck.wire.records import Records
from tests.links import records
from tests.strategies import DIALECT, frame

FRAMES = [
    frame("ATTITUDE", {"roll": number / 7, "time_boot_ms": number}, seq=number, version=version)
    for number in range(12)
    for version in (1, 2)
]


def chunk(data: bytes, offset: int, t_us: int, flow: int) -> Chunk:
    return Chunk(data, np.zeros(1, np.int64), np.array([offset]), np.array([t_us]), flow)


@given(
    cuts=st.lists(st.integers(0, 2000), max_size=12),
    peers=st.lists(st.integers(0, 2), min_size=len(FRAMES), max_size=len(FRAMES)),
    noise=st.lists(st.binary(max_size=9).filter(lambda b: not set(b) & {0xFD, 0xFE}), max_size=4),
)
def test_byte_for_byte(cuts: list[int], peers: list[int], noise: list[bytes]) -> None:
    """What peers send one by one, cut anywhere, comes out as it was sent; garbage is counted."""
    made, offset, found, garbage = Records(DIALECT), 0, b"", 0
    pending = {0: b"", 1: b"", 2: b""}
    for number, (sent, peer) in enumerate(zip(FRAMES, peers)):
        data = (noise[number] if number < len(noise) else b"") + sent
        places = sorted({0, len(data), *(cut % len(data) for cut in cuts)})
        for first, last in pairwise(places):
            part = data[first:last]
            found += made.take([chunk(part, offset, 1000 + number, peer)])
            garbage += sum(each.length for each in made.damage)
            offset += len(part)
        pending[peer] += sent
    found += made.close()
    garbage += sum(each.length for each in made.damage)
    assert [data for _, data in records(found)] == FRAMES
    assert [t_us for t_us, _ in records(found)] == [1000 + n for n in range(len(FRAMES))]
    assert garbage == sum(map(len, noise))


def test_nothing() -> None:
    made = Records(DIALECT)
    assert made.take([]) == b""
    assert made.close() == b""
