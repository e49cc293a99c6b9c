"""Bytes to frames: what is found, what is said of the rest, and that cuts change neither."""

from __future__ import annotations

import itertools
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.wire import Chunk
from mavframecheck.wire.framing import CUT_OFF
from tests.strategies import (
    CUTS,
    GARBAGE,
    STAMP,
    START_US,
    UNKNOWN_ID,
    Reading,
    attitude,
    broken,
    cut,
    described,
    frame,
    good_frames,
    read,
    read_chunks,
    record,
    streams,
    unknown,
)

both = pytest.mark.parametrize("stamped", [True, False], ids=["stamped", "bare"])


def in_order(count: int, *, stamped: bool) -> list[bytes]:
    """Return records of frames without fault."""
    return [record(attitude(k), k, stamped=stamped) for k in range(count)]


def account(reading: Reading, size: int) -> None:
    """Assert that every byte belongs to a frame, to its stamp or to damage, and to one of them only."""
    owners = np.zeros(size, np.int64)
    frames = reading.frames
    for offset, length, t_us in zip(frames.offset, frames.size, frames.t_us):
        owners[offset - STAMP * (t_us != 0) : offset + length] += 1
    for damage in reading.damage:
        assert damage.length > 0
        assert damage.reason
        owners[damage.offset : damage.offset + damage.length] += 1
    assert np.flatnonzero(owners != 1).tolist() == []


class TestAnyBytes:
    """What must hold whatever a file contains."""

    @both
    @given(data=st.binary(max_size=600), cuts=CUTS)
    def test_noise(self, data: bytes, cuts: list[int], stamped: bool) -> None:
        reading = read(cut(data, cuts), stamped=stamped)
        assert len(reading.frames) <= len(data) // 8

    @both
    @settings(max_examples=300)
    @given(data=st.data(), cuts=CUTS)
    def test_cuts_change_nothing(self, data: st.DataObject, cuts: list[int], stamped: bool) -> None:
        """Frames, the worth of their stamps, and damage are the same for any cut into chunks."""
        stream = data.draw(streams(stamped=stamped))
        at_once = read([stream], stamped=stamped)
        in_pieces = read(cut(stream, cuts), stamped=stamped)
        assert described(in_pieces.frames) == described(at_once.frames)
        assert in_pieces.damage == at_once.damage

    @both
    @given(data=st.data())
    def test_byte_by_byte(self, data: st.DataObject, stamped: bool) -> None:
        """The worst cut of all, and what a slow link does."""
        stream = data.draw(streams(stamped=stamped))[:300]
        at_once = read([stream], stamped=stamped)
        in_pieces = read([stream[k : k + 1] for k in range(len(stream))], stamped=stamped)
        assert described(in_pieces.frames) == described(at_once.frames)
        assert in_pieces.damage == at_once.damage

    @both
    @settings(max_examples=200)
    @given(data=st.data(), cuts=CUTS)
    def test_every_byte_is_accounted_for(
        self, data: st.DataObject, cuts: list[int], stamped: bool
    ) -> None:
        """Nothing is lost silently."""
        stream = data.draw(st.one_of(streams(stamped=stamped), st.binary(max_size=200)))
        account(read(cut(stream, cuts), stamped=stamped), len(stream))

    @both
    @settings(max_examples=200)
    @given(good=st.lists(good_frames(), min_size=1, max_size=6), data=st.data())
    def test_garbage_costs_no_good_frame(
        self, good: list[bytes], data: st.DataObject, stamped: bool
    ) -> None:
        """Whatever stands between records, each of them is found where it is."""
        stream, places = b"", []
        for number, one in enumerate(good):
            stream += data.draw(GARBAGE) + record(one, number, stamped=stamped)
            places.append(len(stream) - len(one))
        stream += data.draw(GARBAGE)
        frames = read([stream], stamped=stamped).frames
        assert set(places) <= set(frames.offset[frames.crc_ok].tolist())

    @both
    @given(at=st.integers(1, 10_000), rubbish=st.binary(min_size=1, max_size=30))
    def test_garbage_inside_a_record_costs_that_record(
        self, at: int, rubbish: bytes, stamped: bool
    ) -> None:
        """The four records around it are found."""
        records = in_order(5, stamped=stamped)
        hurt = records[2]
        at = at % (len(hurt) - 1) + 1
        stream = b"".join((*records[:2], hurt[:at], rubbish, hurt[at:], *records[3:]))
        frames = read([stream], stamped=stamped).frames
        assert {0, 1, 3, 4} <= set(frames.seq[frames.crc_ok].tolist())

    @both
    @given(at=st.integers(0, 100_000), value=st.integers(1, 255))
    def test_a_flipped_byte_costs_one_frame_at_most(
        self, at: int, value: int, stamped: bool
    ) -> None:
        stream = bytearray(b"".join(in_order(6, stamped=stamped)))
        stream[at % len(stream)] ^= value
        frames = read([bytes(stream)], stamped=stamped).frames
        assert np.count_nonzero(frames.crc_ok) >= 5


def test_a_magic_byte_before_its_flags_have_come() -> None:
    """What may be a header of MAVLink 2 is no record behind another until its flags are read."""
    hurt = "fe1c0001011e00000000cdcccc3d000000009a99993e00000000000000000000803ea1ce"
    torn = "fe1c0001011e00000000cdcccc"
    good = "fd110000000101fd000006000000000000000000000000fdfe09fd628a"
    stream = bytes.fromhex(hurt + torn + good)
    at_once = read([stream], stamped=False)
    in_pieces = read([stream[k : k + 1] for k in range(len(stream))], stamped=False)
    assert described(in_pieces.frames) == described(at_once.frames)
    assert in_pieces.damage == at_once.damage


@both
@pytest.mark.parametrize("byte", [0xFD, 0xFE, 0x00, 0xFF])
def test_a_long_run_of_one_byte(byte: int, stamped: bool) -> None:
    """A megabyte of magic bytes would take hours if each were followed alone; the frame behind it is found."""
    size = 1 << 20
    stream = bytes((byte,)) * size + record(attitude(7), stamped=stamped)
    reading = read(cut(stream, [size // 3, size // 2]), stamped=stamped)
    assert reading.frames.seq[reading.frames.crc_ok].tolist() == [7]
    assert sum(damage.length for damage in reading.damage) + int(
        (reading.frames.size + STAMP * (reading.frames.t_us != 0)).sum()
    ) == len(stream)


@both
def test_headers_that_point_at_each_other(stamped: bool) -> None:
    """Nested headers of unknown ids, each followed by another: work stays bounded here as well."""
    nested = b"\xfd\x00\x00\x00\x00\x01\x01\x61\xea\x00" * 50_000
    reading = read([nested + record(attitude(9), stamped=stamped)], stamped=stamped)
    assert 9 in reading.frames.seq[reading.frames.crc_ok].tolist()


class TestWhatIsRead:
    """Hand-made streams, each with its one right answer."""

    @both
    def test_nothing(self, stamped: bool) -> None:
        reading = read([b""], stamped=stamped)
        assert (len(reading.frames), reading.damage) == (0, [])

    @both
    def test_headers(self, stamped: bool) -> None:
        """Version, signature, ids, sequence, length, place and time of each frame."""
        written = [
            frame("HEARTBEAT", {"type": 2}, (7, 1), 250, version=1),
            frame("HEARTBEAT", {"type": 2}, (7, 2), 251),
            frame("GPS_RAW_INT", {"lat": 5}, (255, 190), 252, signed=True),
        ]
        stream = b"".join(record(one, k, stamped=stamped) for k, one in enumerate(written))
        frames = read([stream], stamped=stamped).frames
        assert frames.version.tolist() == [1, 2, 2]
        assert frames.signed.tolist() == [False, False, True]
        assert frames.sysid.tolist() == [7, 7, 255]
        assert frames.compid.tolist() == [1, 2, 190]
        assert frames.seq.tolist() == [250, 251, 252]
        assert frames.msgid.tolist() == [0, 0, 24]
        assert frames.length.tolist() == [one[1] for one in written]
        assert frames.size.tolist() == [len(one) for one in written]
        assert [stream[o : o + s] for o, s in zip(frames.offset, frames.size)] == written
        assert frames.crc_ok.all()
        assert frames.number.tolist() == [0, 1, 2]
        checksums = [one[-15:-13] if one[2] == 1 else one[-2:] for one in written]
        assert frames.checksum.tolist() == [int.from_bytes(c, "little") for c in checksums]
        if stamped:
            assert frames.t_us.tolist() == [START_US + 100_000 * k for k in range(3)]
        else:
            assert not frames.t_valid.any()

    def test_magic_bytes_in_stamps(self) -> None:
        """A stamp is eight bytes whatever they are."""
        stamp = b"\x00\x06\xfd\xfe\xfd\xfe\x09\xfd"
        stream = b"".join(stamp + attitude(k) for k in range(20))
        reading = read([stream], stamped=True)
        assert reading.frames.seq.tolist() == list(range(20))
        assert reading.damage == []

    @both
    def test_frame_within_the_payload_of_a_frame(self, stamped: bool) -> None:
        """What a tunnel carries was not sent on this link."""
        inner = frame("HEARTBEAT", {"type": 2}, (9, 9))
        outer = frame("STATUSTEXT", {"text": inner})
        stream = b"".join(record(one, stamped=stamped) for one in (outer, attitude(1)))
        assert read([stream], stamped=stamped).frames.msgid.tolist() == [253, 30]

    @both
    def test_torn_tail(self, stamped: bool) -> None:
        """Whatever is missing at the end, it is one damaged range with its reason."""
        records = in_order(3, stamped=stamped)
        before = sum(map(len, records[:2]))
        for keep in range(STAMP * stamped + 1, len(records[2])):
            reading = read([b"".join(records)[: before + keep]], stamped=stamped)
            assert len(reading.frames) == 2
            (damage,) = reading.damage
            assert (damage.offset, damage.length, damage.reason) == (before, keep, CUT_OFF)

    def test_torn_stamp(self) -> None:
        records = in_order(2, stamped=True)
        reading = read([b"".join(records)[: len(records[0]) + 5]], stamped=True)
        assert len(reading.frames) == 1
        assert [(d.offset, d.length) for d in reading.damage] == [(len(records[0]), 5)]

    @both
    def test_a_stamp_or_more_is_missing(self, stamped: bool) -> None:
        """A good frame without its stamp is a good frame without a time."""
        records = in_order(4, stamped=stamped)
        frames = read(
            [b"".join((*records[:2], attitude(90), *records[2:]))], stamped=stamped
        ).frames
        assert frames.seq.tolist() == [0, 1, 90, 2, 3]
        assert not frames.t_valid[2]

    def test_a_torn_stamp_before_a_good_frame(self) -> None:
        """What is left of the stamp is damage; the frame is kept, without a time."""
        good = in_order(3, stamped=True)
        stream = good[0] + b"\x07\xa6" + attitude(90) + good[1]
        reading = read([stream], stamped=True)
        assert reading.frames.seq.tolist() == [0, 90, 1]
        assert reading.frames.t_valid.tolist() == [True, False, True]
        assert [(d.offset, d.length) for d in reading.damage] == [(len(good[0]), 2)]

    @both
    def test_wrong_length(self, stamped: bool) -> None:
        """A length that leads astray costs its own frame."""
        records = in_order(4, stamped=stamped)
        at = STAMP * stamped + 1
        for length in (0, 3, 100, 255):
            wrong = records[1][:at] + bytes((length,)) + records[1][at + 1 :]
            stream = b"".join((records[0], wrong, *records[2:]))
            frames = read([stream], stamped=stamped).frames
            assert frames.seq[frames.crc_ok].tolist() == [0, 2, 3]

    @both
    def test_bad_checksum_before_a_record(self, stamped: bool) -> None:
        """It is a frame, and not a good one; no byte is skipped."""
        good = attitude(1)
        written = [attitude(0), broken(good), attitude(2)]
        reading = read([b"".join(record(o, stamped=stamped) for o in written)], stamped=stamped)
        assert reading.frames.seq.tolist() == [0, 1, 2]
        assert reading.frames.crc_ok.tolist() == [True, False, True]
        assert reading.damage == []
        assert sum(len(batch.tables["ATTITUDE"]) for batch in reading.batches if len(batch)) == 2

    @both
    def test_bad_checksum_before_garbage(self, stamped: bool) -> None:
        """Nothing says that this was a frame at all."""
        bad = record(broken(attitude(1)), stamped=stamped)
        written = (record(attitude(0), stamped=stamped), bad, b"not a record of ours")
        after = record(attitude(2), stamped=stamped)
        reading = read([b"".join((*written, after))], stamped=stamped)
        assert reading.frames.seq.tolist() == [0, 2]
        assert [(d.offset, d.length) for d in reading.damage] == [
            (len(written[0]), len(bad) + len(written[2]))
        ]

    @both
    def test_unknown_id_before_a_record(self, stamped: bool) -> None:
        """It counts, by name of its number; it has no checksum that could hold."""
        written = [attitude(0), unknown(1), unknown(2), attitude(3)]
        reading = read([b"".join(record(o, stamped=stamped) for o in written)], stamped=stamped)
        assert reading.frames.msgid.tolist() == [30, UNKNOWN_ID, UNKNOWN_ID, 30]
        assert reading.frames.known.tolist() == [True, False, False, True]
        assert not reading.frames.good[1:3].any()
        assert reading.damage == []

    @both
    def test_unknown_id_before_garbage_is_stepped_over(self, stamped: bool) -> None:
        """Without a checksum only what follows can confirm a frame; a good one inside it is kept."""
        hidden = record(attitude(5), stamped=stamped)
        false = record(
            b"\xfd\xff\x00\x00\x01\x01" + UNKNOWN_ID.to_bytes(3, "little"), stamped=stamped
        )
        stream = false + b"x" * 40 + hidden + b"y" * 300 + record(attitude(6), stamped=stamped)
        frames = read([stream], stamped=stamped).frames
        assert frames.known.all()
        assert frames.seq.tolist() == [5, 6]

    @both
    @pytest.mark.parametrize("flags", [0x02, 0x03, 0x80, 0xFF])
    def test_unknown_incompatibility_flags(self, flags: int, stamped: bool) -> None:
        """The standard says: drop what you do not understand. Its bytes are named, the rest is read."""
        odd = bytearray(attitude(1))
        odd[2] = flags
        records = [record(o, stamped=stamped) for o in (attitude(0), bytes(odd), attitude(2))]
        reading = read([b"".join(records)], stamped=stamped)
        assert reading.frames.seq.tolist() == [0, 2]
        (damage,) = reading.damage
        assert (damage.offset, damage.length) == (len(records[0]), len(records[1]))


class TestPieces:
    """Chunks of several pieces, as a capture gives them."""

    @staticmethod
    def chunk(pieces: list[bytes], first: int, gap: int, flow: int = 0) -> Chunk:
        """Return a chunk whose pieces lie `gap` bytes apart and were received a second apart."""
        sizes = [len(piece) for piece in pieces]
        starts = np.cumsum([0, *sizes[:-1]])
        offsets = first + starts + gap * np.arange(len(pieces))
        times = START_US + 1_000_000 * np.arange(len(pieces))
        return Chunk(b"".join(pieces), starts, offsets, times, flow)

    def test_offset_and_time_of_the_piece_in_which_a_frame_begins(self) -> None:
        one, two, three = attitude(1), attitude(2), attitude(3)
        pieces = [one + two[:5], two[5:] + b"", three]
        frames = read_chunks([[self.chunk(pieces, 1000, 66)]], stamped=False).frames
        assert frames.seq.tolist() == [1, 2, 3]
        size = len(one)
        assert frames.offset.tolist() == [1000, 1000 + size, 1000 + 2 * size + 2 * 66]
        assert (frames.t_us - START_US).tolist() == [0, 0, 2_000_000]
        assert frames.t_valid.all()

    def test_damage_is_placed_by_its_piece(self) -> None:
        pieces = [attitude(1), b"rubbish", attitude(2)]
        (damage,) = read_chunks([[self.chunk(pieces, 0, 10)]], stamped=False).damage
        assert (damage.offset, damage.length) == (len(pieces[0]) + 10, 7)

    def test_flows_keep_to_themselves(self) -> None:
        """Half a frame of one direction is not finished by bytes of the other."""
        one, other = attitude(1), attitude(2)
        groups = [
            [self.chunk([one[:9]], 0, 0, flow=0), self.chunk([other[:20]], 9, 0, flow=1)],
            [self.chunk([one[9:]], 29, 0, flow=0), self.chunk([other[20:]], 60, 0, flow=1)],
        ]
        reading = read_chunks(groups, stamped=False)
        assert reading.frames.offset.tolist() == [0, 9]
        assert reading.frames.crc_ok.all()
        assert reading.damage == []

    @given(sizes=st.lists(st.integers(1, 60), max_size=40), cuts=CUTS)
    def test_pieces_and_cuts_change_nothing(self, sizes: list[int], cuts: list[int]) -> None:
        """A packet boundary inside a frame costs nothing, nor does an empty packet."""
        stream = b"".join(attitude(k) for k in range(12))
        pieces, rest = [], stream
        for size in sizes:
            pieces.append(rest[:size])
            rest = rest[size:]
        pieces.append(rest)
        whole_chunk = self.chunk(pieces, 0, 7)
        places = sorted({0, len(pieces), *(c % (len(pieces) + 1) for c in cuts)})
        groups = []
        for a, b in itertools.pairwise(places):
            data = b"".join(pieces[a:b])
            starts = whole_chunk.starts[a:b] - whole_chunk.starts[a]
            assert whole_chunk.t_us is not None
            groups.append([Chunk(data, starts, whole_chunk.offsets[a:b], whole_chunk.t_us[a:b])])
        at_once = read_chunks([[whole_chunk]], stamped=False)
        in_groups = read_chunks(groups, stamped=False)
        assert described(in_groups.frames) == described(at_once.frames)
        assert at_once.frames.seq.tolist() == list(range(12))


def test_stamps_are_big_endian_microseconds() -> None:
    stream = struct.pack(">Q", 1_700_000_000_123_456) + attitude(0)
    frames = read([stream], stamped=True).frames
    assert frames.t_us.tolist() == [1_700_000_000_123_456]
