"""What kind of file this is, judged from its first bytes and never from its name."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.model.finding import MISSION_KINDS
from mavframecheck.sources.stream import ByteStream

SNIFF_BYTES = 256 * 1024
"""How much of the beginning decides; a shorter head is taken for the whole content."""

STAMP_BYTES = 8
MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
_OVERHEAD_V1 = 8
_OVERHEAD_V2 = 12
_SIGNATURE = 13
_LONGEST_FRAME = 255 + _OVERHEAD_V2 + _SIGNATURE
_CHAIN = 3  # successors that make a frame certain: chance does it once in some 100 million bytes


class Kind(StrEnum):
    """What a file or stream is."""

    TLOG = "tlog"
    RAW = "raw"
    PCAP = "pcap"
    PCAPNG = "pcapng"
    PLAN = "plan"
    WPL = "wpl"
    POINTS = "points"
    RALLY = "rally"
    DATAFLASH = "dataflash"
    DATAFLASH_TEXT = "dataflash-text"
    ULOG = "ulog"
    PX4LOG = "px4log"
    ROSBAG = "rosbag"
    SQLITE = "sqlite"
    MCAP = "mcap"
    ARCHIVE = "archive"
    JSON = "json"
    TEXT = "text"
    EMPTY = "empty"
    UNKNOWN = "unknown"


RECORDINGS = frozenset({Kind.TLOG, Kind.RAW, Kind.PCAP, Kind.PCAPNG})
MISSIONS = frozenset(Kind(kind) for kind in MISSION_KINDS)

_NO_RECORDING = "no recording: 'mavframecheck check' judges it"
_RECORD_A_TLOG = "record a tlog with a ground station or MAVProxy"
REFUSALS: dict[Kind, str] = {
    Kind.PLAN: f"is a QGroundControl plan, {_NO_RECORDING}",
    Kind.WPL: f"is a waypoint file, {_NO_RECORDING}",
    Kind.POINTS: f"is a file of fence or polygon points, {_NO_RECORDING}",
    Kind.RALLY: f"is a file of rally points, {_NO_RECORDING}",
    Kind.DATAFLASH: "is an ArduPilot DataFlash log from the vehicle's card, which holds no MAVLink: "
    "take the .tlog of the same flight from the ground station",
    Kind.DATAFLASH_TEXT: "is an ArduPilot DataFlash log in text form, which holds no MAVLink: "
    "take the .tlog of the same flight from the ground station",
    Kind.ULOG: "is a PX4 ULog from the vehicle's card, which holds no MAVLink: "
    "take the .tlog of the same flight from QGroundControl",
    Kind.PX4LOG: "is an old PX4 log (.px4log) from the vehicle's card, which holds no MAVLink: "
    "take the .tlog of the same flight from QGroundControl",
    Kind.ROSBAG: f"is a ROS 1 bag, not MAVLink: {_RECORD_A_TLOG} on the MAVROS link",
    Kind.SQLITE: f"is an SQLite database (perhaps a ROS 2 bag), not MAVLink: {_RECORD_A_TLOG}",
    Kind.MCAP: f"is an MCAP recording (ROS 2), not MAVLink: {_RECORD_A_TLOG}",
    Kind.ARCHIVE: "is a packed archive: unpack it and give the tlog inside",
    Kind.JSON: "is JSON, but neither a recording nor a plan of QGroundControl, which begins with its "
    f"fileType: {_RECORD_A_TLOG}, or save the mission as a plan",
    Kind.TEXT: f"is text, not a MAVLink recording: {_RECORD_A_TLOG}",
    Kind.EMPTY: "is empty: nothing was recorded; give a tlog that holds frames",
    Kind.UNKNOWN: "holds no MAVLink that can be recognised: "
    "give a tlog, or say what it is with --input-kind if you know better",
}
"""Why a kind is not read and what to give instead; completes "FILE ..."."""

_MAGICS: tuple[tuple[bytes, Kind], ...] = (
    (b"\xa1\xb2\xc3\xd4", Kind.PCAP),
    (b"\xd4\xc3\xb2\xa1", Kind.PCAP),
    (b"\xa1\xb2\x3c\x4d", Kind.PCAP),
    (b"\x4d\x3c\xb2\xa1", Kind.PCAP),
    (b"\xa1\xb2\xcd\x34", Kind.PCAP),
    (b"\x34\xcd\xb2\xa1", Kind.PCAP),
    (b"\x0a\x0d\x0d\x0a", Kind.PCAPNG),
    (b"ULog\x01\x12\x35", Kind.ULOG),
    (b"\xa3\x95\x80\x80", Kind.DATAFLASH),  # DataFlash first describes its own description record
    (b"\xa3\x95\x80", Kind.PX4LOG),
    (b"\xa3\x95", Kind.DATAFLASH),
    (b"#ROSBAG V", Kind.ROSBAG),
    (b"SQLite format 3\0", Kind.SQLITE),
    (b"\x89MCAP0\r\n", Kind.MCAP),
    (b"PK\x03\x04", Kind.ARCHIVE),
    (b"PK\x05\x06", Kind.ARCHIVE),
    (b"7z\xbc\xaf\x27\x1c", Kind.ARCHIVE),
    (b"Rar!\x1a\x07", Kind.ARCHIVE),
    (b"\xfd7zXZ\0", Kind.ARCHIVE),
    (b"\x28\xb5\x2f\xfd", Kind.ARCHIVE),
    (b"BZh", Kind.ARCHIVE),
    (b"\x1f\x8b\x08", Kind.ARCHIVE),
)

_TEXTS: tuple[tuple[re.Pattern[bytes], Kind], ...] = (
    (re.compile(rb"QGC[ \t]+WPL[ \t]+\S"), Kind.WPL),
    (re.compile(rb"FMT, ?\d+"), Kind.DATAFLASH_TEXT),
    (re.compile(rb'\{[^\0]*?"fileType"\s*:\s*"(Plan|Mission|GeoFence|RallyPoints)"'), Kind.PLAN),
    (re.compile(rb"[{\[]\s*[\"{\[\]}\d-]"), Kind.JSON),
    (re.compile(rb"(?:#[^\n]*\n\s*)*RALLY[ \t]+[-\d.]"), Kind.RALLY),
    (
        re.compile(
            rb"(?:#[^\n]*\n\s*)*(?:-?\d{1,3}\.\d{3,}[ \t]+-?\d{1,3}\.\d{3,}[ \t]*\r?(?:\n|\Z)\s*){3}"
        ),
        Kind.POINTS,
    ),
)
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_TEXT_BYTES = bytes({*range(0x20, 0x7F), *range(0x80, 0xF5), *b"\t\n\r\f"})  # of UTF-8


def sniff(head: bytes) -> Kind:
    """Name the kind of content that begins with `head`; pass SNIFF_BYTES, or all there is."""
    if not head:
        return Kind.EMPTY
    for magic, kind in _MAGICS:
        if head.startswith(magic):
            return kind
    return _mavlink(head) or _text(head)


def sniff_stream(stream: ByteStream) -> Kind:
    """Name the kind of a stream without taking anything from it."""
    return sniff(stream.peek_past_zeros(SNIFF_BYTES, STAMP_BYTES))


def _text(head: bytes) -> Kind:
    """Name a kind of text, or say that `head` is nothing known."""
    text = head.removeprefix(_BYTE_ORDER_MARK).lstrip()
    for pattern, kind in _TEXTS:
        if pattern.match(text):
            return kind
    return Kind.UNKNOWN if head.translate(None, _TEXT_BYTES) else Kind.TEXT


def _mavlink(head: bytes) -> Kind | None:
    """Tell stamped from bare frames by which gap lines up more of them, or find neither."""
    frames = _possible_frames(np.frombuffer(head, np.uint8))
    stamped, bare = frames.chained(STAMP_BYTES), frames.chained(0)
    certain = int(stamped[_CHAIN - 1].sum()), int(bare[_CHAIN - 1].sum())
    if any(certain):
        return Kind.TLOG if certain[0] > certain[1] else Kind.RAW
    whole = len(head) < SNIFF_BYTES
    ends = whole & (frames.end == len(head))
    if (frames.stamped & (stamped[0] | ends | (frames.at == STAMP_BYTES))).any():
        return Kind.TLOG
    if (ends | (whole & bare[1]) | (bare[0] & (frames.at == 0))).any():
        return Kind.RAW
    return None


def carries_frames(data: bytes) -> bool:
    """Whether bytes of a flow are MAVLink: whole frames, or a chain too long for chance."""
    frames = _possible_frames(np.frombuffer(data, np.uint8))
    return _tiled(frames, len(data)) or bool(frames.chained(0)[_CHAIN - 1].any())


def _tiled(frames: _PossibleFrames, size: int) -> bool:
    """Whether bare frames follow each other from the first byte to the last."""
    end_of = dict(zip(frames.at.tolist(), frames.end.tolist(), strict=True))
    at: int | None = 0
    while at is not None and at < size:
        at = end_of.get(at)
    return at == size > 0


class _PossibleFrames(NamedTuple):
    """Every place where a frame could begin, with where it would end."""

    at: npt.NDArray[np.int64]
    end: npt.NDArray[np.int64]
    stamped: npt.NDArray[np.bool_]
    """Whether a time from 2000 to 2100 stands before it."""
    size: int

    def chained(self, gap: int) -> list[npt.NDArray[np.bool_]]:
        """For k = 1 to _CHAIN: which frames are followed by k more, `gap` bytes between them."""
        number = np.full(self.size + _LONGEST_FRAME + STAMP_BYTES, -1, np.int64)
        number[self.at] = np.arange(self.at.size)
        following = number[self.end + gap]
        linked = [following >= 0]
        for _ in range(_CHAIN - 1):
            linked.append(linked[-1] & linked[-1][following])
        return linked


def _possible_frames(data: npt.NDArray[np.uint8]) -> _PossibleFrames:
    """Find the bytes that may begin a frame."""
    at = np.flatnonzero((data[:-3] == MAGIC_V1) | (data[:-3] == MAGIC_V2))
    v2 = data[at] == MAGIC_V2
    length, flags = data[at + 1].astype(np.int64), data[at + 2]
    fill = (length == MAGIC_V1) & (flags == MAGIC_V1) & (data[at + 3] == MAGIC_V1)
    real = np.where(
        v2, flags <= 1, ~fill
    )  # bit 0, signed, is the only flag; a run of 0xFE is no frame
    end = at + length + np.where(v2, _OVERHEAD_V2 + _SIGNATURE * (flags & 1), _OVERHEAD_V1)
    return _PossibleFrames(at[real], end[real], _plausible_stamp(data, at[real]), data.size)


def _plausible_stamp(
    data: npt.NDArray[np.uint8], at: npt.NDArray[np.int64]
) -> npt.NDArray[np.bool_]:
    """Whether the 8 bytes before `at` are microseconds since 1970 between 2000 and 2100."""
    high = at.clip(STAMP_BYTES) - STAMP_BYTES
    top = data[high].astype(np.int64) * 256 + data[high + 1]
    plausible: npt.NDArray[np.bool_] = (at >= STAMP_BYTES) & (top >= 0x0003) & (top <= 0x000E)
    return plausible
