"""Recordings made up for these tests: frames by pymavlink, packets by dpkt."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable
from pathlib import Path

from dpkt import ethernet, ip, ip6, pcap, sll, sll2, tcp, udp
from pymavlink.dialects.v10 import ardupilotmega as mavlink1
from pymavlink.dialects.v20 import ardupilotmega as mavlink2

from mavframecheck.sources import Recording
from mavframecheck.wire.chunk import Chunk

CORPUS = Path(__file__).resolve().parents[3] / "shared" / "corpus"
NO_CORPUS = "the recordings are not here: they live beside the checkout, in ../shared/corpus"
START_US = 1_772_619_072_000_000
GCS, VEHICLE = b"\x0a\0\0\1", b"\x0a\0\0\2"


def frames(count: int, version: int = 2, *, signed: bool = False) -> list[bytes]:
    """Write ATTITUDE messages as one vehicle sends them."""
    dialect = mavlink1 if version == 1 else mavlink2
    link = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    if signed:
        link.signing.sign_outgoing = True
        link.signing.secret_key = b"k" * 32
    made = []
    for index in range(count):
        message = dialect.MAVLink_attitude_message(index * 100, 0.1, -0.2, index / 7, 0, 0, 0.3)
        made.append(bytes(message.pack(link)))
        link.seq = (link.seq + 1) % 256
    return made


def tlog(written: Iterable[bytes], start_us: int = START_US) -> bytes:
    """Put a stamp before each frame, 100 ms apart."""
    return b"".join(
        struct.pack(">Q", start_us + 100_000 * index) + frame for index, frame in enumerate(written)
    )


def datagram(payload: bytes, source: bytes = VEHICLE, sport: int = 14550) -> ip.IP | ip6.IP6:
    """Wrap a payload in UDP and IP, version 4 or 6 by the length of the address."""
    inner = udp.UDP(sport=sport, dport=14551, ulen=8 + len(payload), data=payload)
    return _over_ip(inner, source, ip.IP_PROTO_UDP)


def segment(payload: bytes, seq: int, flags: int = tcp.TH_ACK) -> ip.IP | ip6.IP6:
    """Wrap a payload in TCP and IP."""
    inner = tcp.TCP(sport=5760, dport=40000, seq=seq, flags=flags, data=payload)
    return _over_ip(inner, VEHICLE, ip.IP_PROTO_TCP)


def _over_ip(inner: tcp.TCP | udp.UDP, source: bytes, protocol: int) -> ip.IP | ip6.IP6:
    if len(source) == 16:
        packet = ip6.IP6(src=source, dst=b"\xfe" * 16, nxt=protocol, data=inner, plen=len(inner))
        packet.extension_hdrs = {}
        packet.all_extension_headers = []
        return packet
    packet = ip.IP(src=source, dst=GCS, p=protocol, data=inner)
    packet.len = len(packet)
    return packet


def linked(link: int, packet: ip.IP | ip6.IP6) -> bytes:
    """Put a link layer before an IP packet."""
    version6 = isinstance(packet, ip6.IP6)
    kind = ethernet.ETH_TYPE_IP6 if version6 else ethernet.ETH_TYPE_IP
    heads = {
        pcap.DLT_NULL: struct.pack("<I", 30 if version6 else 2),
        108: struct.pack(">I", 24 if version6 else 2),
        pcap.DLT_EN10MB: bytes(ethernet.Ethernet(type=kind)),
        pcap.DLT_LINUX_SLL: bytes(sll.SLL(ethtype=kind)),
        pcap.DLT_LINUX_SLL2: bytes(sll2.SLL2(ethtype=kind)),
    }
    padding = b"\0" * 6 if link == pcap.DLT_EN10MB else b""
    return heads.get(link, b"") + bytes(packet) + padding


def pcap_file(packets: Iterable[bytes], link: int = 1, *, nano: bool = False) -> bytes:
    """Write packets 100 ms apart."""
    file = io.BytesIO()
    writer = pcap.Writer(file, linktype=link, nano=nano)
    for index, packet in enumerate(packets):
        writer.writepkt_time(packet, START_US / 1e6 + index / 10)
    return file.getvalue()


def block(kind: int, body: bytes, order: str = "<") -> bytes:
    """Frame the body of a pcapng block."""
    body += b"\0" * (-len(body) % 4)
    size = 12 + len(body)
    return struct.pack(f"{order}II", kind, size) + body + struct.pack(f"{order}I", size)


def section(order: str = "<") -> bytes:
    """Begin a pcapng section."""
    return block(0x0A0D0D0A, struct.pack(f"{order}IHHq", 0x1A2B3C4D, 1, 0, -1), order)


def interface(link: int, resolution: int | None = None, order: str = "<") -> bytes:
    """Describe a pcapng interface; resolution is the exponent, microseconds if not given."""
    option = b"" if resolution is None else struct.pack(f"{order}HHB3xI", 9, 1, resolution, 0)
    return block(1, struct.pack(f"{order}HHI", link, 0, 65535) + option, order)


def enhanced(packet: bytes, ticks: int, number: int = 0, order: str = "<") -> bytes:
    """Write a packet of interface `number`."""
    head = (number, ticks >> 32, ticks & 0xFFFFFFFF, len(packet), len(packet))
    return block(6, struct.pack(f"{order}5I", *head) + packet, order)


def all_chunks(recording: Recording) -> list[Chunk]:
    """Read a recording to its end."""
    with recording:
        return [chunk for batch in recording.chunks() for chunk in batch]


def joined(recording: Recording, flow: int = 0) -> bytes:
    """Read all bytes of one flow."""
    return b"".join(chunk.data for chunk in all_chunks(recording) if chunk.flow == flow)
