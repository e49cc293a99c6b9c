"""Finds what a captured packet carries over UDP or TCP, and where in the packet it lies.

Written by hand because the exact place of the payload is needed, and a general dissector looks into
every protocol it knows, at ten times the cost and with its own ways to fail on hostile packets.
"""

from __future__ import annotations

from typing import NamedTuple

TCP = 6
UDP = 17
_ETHERTYPES_IP = (0x0800, 0x86DD)
_ETHERTYPES_VLAN = (0x8100, 0x88A8, 0x9100)
_IPV6_EXTENSIONS = (0, 43, 60)  # hop by hop, routing, destination options
_IPV6_FRAGMENT = 44
_TCP_SYN = 0x02

_ETHERNET = 1
_COOKED = 113
_COOKED_2 = 276
_HEADER_BEFORE_IP = {
    0: 4,  # BSD loopback
    108: 4,  # OpenBSD loopback
    12: 0,  # raw IP, by three numbers
    14: 0,
    101: 0,
    228: 0,  # raw IPv4
    229: 0,  # raw IPv6
}
LINK_TYPES = frozenset({_ETHERNET, _COOKED, _COOKED_2, *_HEADER_BEFORE_IP})
"""The link types understood, by their tcpdump.org number."""


class Network(NamedTuple):
    """The IP layer of a packet."""

    protocol: int
    source: bytes
    target: bytes
    start: int
    """Index in the packet of what IP carries."""
    end: int
    fragment: bool


class Transport(NamedTuple):
    """The UDP or TCP layer of a packet."""

    ports: tuple[int, int]
    start: int
    """Index in the packet of the payload."""
    end: int
    sequence: int = 0
    """TCP sequence number of the first payload byte."""
    opens: bool = False
    """Whether a TCP connection begins here."""


def network(link: int, packet: bytes) -> Network | None:
    """Return the IP layer of a packet, None when there is none."""
    at = _ip_start(link, packet)
    if at is None or at >= len(packet):
        return None
    version = packet[at] >> 4
    if version == 4:
        return _ipv4(packet, at)
    return _ipv6(packet, at) if version == 6 else None


def transport(packet: bytes, ip: Network) -> Transport | None:
    """Return the UDP or TCP layer above `ip`, None when it is another protocol or cut off."""
    at, room = ip.start, ip.end - ip.start
    if ip.protocol == UDP and room >= 8:
        # Length 0 is what an offloading network card leaves behind.
        length = _u16(packet, at + 4) or room
        return Transport(_ports(packet, at), at + 8, min(ip.end, at + max(length, 8)))
    if ip.protocol != TCP or room < 20:
        return None
    header = max(packet[at + 12] >> 4, 5) * 4
    opens = bool(packet[at + 13] & _TCP_SYN)
    sequence = (int.from_bytes(packet[at + 4 : at + 8], "big") + opens) & 0xFFFFFFFF
    return Transport(_ports(packet, at), min(at + header, ip.end), ip.end, sequence, opens)


def _u16(packet: bytes, at: int) -> int:
    """Read a big-endian 16-bit number, as far as the packet goes."""
    return int.from_bytes(packet[at : at + 2], "big")


def _ports(packet: bytes, at: int) -> tuple[int, int]:
    return _u16(packet, at), _u16(packet, at + 2)


def _ip_start(link: int, packet: bytes) -> int | None:
    """Index of the IP header behind the link layer, None when the packet is not IP."""
    if link in _HEADER_BEFORE_IP:
        return _HEADER_BEFORE_IP[link]
    if link == _COOKED_2:
        return 20 if _u16(packet, 0) in _ETHERTYPES_IP else None
    at = 12 if link == _ETHERNET else 14
    while _u16(packet, at) in _ETHERTYPES_VLAN:
        at += 4
    return at + 2 if _u16(packet, at) in _ETHERTYPES_IP else None


def _ipv4(packet: bytes, at: int) -> Network | None:
    header = (packet[at] & 15) * 4
    if header < 20 or at + header > len(packet):
        return None
    # Length 0 is what an offloading network card leaves behind.
    length = _u16(packet, at + 2) or len(packet) - at
    fragment = _u16(packet, at + 6) & 0x3FFF != 0
    addresses = packet[at + 12 : at + 16], packet[at + 16 : at + 20]
    end = min(len(packet), at + max(length, header))
    return Network(packet[at + 9], *addresses, at + header, end, fragment)


def _ipv6(packet: bytes, at: int) -> Network | None:
    if at + 40 > len(packet):
        return None
    length = _u16(packet, at + 4) or len(packet)
    end = min(len(packet), at + 40 + length)
    protocol, start, fragment = packet[at + 6], at + 40, False
    while start + 8 <= end and protocol in (*_IPV6_EXTENSIONS, _IPV6_FRAGMENT):
        if protocol == _IPV6_FRAGMENT:
            fragment |= _u16(packet, start + 2) & 0xFFF9 != 0
            size = 8
        else:
            size = (packet[start + 1] + 1) * 8
        protocol, start = packet[start], start + size
    addresses = packet[at + 8 : at + 24], packet[at + 24 : at + 40]
    return Network(protocol, *addresses, min(start, end), end, fragment)
