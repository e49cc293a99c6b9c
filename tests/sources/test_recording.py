"""Reading files, gzip and standard input in chunks."""

from __future__ import annotations

import gzip
import io
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.sources import RECORDINGS, STDIN, Kind, Recording, SourceError, open_recording
from mavframecheck.sources.recording import BATCH_BYTES
from mavframecheck.sources.stream import ByteStream, Gunzip
from tests.sources.made import all_chunks, frames, joined, tlog

FLIGHT = tlog(frames(200))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "flight"


def test_a_tlog(file: Path) -> None:
    file.write_bytes(FLIGHT)
    with open_recording(file) as recording:
        assert (recording.name, recording.kind, recording.stamped) == (str(file), Kind.TLOG, True)
        ((chunk,),) = recording.chunks()
    assert chunk.data == FLIGHT
    assert (chunk.starts.tolist(), chunk.offsets.tolist(), chunk.t_us) == ([0], [0], None)
    assert recording.notes == []


def test_a_raw_file_has_no_stamps(file: Path) -> None:
    file.write_bytes(b"".join(frames(50)))
    with open_recording(str(file)) as recording:
        assert (recording.kind, recording.stamped) == (Kind.RAW, False)


def test_a_long_file_comes_in_batches_that_continue_each_other(file: Path) -> None:
    content = FLIGHT * (1 + 2 * BATCH_BYTES // len(FLIGHT))
    file.write_bytes(content)
    chunks = all_chunks(open_recording(file))
    assert [len(chunk.data) for chunk in chunks[:2]] == [BATCH_BYTES, BATCH_BYTES]
    assert [int(chunk.offsets[0]) for chunk in chunks[:2]] == [0, BATCH_BYTES]
    assert b"".join(chunk.data for chunk in chunks) == content


def test_zeros_before_the_first_frame_are_kept(file: Path) -> None:
    content = bytes(3_000_000) + FLIGHT
    file.write_bytes(content)
    recording = open_recording(file)
    assert recording.kind is Kind.TLOG
    assert joined(recording) == content


def test_input_kind_overrules(file: Path) -> None:
    file.write_bytes(b"nothing of the sort")
    with open_recording(file, "raw") as recording:
        assert recording.kind is Kind.RAW
    with pytest.raises(SourceError, match="choose one of tlog, raw, pcap, pcapng"):
        open_recording(file, "plan")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xa3\x95\x80\x80", "DataFlash"),
        (b"ULog\x01\x12\x35", "ULog"),
        (b"QGC WPL 110\n", "waypoint file"),
        (b'{"fileType": "Plan"}', "plan"),
        (b"", "empty"),
        (gzip.compress(b""), "empty"),
        (gzip.compress(gzip.compress(FLIGHT)), "archive"),
        (b"\0\1\2\3", "no MAVLink"),
    ],
)
def test_other_content_is_refused_in_one_sentence(file: Path, content: bytes, words: str) -> None:
    file.write_bytes(content)
    with pytest.raises(SourceError, match=words) as refusal:
        open_recording(file)
    assert str(refusal.value).startswith(f"{file}: this ")
    assert "\n" not in str(refusal.value)


def test_what_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="no such file"):
        open_recording(tmp_path / "missing")
    with pytest.raises(SourceError, match="directory"):
        open_recording(tmp_path)
    with pytest.raises(SourceError, match="name of a file"):
        open_recording("a\0b")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read all")
def test_no_permission(file: Path) -> None:
    file.touch(mode=0)
    with pytest.raises(SourceError, match="permission"):
        open_recording(file)


def test_a_disk_that_fails_on_the_way() -> None:
    class Failing(io.BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            if self.tell() >= len(FLIGHT):
                raise OSError(5, "Input/output error")
            return super().read(size)

    recording = Recording("flight", Failing(FLIGHT), Kind.TLOG)
    with pytest.raises(SourceError, match=r"flight: .*Input/output error"):
        all_chunks(recording)


class TestGzip:
    """Packed recordings."""

    NOISE = random.Random(1).randbytes(400_000)

    def unpacked(self, packed: bytes) -> tuple[bytes, list[str]]:
        recording = Recording("packed", io.BytesIO(packed), Kind.RAW)
        return joined(recording), recording.notes

    def test_offsets_are_those_of_the_unpacked_stream(self, file: Path) -> None:
        content = FLIGHT * (1 + BATCH_BYTES // len(FLIGHT))
        file.write_bytes(gzip.compress(content))
        chunks = all_chunks(open_recording(file))
        assert [int(chunk.offsets[0]) for chunk in chunks] == [0, BATCH_BYTES]
        assert b"".join(chunk.data for chunk in chunks) == content

    def test_members_joined_and_padded(self) -> None:
        packed = gzip.compress(FLIGHT) + gzip.compress(FLIGHT[:100]) + bytes(200_000)
        assert self.unpacked(packed) == (FLIGHT + FLIGHT[:100], [])

    def test_rubbish_behind(self) -> None:
        content, notes = self.unpacked(gzip.compress(FLIGHT) + b"rubbish")
        assert content == FLIGHT
        assert len(notes) == 1

    def test_cut_short(self) -> None:
        content, notes = self.unpacked(gzip.compress(self.NOISE)[:250_000])
        assert self.NOISE.startswith(content)
        assert len(content) > 240_000
        assert "ends early" in notes[0]

    def test_wrong_checksum_costs_no_byte(self) -> None:
        packed = bytearray(gzip.compress(self.NOISE))
        packed[-8] ^= 1
        content, notes = self.unpacked(bytes(packed))
        assert content == self.NOISE
        assert "corrupt" in notes[0]

    @given(st.integers(0, 2000), st.integers(0, 255))
    def test_any_damage_leaves_a_readable_front(self, at: int, value: int) -> None:
        packed = bytearray(gzip.compress(FLIGHT))
        packed[10 + at % (len(packed) - 10)] = value
        content, notes = self.unpacked(bytes(packed))
        assert content == FLIGHT or notes


@given(st.integers(10, 2000), st.integers(0, 255), st.integers(1, 40))
def test_damage_costs_the_same_whatever_the_size_of_reads(at: int, value: int, size: int) -> None:
    packed = bytearray(gzip.compress(FLIGHT))
    packed[at % len(packed)] ^= value
    stream = open_gzip(bytes(packed))
    pieces = list(iter(lambda: stream.read(size), b""))
    at_once, bit_by_bit = open_gzip(bytes(packed)).read(2 * len(FLIGHT)), b"".join(pieces)
    shared = min(len(at_once), len(bit_by_bit))
    assert all(len(piece) == size for piece in pieces[:-1])
    assert at_once[:shared] == bit_by_bit[:shared]
    assert max(len(at_once), len(bit_by_bit)) - shared <= 258  # one symbol of deflate


def open_gzip(packed: bytes) -> ByteStream:
    return ByteStream(Gunzip(ByteStream(io.BytesIO(packed).read), []).read)


def test_standard_input() -> None:
    program = (
        "from mavframecheck.sources import open_recording\n"
        "with open_recording('-') as r:\n"
        "    print(r.name, r.kind, sum(len(c.data) for b in r.chunks() for c in b))\n"
    )
    for content in (FLIGHT * 400, gzip.compress(FLIGHT * 400)):
        run = subprocess.run(
            [sys.executable, "-c", program], input=content, capture_output=True, check=True
        )
        assert run.stdout.split() == [b"<stdin>", b"tlog", str(len(FLIGHT) * 400).encode()]


def test_standard_input_stays_open(monkeypatch: pytest.MonkeyPatch) -> None:
    stdin = io.TextIOWrapper(io.BytesIO(FLIGHT))
    monkeypatch.setattr(sys, "stdin", stdin)
    assert joined(open_recording(STDIN)) == FLIGHT
    assert not stdin.buffer.closed


def test_files_need_no_capture_library(file: Path) -> None:
    file.write_bytes(FLIGHT)
    program = (
        "import sys; from mavframecheck.sources import open_recording\n"
        "list(open_recording(sys.argv[1]).chunks()); print('dpkt' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", program, file], capture_output=True, check=True)
    assert run.stdout.strip() == b"False"


@given(st.binary(max_size=300), st.sampled_from([None, *sorted(RECORDINGS)]))
def test_any_bytes_are_read_or_refused(content: bytes, kind: Kind | None) -> None:
    try:
        recording = Recording("made up", io.BytesIO(content), kind)
    except SourceError:
        return
    for chunk in all_chunks(recording):
        assert chunk.starts[0] == 0
        assert chunk.starts.size == chunk.offsets.size
