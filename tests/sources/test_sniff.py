"""What a file is, from its first bytes."""

from __future__ import annotations

import csv
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.sources import MISSIONS, RECORDINGS, Kind, open_recording, sniff
from mavframecheck.sources.sniff import REFUSALS, SNIFF_BYTES, carries_frames
from tests.sources.made import CORPUS, NO_CORPUS, frames, tlog

MIXED = [frame for pair in zip(frames(20, 1), frames(20, 2), strict=True) for frame in pair]
GARBAGE = random.Random(4).randbytes(3000)


@pytest.mark.parametrize("written", [frames(20, 1), frames(20, 2), frames(20, signed=True), MIXED])
def test_frames_with_and_without_stamps(written: list[bytes]) -> None:
    assert sniff(tlog(written)) is Kind.TLOG
    assert sniff(b"".join(written)) is Kind.RAW


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_frames_suffice(version: int, count: int) -> None:
    written = frames(count, version)
    assert sniff(tlog(written)) is Kind.TLOG
    assert sniff(b"".join(written)) is Kind.RAW


@pytest.mark.parametrize("before", [b"", b"text at the start\r\n", GARBAGE, frames(1)[0][5:]])
@pytest.mark.parametrize("after", [b"", GARBAGE[:99], frames(1)[0][:20]])
def test_damage_at_both_ends(before: bytes, after: bytes) -> None:
    assert sniff(before + tlog(MIXED) + after) is Kind.TLOG
    assert sniff(before + b"".join(MIXED) + after) is Kind.RAW


def test_one_frame_behind_garbage() -> None:
    assert sniff(b"x" * 50 + tlog(frames(1))) is Kind.TLOG
    assert sniff(b"x" * 50 + frames(1)[0]) is Kind.RAW


def test_stamps_may_be_nonsense() -> None:
    assert sniff(tlog(frames(20), start_us=2**63)) is Kind.TLOG
    assert sniff(tlog(frames(20), start_us=0)) is Kind.TLOG


def test_every_fifth_frame_damaged() -> None:
    def spoil(written: list[bytes]) -> list[bytes]:
        return [f if i % 5 else f[:-6] for i, f in enumerate(written)]

    assert sniff(tlog(spoil(frames(60)))) is Kind.TLOG
    assert sniff(b"".join(spoil(frames(60)))) is Kind.RAW


@pytest.mark.parametrize(
    ("head", "kind"),
    [
        (b"", Kind.EMPTY),
        (b"\xd4\xc3\xb2\xa1" + bytes(20), Kind.PCAP),
        (b"\xa1\xb2\xc3\xd4" + bytes(20), Kind.PCAP),
        (b"\x4d\x3c\xb2\xa1" + bytes(20), Kind.PCAP),
        (b"\x0a\x0d\x0d\x0a" + bytes(20), Kind.PCAPNG),
        (b"\xa3\x95\x80\x80\x59FMT\0BBnNZ", Kind.DATAFLASH),
        (b"\xa3\x95\x80\x02\x20ATT\0fff", Kind.PX4LOG),
        (b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n", Kind.DATAFLASH_TEXT),
        (b"ULog\x01\x12\x35\x01" + bytes(8), Kind.ULOG),
        (b"#ROSBAG V2.0\n", Kind.ROSBAG),
        (b"SQLite format 3\0" + bytes(80), Kind.SQLITE),
        (b"\x89MCAP0\r\n", Kind.MCAP),
        (b"PK\x03\x04" + bytes(20), Kind.ARCHIVE),
        (b"QGC WPL 110\r\n0\t1\t0\t16", Kind.WPL),
        (b'\xef\xbb\xbf{\n    "fileType": "Plan",\n', Kind.PLAN),
        (b'{"geoFence": {}, "fileType":"Plan"}', Kind.PLAN),
        (b'{"name": "value"}', Kind.JSON),
        (b"# a list\nof words\n", Kind.TEXT),
        ("żółw ąęś\n".encode(), Kind.TEXT),
        (b"\xfe" * 5000, Kind.UNKNOWN),
        (b"\xfd" * 5000, Kind.UNKNOWN),
        (bytes(5000), Kind.UNKNOWN),
        (random.Random(7).randbytes(SNIFF_BYTES), Kind.UNKNOWN),
    ],
)
def test_other_content(head: bytes, kind: Kind) -> None:
    assert sniff(head) is kind


def test_every_kind_is_read_or_refused() -> None:
    assert set(REFUSALS) == set(Kind) - RECORDINGS
    assert set(REFUSALS) > MISSIONS


def test_flow_of_a_capture() -> None:
    one = frames(1)[0]
    assert carries_frames(one)
    assert carries_frames(one[7:] + b"".join(frames(5)))
    assert not carries_frames(one[7:])
    assert not carries_frames(b"")
    assert not carries_frames(b"GET / HTTP/1.1\r\n\r\n")


@given(st.binary(max_size=600))
def test_any_bytes_have_a_kind(head: bytes) -> None:
    assert isinstance(sniff(head), Kind)
    assert carries_frames(head) in (True, False)


@given(st.binary(max_size=40), st.integers(0, 200), st.booleans())
def test_cutting_the_front_off_changes_nothing(garbage: bytes, cut: int, stamped: bool) -> None:
    bare = b"".join(MIXED[:16])
    whole = tlog(MIXED[:16]) if stamped else bare
    assert sniff(b"\x01" + garbage + whole[cut:]) is (Kind.TLOG if stamped else Kind.RAW)


@pytest.mark.skipif(not CORPUS.is_dir(), reason=NO_CORPUS)
def test_corpus() -> None:
    with (CORPUS / "real" / "INDEX.csv").open(newline="", encoding="utf-8") as index:
        real = [CORPUS / "real" / row["file"] for row in csv.DictReader(index)]
    kinds = {"tlog": "tlog", "raw": "raw", "pcap": "pcapng"}
    expected = {path: kinds[path.parent.name] for path in real if path.parent.name in kinds}
    expected |= dict.fromkeys((CORPUS / "sitl").glob("*.tlog"), "tlog")
    wrong = {}
    for path, kind in expected.items():
        with open_recording(path) as recording:
            if recording.kind != kind:
                wrong[path.name] = recording.kind
    assert len(expected) > 200
    assert wrong == {}
    missions = {
        path: sniff(path.read_bytes()) for path in real if path.parent.name in ("plan", "wpl")
    }
    assert {path.name for path, kind in missions.items() if kind != path.parent.name} == set()
