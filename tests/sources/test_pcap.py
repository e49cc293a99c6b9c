"""Packet captures: links, flows, order, damage."""

from __future__ import annotations

import io
import struct

import pytest
from dpkt import tcp
from hypothesis import given
from hypothesis import strategies as st

from mavframecheck.sources import Kind, Recording, open_recording, sniff
from mavframecheck.sources.flows import MAX_FLOWS
from mavframecheck.sources.sniff import carries_frames
from tests.sources.made import (
    CORPUS,
    NO_CORPUS,
    START_US,
    VEHICLE,
    all_chunks,
    datagram,
    enhanced,
    frames,
    interface,
    joined,
    linked,
    pcap_file,
    section,
    segment,
)

FRAMES = frames(12)
STREAM = b"".join(FRAMES)
ADDRESS_6 = bytes(15) + b"\1"


def capture(content: bytes) -> Recording:
    return Recording("capture", io.BytesIO(content))


def over_udp(link: int = 1, source: bytes = VEHICLE) -> list[bytes]:
    return [linked(link, datagram(frame, source)) for frame in FRAMES]


def pieces(content: bytes) -> list[tuple[bytes, int, int]]:
    """Each piece of flow 0 with its offset and time, which are checked against the file."""
    found = []
    for chunk in all_chunks(capture(content)):
        assert chunk.t_us is not None
        ends = [*chunk.starts[1:].tolist(), len(chunk.data)]
        places = zip(chunk.starts.tolist(), ends, chunk.offsets.tolist(), chunk.t_us.tolist())
        for start, end, offset, t_us in places:
            assert content[offset : offset + end - start] == chunk.data[start:end]
            found.append((chunk.data[start:end], offset, t_us))
    return found


@pytest.mark.parametrize("source", [VEHICLE, ADDRESS_6])
@pytest.mark.parametrize("link", [0, 1, 12, 101, 108, 113, 276])
def test_links_and_addresses(link: int, source: bytes) -> None:
    found = pieces(pcap_file(over_udp(link, source), link))
    assert [data for data, _, _ in found] == FRAMES
    assert [t_us for _, _, t_us in found] == [START_US + 100_000 * i for i in range(len(FRAMES))]


@pytest.mark.parametrize("tags", [b"\x81\0\0\5", b"\x88\xa8\0\5\x81\0\0\6"])
def test_vlan(tags: bytes) -> None:
    packets = [packet[:12] + tags + packet[12:] for packet in over_udp()]
    assert [data for data, _, _ in pieces(pcap_file(packets))] == FRAMES


def test_nanoseconds() -> None:
    assert pieces(pcap_file(over_udp(), nano=True))[3][2] == START_US + 300_000


def test_pcapng_with_several_interfaces_and_sections() -> None:
    nano, micro = linked(1, datagram(FRAMES[0])), linked(0, datagram(FRAMES[1]))
    big = linked(1, datagram(FRAMES[2]))
    content = (
        section()
        + interface(1, 9)
        + interface(0)
        + enhanced(nano, START_US * 1000, 0)
        + enhanced(micro, START_US + 5, 1)
        + section(">")
        + interface(1, 6, ">")
        + enhanced(big, START_US + 9, 0, ">")
    )
    assert capture(content).kind is Kind.PCAPNG
    found = pieces(content)
    assert [data for data, _, _ in found] == FRAMES[:3]
    assert [t_us - START_US for _, _, t_us in found] == [0, 5, 9]


def test_a_packet_of_an_unknown_interface_is_left_out() -> None:
    good = linked(1, datagram(FRAMES[0]))
    content = section() + interface(1) + enhanced(good, 1, 7) + enhanced(good, 2, 0)
    recording = capture(content)
    assert joined(recording) == FRAMES[0]
    assert recording.notes == ["left out: 1 damaged packets"]


def test_flows_are_numbered_as_they_appear() -> None:
    packets = [linked(1, datagram(FRAMES[i], sport=9000 + i % 3)) for i in range(12)]
    chunks = all_chunks(capture(pcap_file(packets)))
    assert [chunk.flow for chunk in chunks] == [0, 1, 2]
    assert chunks[1].data == b"".join(FRAMES[1::3])


def test_flows_are_bounded() -> None:
    packets = [linked(1, datagram(FRAMES[0], sport=1000 + i)) for i in range(MAX_FLOWS + 9)]
    recording = capture(pcap_file(packets))
    assert len(all_chunks(recording)) == MAX_FLOWS
    assert any("first 256" in note for note in recording.notes)


def test_other_traffic_is_left_out_and_counted() -> None:
    web = [linked(1, datagram(b"GET /" * 50, sport=80 + i)) for i in range(700)]
    recording = capture(pcap_file([*web, *over_udp(), *web[:5]]))
    assert joined(recording) == STREAM
    assert recording.notes == ["left out: 705 packets of other UDP or TCP traffic"]


def test_a_flow_that_begins_inside_a_frame_loses_nothing() -> None:
    cuts = [STREAM[i : i + 11] for i in range(5, len(STREAM), 11)]
    packets = [linked(1, datagram(cut)) for cut in cuts]
    assert joined(capture(pcap_file(packets))) == STREAM[5:]


def test_a_tiny_flow_that_begins_inside_a_frame() -> None:
    packets = [linked(1, datagram(FRAMES[0][5:] + FRAMES[1]))]
    assert joined(capture(pcap_file(packets))) == FRAMES[0][5:] + FRAMES[1]


def test_batches_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mavframecheck.sources.recording.BATCH_BYTES", 200)
    recording = capture(pcap_file(over_udp()))
    batches = list(recording.chunks())
    assert len(batches) > 3
    assert b"".join(chunk.data for batch in batches for chunk in batch) == STREAM


def test_fragments_are_left_out_and_counted() -> None:
    whole, part = datagram(FRAMES[0]), datagram(FRAMES[1])
    part.mf = 1
    recording = capture(pcap_file([linked(1, whole), linked(1, part)]))
    assert joined(recording) == FRAMES[0]
    assert recording.notes == ["left out: 1 fragments of IP packets"]


def test_a_link_type_that_is_not_understood() -> None:
    recording = capture(pcap_file([b"x" * 40], link=127))
    assert all_chunks(recording) == []
    assert recording.notes == ["left out: 1 packets of link type 127, which is not understood"]


class TestTcp:
    """Segments as they come: late, twice, never."""

    def stream(self, *segments: tuple[int, bytes], start: int = 0xFFFFFF00) -> bytes:
        opening = segment(b"", start - 1, tcp.TH_SYN)
        packets = [opening, *(segment(d, (start + at) & 0xFFFFFFFF) for at, d in segments)]
        return joined(capture(pcap_file([linked(1, packet) for packet in packets])))

    def test_in_order_across_the_wrap(self) -> None:
        assert self.stream(*((i, STREAM[i : i + 50]) for i in range(0, len(STREAM), 50))) == STREAM

    def test_late_repeated_and_overlapping(self) -> None:
        order = [(0, 40), (40, 60), (200, 300), (40, 60), (100, 220), (60, 100), (290, None)]
        assert self.stream(*((a, STREAM[a:b]) for a, b in order)) == STREAM

    def test_a_gap_stays_a_gap(self) -> None:
        cuts = [(i, STREAM[i : i + 5]) for i in range(0, len(STREAM), 5) if i != 100]
        assert self.stream(*cuts) == STREAM[:100] + STREAM[105:]

    def test_a_new_connection_on_the_same_ports(self) -> None:
        first, second = segment(STREAM, 1000), segment(STREAM, 5)
        opening = segment(b"", 4, tcp.TH_SYN)
        packets = [linked(1, packet) for packet in (first, opening, second)]
        assert joined(capture(pcap_file(packets))) == STREAM * 2


@pytest.mark.parametrize("cut", range(1, 200, 7))
def test_a_capture_cut_short(cut: int) -> None:
    content = pcap_file(over_udp())
    recording = capture(content[:-cut])
    assert STREAM.startswith(joined(recording))
    assert len(FRAMES) - 3 <= len(all_chunks(capture(content[:-cut]))[0].starts) < len(FRAMES)


def test_a_length_that_cannot_be_right() -> None:
    content = pcap_file(over_udp()[:2]) + struct.pack("<4I", 1, 2, 2**31, 2**31) + bytes(100)
    recording = capture(content)
    assert joined(recording) == b"".join(FRAMES[:2])
    assert "damaged near byte" in recording.notes[0]


NG = section() + interface(1) + b"".join(enhanced(p, START_US) for p in over_udp())


@pytest.mark.parametrize("content", [pcap_file(over_udp()), NG])
@given(data=st.data())
def test_damage_never_ends_badly(content: bytes, data: st.DataObject) -> None:
    spoilt = bytearray(content)
    for _ in range(data.draw(st.integers(1, 5))):
        spoilt[data.draw(st.integers(4, len(spoilt) - 1))] = data.draw(st.integers(0, 255))
    recording = capture(bytes(spoilt[: data.draw(st.integers(4, len(spoilt)))]))
    for chunk in all_chunks(recording):
        assert chunk.data


@pytest.mark.skipif(not CORPUS.is_dir(), reason=NO_CORPUS)
def test_corpus() -> None:
    for path in sorted((CORPUS / "real" / "pcap").iterdir()):
        recording = open_recording(path)
        chunks = all_chunks(recording)
        assert chunks
        assert recording.notes == []
        assert all(carries_frames(chunk.data) for chunk in chunks)
        assert all(sniff(chunk.data) is Kind.RAW for chunk in chunks)
