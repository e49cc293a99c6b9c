"""Made-up streams for tests: frames by pymavlink, damage, and every way to cut bytes into chunks."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mavframecheck.model import Damage
from mavframecheck.wire import Batch, Chunk, Frames, load_dialect, read_batches, whole
from mavframecheck.wire.frames import COLUMNS, join

DIALECT = load_dialect()
MESSAGES: dict[int, Any] = dict(mavlink.mavlink_map)
"""Message classes of pymavlink by id: the oracle."""
START_US = 1_772_445_600_000_000
UNKNOWN_ID = 60_001
STAMP = 8


def link(sysid: int = 1, compid: int = 1, *, signed: bool = False) -> Any:
    """Return a sender of pymavlink."""
    sender = mavlink.MAVLink(None, sysid, compid)
    if signed:
        sender.signing.sign_outgoing = True
        sender.signing.secret_key = b"k" * 32
    return sender


def frame(
    name: str,
    fields: dict[str, Any],
    sender: tuple[int, int] = (1, 1),
    seq: int = 0,
    version: int = 2,
    *,
    signed: bool = False,
) -> bytes:
    """Return a frame as pymavlink writes it; fields that are not given are zero."""
    kind = next(m for m in MESSAGES.values() if m.msgname == name)
    return packed(kind, {**blank(kind), **fields}, sender, seq, version, signed=signed)


def packed(
    kind: Any,
    fields: dict[str, Any],
    sender: tuple[int, int] = (1, 1),
    seq: int = 0,
    version: int = 2,
    *,
    signed: bool = False,
) -> bytes:
    """Return a frame of a message class of pymavlink with all its `fields`."""
    port = link(*sender, signed=signed and version == 2)
    port.seq = seq % 256
    return bytes(kind(**fields).pack(port, force_mavlink1=version == 1))


def blank(kind: Any) -> dict[str, Any]:
    """Return zeros for every field of a message class of pymavlink."""
    return {name: zero(*shape(kind, name)) for name in kind.fieldnames}


def shape(kind: Any, name: str) -> tuple[str, int]:
    """Return the C type of a field and how many elements it has (0: a scalar)."""
    place = kind.fieldnames.index(name)
    return kind.fieldtypes[place], kind.array_lengths[kind.ordered_fieldnames.index(name)]


def zero(kind: str, count: int) -> Any:
    """Return zero as pymavlink wants it for a field."""
    if kind == "char":
        return b""
    value: float = 0.0 if kind in {"float", "double"} else 0
    return [value] * count if count else value


def attitude(seq: int = 0, version: int = 2, *, signed: bool = False, yaw: float = 0.3) -> bytes:
    """Return an ATTITUDE frame of the vehicle."""
    known = {"time_boot_ms": seq * 100, "roll": 0.1, "yaw": yaw, "yawspeed": 0.25}
    return frame("ATTITUDE", known, seq=seq, version=version, signed=signed)


def unknown(seq: int = 0, payload: bytes = b"vendor#7") -> bytes:
    """Return a well-made frame whose id no dialect has."""
    body = bytes((len(payload), 0, 0, seq % 256, 42, 190)) + UNKNOWN_ID.to_bytes(3, "little")
    body += payload
    return b"\xfd" + body + struct.pack("<H", mavlink.x25crc(body + b"\x2a").crc)


def broken(good: bytes) -> bytes:
    """Return a frame whose checksum fails."""
    return good[:-1] + bytes((good[-1] ^ 0x5A,))


def record(one: bytes, number: int = 0, *, stamped: bool = True) -> bytes:
    """Return a frame as a file holds it: behind a stamp in a tlog."""
    stamp = struct.pack(">Q", START_US + 100_000 * number) if stamped else b""
    return stamp + one


# Cutting and reading


def cut(data: bytes, places: Iterable[int]) -> list[bytes]:
    """Cut bytes at some places."""
    edges = sorted({0, len(data), *(place % (len(data) + 1) for place in places)})
    return [data[a:b] for a, b in itertools.pairwise(edges)]


def chunks(pieces: Iterable[bytes]) -> list[list[Chunk]]:
    """Return consecutive pieces of a file as chunks."""
    found, offset = [], 0
    for piece in pieces:
        found.append([whole(piece, offset)])
        offset += len(piece)
    return found


class Reading(NamedTuple):
    """What was read of a stream."""

    frames: Frames
    damage: list[Damage]
    """Ranges that touch are one; the reason is that of the first."""
    batches: list[Batch]


def read(pieces: Sequence[bytes], *, stamped: bool) -> Reading:
    """Read consecutive pieces of a file."""
    return read_chunks(chunks(pieces), stamped=stamped)


def read_chunks(groups: list[list[Chunk]], *, stamped: bool) -> Reading:
    """Read groups of chunks."""
    batches = list(read_batches(groups, DIALECT, stamped=stamped))
    if not batches:
        batches = list(read_batches([[whole(b"", 0)]], DIALECT, stamped=stamped))
    damage: list[Damage] = []
    for one in (d for batch in batches for d in batch.damage):
        if damage and damage[-1].offset + damage[-1].length == one.offset:
            last = damage.pop()
            damage.append(Damage(last.offset, last.length + one.length, last.reason))
        else:
            damage.append(one)
    return Reading(join([batch.frames for batch in batches]), damage, batches)


def described(frames: Frames) -> list[tuple[Any, ...]]:
    """Return all that is said of frames, save where they lie in the buffer of their batch."""
    names = [name for name in COLUMNS if name not in {"start", "payload"}]
    return list(zip(*(getattr(frames, name).tolist() for name in names)))


# Strategies


CUTS = st.lists(st.integers(0, 100_000), max_size=8)
"""Places to cut a stream at."""
_MAGIC = st.sampled_from([b"\xfd", b"\xfe", b"\xfd\xfd", b"\xfe\x09", b"\xfd\x08\x00"])
GARBAGE = st.lists(st.one_of(st.binary(min_size=1, max_size=24), _MAGIC), max_size=4).map(b"".join)
"""Bytes that are no frame but may look like the beginning of one."""


@st.composite
def good_frames(draw: st.DrawFn) -> bytes:
    """Return a frame that is in order: either version, signed or not, with magic bytes in its payload."""
    seq = draw(st.integers(0, 255))
    which = draw(st.integers(0, 4))
    if which == 0:
        return attitude(seq, version=1)
    if which == 1:
        return attitude(seq, signed=True)
    if which == 2:
        return frame("HEARTBEAT", {"custom_mode": 0xFDFEFDFE, "type": 2, "mavlink_version": 3})
    if which == 3:
        text = draw(st.binary(max_size=12)) + b"\xfd\xfe\x09\xfd"
        return frame("STATUSTEXT", {"severity": 6, "text": text}, seq=seq)
    return attitude(seq, yaw=draw(st.floats(-3, 3, width=32)))


@st.composite
def streams(draw: st.DrawFn, *, stamped: bool) -> bytes:
    """Return records with all that goes wrong between and in them."""
    pieces = []
    for number in range(draw(st.integers(0, 8))):
        good = draw(good_frames())
        kind = draw(st.sampled_from(["good"] * 4 + ["broken", "unknown", "garbage", "torn"]))
        if kind == "garbage":
            pieces.append(draw(GARBAGE))
            continue
        one = {"broken": broken(good), "unknown": unknown(number)}.get(kind, good)
        written = record(one, number, stamped=stamped)
        pieces.append(written[: draw(st.integers(0, len(written)))] if kind == "torn" else written)
    return b"".join(pieces)
