"""Hostile recordings stay within the bounds of DESIGN law 2: many senders, flickering masks and instances."""

from __future__ import annotations

import itertools
import struct
import tracemalloc
from collections import Counter

from mavframecheck.engine.episodes import MAX_EPISODES, MAX_STREAMS
from mavframecheck.vehicle.traffic import MAX_SENDERS
from mavframecheck.wire.encode import encode_frame, encode_payload
from tests.engine.judged import judge, run_of
from tests.strategies import DIALECT, START_US, unknown

SETPOINT = DIALECT.by_name["SET_POSITION_TARGET_LOCAL_NED"]


def records(frames: list[bytes], step_us: int = 1000) -> bytes:
    """Return frames as a recording."""
    return b"".join(
        (START_US + step_us * k).to_bytes(8, "big") + one for k, one in enumerate(frames)
    )


def setpoint(seq: int, sender: tuple[int, int], **fields: float) -> bytes:
    """Return a setpoint."""
    payload = encode_payload(SETPOINT, fields)
    return encode_frame(SETPOINT, payload, sysid=sender[0], compid=sender[1], seq=seq)


def cuts(data: bytes) -> list[int]:
    """Return cuts into pieces of a megabyte."""
    return list(range(0, len(data), 1 << 20))


def test_65_000_sender_ids() -> None:
    """Every id of a 16-bit sender sends a faulty setpoint: 256 are judged, the report says so."""
    senders = list(itertools.product(range(256), range(256)))
    frames = [setpoint(0, s, coordinate_frame=99, target_system=s[1]) for s in senders]
    data = records(frames)
    tracemalloc.start()
    report, findings = judge(data, cuts(data))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert report.messages == 65_536
    assert len(report.vehicles) <= MAX_SENDERS
    assert len({(f.sysid, f.compid) for f in findings if f.message_name}) <= MAX_SENDERS
    assert any("256 senders" in note for note in report.notes)
    assert peak < 200e6


def test_a_mask_that_flickers_on_every_message() -> None:
    """Undefined bits on and off: findings stay few, and count every hit."""
    frames = [
        setpoint(k % 256, (1, 191), target_system=1, type_mask=0xFFFF if k % 2 else 0x0DF8)
        for k in range(20_000)
    ]
    data = records(frames)
    _, findings = judge(data, cuts(data))
    by_rule = Counter(f.code for f in findings)
    assert max(by_rule.values()) <= MAX_EPISODES
    assert sum(f.count for f in findings if f.code == "MFC113") == 10_000


def test_every_mask_and_target() -> None:
    """All 65 536 masks, to all 256 systems: as many streams as targets, no more."""
    frames = [
        setpoint(k % 256, (1, 191), target_system=k % 256, type_mask=k % 65_536, x=float("nan"))
        for k in range(65_536)
    ]
    data = records(frames, 1_000_000)
    report, findings = judge(data, cuts(data))
    assert max(Counter((f.code, f.field) for f in findings).values()) <= 256 * MAX_EPISODES
    assert run_of((report, findings), "MFC113").status == "ran"


def test_every_instance() -> None:
    """An instance field with 256 values from 100 senders: streams are counted across them."""
    layout = DIALECT.by_name["GLOBAL_VISION_POSITION_ESTIMATE"]
    odometry = DIALECT.by_name["ODOMETRY"]
    frames = []
    for k in range(25_600):
        one = odometry if k % 2 else layout
        fields = {"estimator_type": k % 256, "q": [0.5, 0, 0, 0]} if k % 2 else {"x": 1e9}
        payload = encode_payload(one, fields)
        frames.append(encode_frame(one, payload, sysid=k % 100, compid=191, seq=k % 256))
    data = records(frames)
    _, findings = judge(data, cuts(data))
    assert max(Counter(f.code for f in findings).values()) <= MAX_STREAMS


def test_unknown_ids_without_end() -> None:
    """Each frame has an id of its own: they are counted, and few are told apart."""
    frames = []
    for k in range(20_000):
        made = bytearray(unknown(k))
        made[7:10] = struct.pack("<I", 61_000 + k)[:3]
        frames.append(bytes(made))
    data = records(frames)
    report, findings = judge(data, cuts(data))
    assert report.unknown == 20_000
    (found,) = (f for f in findings if f.code == "MFC004")
    assert len(found.text) < 1000
    assert found.count == 20_000
