"""Packet captures: pcap and pcapng files with MAVLink over UDP or TCP."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

from dpkt import dpkt, pcap, pcapng

from mavframecheck.sources.flows import MAX_FLOWS, Flows, Piece
from mavframecheck.sources.layers import LINK_TYPES, TCP, network, transport
from mavframecheck.sources.sniff import Kind
from mavframecheck.sources.stream import ByteStream
from mavframecheck.wire.chunk import Chunk

_DAMAGE = (dpkt.Error, ValueError, struct.error, EOFError)
_LARGEST_READ = 1 << 24  # no packet or block is longer; a damaged length must not fill the memory
_LARGEST_US = (1 << 63) - 1
_BYTE_ORDERS = {b"\x4d\x3c\x2b\x1a": "<", b"\x1a\x2b\x3c\x4d": ">"}
_SECTION, _INTERFACE, _PACKET, _SIMPLE_PACKET, _ENHANCED_PACKET = 0x0A0D0D0A, 1, 2, 3, 6
_BLOCKS = {
    ("<", _INTERFACE): pcapng.InterfaceDescriptionBlockLE,
    (">", _INTERFACE): pcapng.InterfaceDescriptionBlock,
    ("<", _PACKET): pcapng.PacketBlockLE,
    (">", _PACKET): pcapng.PacketBlock,
    ("<", _ENHANCED_PACKET): pcapng.EnhancedPacketBlockLE,
    (">", _ENHANCED_PACKET): pcapng.EnhancedPacketBlock,
}
_PACKET_DATA = 28  # bytes of both kinds of packet block before the packet
_PACKET_FRAME = 32  # and with the length repeated at the end


class _Packet(NamedTuple):
    link: int
    t_us: int
    offset: int
    data: bytes


class _Interface(NamedTuple):
    link: int
    ticks_per_s: int
    start_s: int


class _Exact:
    """The file that dpkt reads: it gets what it asks for, nothing at a clean end, or an error."""

    def __init__(self, stream: ByteStream) -> None:
        self.stream = stream

    def read(self, size: int) -> bytes:
        if not 0 <= size <= _LARGEST_READ:
            raise ValueError(f"a length of {size} bytes cannot be right")
        data = self.stream.read(size)
        if 0 < len(data) < size:
            raise EOFError("the last packet is cut off")
        return data


def read_capture(
    stream: ByteStream, kind: Kind, notes: list[str], batch_bytes: int
) -> Iterator[list[Chunk]]:
    """Yield the MAVLink in a capture by batches; damage and omissions are said in `notes`."""
    flows, omitted = Flows(), Counter[str]()
    file = _Exact(stream)
    try:
        for packet in _pcap_packets(file) if kind is Kind.PCAP else _pcapng_packets(file, omitted):
            _sort_in(packet, flows, omitted)
            if flows.weight >= batch_bytes:
                yield flows.drain()
    except _DAMAGE as error:
        notes.append(
            f"the capture is damaged near byte {stream.position} ({error}); read up to there"
        )
    if rest := flows.finish():
        yield rest
    omitted["packets of other UDP or TCP traffic"] += flows.other_packets
    notes += [f"left out: {count} {what}" for what, count in sorted(omitted.items()) if count]
    if flows.over_limit:
        notes.append(f"only the first {MAX_FLOWS} MAVLink connections of the capture are read")


def _sort_in(packet: _Packet, flows: Flows, omitted: Counter[str]) -> None:
    """Hand the payload of a packet to its flow."""
    if packet.link not in LINK_TYPES:
        omitted[f"packets of link type {packet.link}, which is not understood"] += 1
        return
    ip = network(packet.link, packet.data)
    if ip is None:
        return
    if ip.fragment:
        omitted["fragments of IP packets"] += 1
        return
    load = transport(packet.data, ip)
    if load is None or (load.start == load.end and not load.opens):
        return
    key = (ip.source, load.ports[0], ip.target, load.ports[1], ip.protocol)
    piece = Piece(packet.data[load.start : load.end], packet.offset + load.start, packet.t_us)
    if ip.protocol == TCP:
        flows.segment(key, load.sequence, load.opens, piece)
    else:
        flows.datagram(key, piece)


def _pcap_packets(file: _Exact) -> Iterator[_Packet]:
    """Read the packets of a pcap file."""
    reader = pcap.Reader(file)
    for time_s, data in reader:
        yield _Packet(
            reader.datalink(), round(time_s * 1_000_000), file.stream.position - len(data), data
        )


def _pcapng_packets(file: _Exact, omitted: Counter[str]) -> Iterator[_Packet]:
    """Read the packets of a pcapng file.

    Block by block, because dpkt's own reader knows one interface and one section only.
    """
    interfaces: list[_Interface] = []
    for order, kind, offset, block in _blocks(file):
        if kind == _SECTION:
            interfaces = []
        elif kind == _INTERFACE:
            interfaces.append(_interface(order, block))
        elif kind in (_PACKET, _ENHANCED_PACKET):
            try:
                packet = _packet(_BLOCKS[order, kind](block), interfaces, offset)
            except _DAMAGE:
                omitted["damaged packets"] += 1
            else:
                yield packet
        elif kind == _SIMPLE_PACKET:
            omitted["packets without a time"] += 1


def _blocks(file: _Exact) -> Iterator[tuple[str, int, int, bytes]]:
    """Read the blocks of a pcapng file: byte order, kind, offset in the file, bytes."""
    order = "<"
    while start := file.read(8):
        offset = file.stream.position - len(start)
        if start.startswith(_SECTION.to_bytes(4, "big")):
            start += file.read(4)
            order = _byte_order(start)
        kind, size = struct.unpack_from(f"{order}II", start)
        block = start + file.read(size - len(start))
        if len(block) < size:
            raise EOFError("the last block is cut off")
        yield order, kind, offset, block


def _byte_order(section: bytes) -> str:
    """Return the byte order that a section header announces."""
    try:
        return _BYTE_ORDERS[section[8:12]]
    except KeyError:
        raise ValueError("a section has no byte order") from None


def _interface(order: str, block: bytes) -> _Interface:
    """Read how an interface writes packets and times: in microseconds if its options are damaged."""
    (link,) = struct.unpack_from(f"{order}H", block, 8)
    ticks_per_s, start_s = 1_000_000, 0
    try:
        for option in _BLOCKS[order, _INTERFACE](block).opts:
            if option.code == pcapng.PCAPNG_OPT_IF_TSRESOL:
                base = 2 if option.data[0] & 0x80 else 10
                ticks_per_s = base ** (option.data[0] & 0x7F)
            elif option.code == pcapng.PCAPNG_OPT_IF_TSOFFSET:
                (start_s,) = struct.unpack(f"{order}q", option.data)
    except (*_DAMAGE, IndexError):
        pass
    return _Interface(link, ticks_per_s, start_s)


def _packet(block: Any, interfaces: list[_Interface], offset: int) -> _Packet:
    """Turn a packet block of dpkt into a packet."""
    if block.iface_id >= len(interfaces) or block.caplen > block.len - _PACKET_FRAME:
        raise ValueError("a packet block contradicts itself")
    link, ticks_per_s, start_s = interfaces[block.iface_id]
    ticks = block.ts_high << 32 | block.ts_low
    t_us = start_s * 1_000_000 + ticks * 1_000_000 // ticks_per_s
    t_us = max(-_LARGEST_US, min(t_us, _LARGEST_US))
    return _Packet(link, t_us, offset + _PACKET_DATA, block.pkt_data)
