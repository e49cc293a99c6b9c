"""Missions found in recordings of simulators equal what was uploaded: what pymavlink reads of the bytes says so."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mavframecheck.missions import Mission, Transactions
from mavframecheck.sources import open_recording
from mavframecheck.wire import read_batches
from tests.strategies import DIALECT

FOLDER = Path(__file__).parents[3] / "shared" / "corpus" / "sitl"
HEADERS = {
    0xFD: rb"(?=\xfd[\x00-\xff]{6}[%s]\x00\x00)",
    0xFE: rb"(?=\xfe[\x00-\xff]{4}[%s])",
}
"""Magic byte -> what a frame of some message ids begins with."""
COUNT, ALL = rb"\x2c", rb"\x27\x2c\x2f\x49"
"""MISSION_COUNT; that and MISSION_ITEM, MISSION_ACK, MISSION_ITEM_INT."""
STAMP = 8
Uploaded = tuple[int, int, int, tuple[tuple[float, ...], ...]]


def messages(data: bytes) -> Iterator[Any]:
    """Yield the mission messages among the bytes of a recording, as pymavlink decodes them."""
    begins = HEADERS[data[STAMP]]
    if re.search(begins % COUNT, data) is None:
        return
    link = mavlink.MAVLink(None)
    for header in re.finditer(begins % ALL, data):
        at = header.start()
        overhead = 12 if data[at] == 0xFD else 8
        signed = 13 if data[at] == 0xFD and data[at + 2] & 1 else 0
        frame = bytearray(data[at : at + overhead + signed + data[at + 1]])
        try:
            yield link.decode(frame)
        except mavlink.MAVError:
            continue


def uploaded(data: bytes) -> list[Uploaded]:
    """Return what was uploaded and answered, by a loop over the messages."""
    found: list[Uploaded] = []
    items: dict[tuple[int, int], dict[int, tuple[float, ...]]] = {}
    for message in messages(data):
        name, kind = message.get_type(), getattr(message, "mission_type", 0)
        if message.get_srcComponent() == 1 and name == "MISSION_ACK":
            seen = items.pop((message.get_srcSystem(), kind), {})
            if seen:
                rows = tuple(seen[seq] for seq in sorted(seen))
                found.append((message.get_srcSystem(), kind, message.type, rows))
        elif message.get_srcComponent() == 1:
            continue
        elif name == "MISSION_COUNT":
            items[message.target_system, kind] = {}
        elif name != "MISSION_ACK" and (message.target_system, kind) in items:
            scale = 1e-7 if name == "MISSION_ITEM_INT" and message.frame != 1 else 1.0
            scale = 1e-4 if name == "MISSION_ITEM_INT" and message.frame == 1 else scale
            scale = 1.0 if message.frame == 2 else scale
            place = (message.x * scale, message.y * scale, message.z)
            items[message.target_system, kind][message.seq] = (
                message.seq,
                message.command,
                message.frame,
                *place,
                *(getattr(message, f"param{k}") for k in (1, 2, 3, 4)),
            )
    return found


def ours(path: Path) -> list[Uploaded]:
    """Return the same by `Transactions`."""
    transactions = Transactions()
    missions: list[Mission] = []
    with open_recording(str(path), None) as recording:
        for batch in read_batches(recording.chunks(), DIALECT, stamped=recording.stamped):
            missions += transactions.update(batch)
    missions += transactions.finish()
    sent = [m for m in missions if m.sender & 0xFF != 1 and m.count and m.answer is not None]
    return [(m.target, m.mission_type, m.answer or 0, _rows(m)) for m in sent]


def _rows(mission: Mission) -> tuple[tuple[float, ...], ...]:
    items = mission.items
    columns = (items.seq, items.command, items.frame, items.x, items.y, items.z, *items.params.T)
    return tuple(zip(*(column.tolist() for column in columns), strict=True))


def test_missions_in_recordings_equal_what_was_uploaded() -> None:
    if not FOLDER.is_dir():
        pytest.skip("../shared/corpus/sitl is not there")
    compared = 0
    for path in sorted(FOLDER.glob("*.tlog")):
        expected = uploaded(path.read_bytes())
        found = ours(path) if expected else []
        assert len(found) == len(expected), path.name
        for one, other in zip(found, expected, strict=True):
            assert one[:3] == other[:3], path.name
            for row, wanted in zip(one[3], other[3], strict=True):
                assert row == pytest.approx(wanted, nan_ok=True, rel=1e-12, abs=1e-9), path.name
            compared += 1
    assert compared >= 15
