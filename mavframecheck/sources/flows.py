"""Sorts the payloads of a capture into byte streams, one per direction and peer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mavframecheck.sources.sniff import Kind, carries_frames, sniff
from mavframecheck.wire.chunk import Chunk

MAX_FLOWS = 256
"""How many MAVLink flows of one capture are read."""
_MAX_WATCHED = 512  # flows not known to be MAVLink of which we keep track
_TRIAL_WEIGHT = 16 * 1024  # a flow without frames in so much is other traffic
_PIECE_WEIGHT = 32  # what a piece weighs beside its bytes: a serial bridge may send one byte each
_MAX_WAITING = 32  # TCP segments held back for one that is missing
_MAX_WAITING_BYTES = 32 * 1024
_WINDOW = 1 << 24  # a TCP sequence number further off belongs to a new connection

FlowKey = tuple[bytes, int, bytes, int, int]
"""Source address and port, target address and port, protocol."""


class Piece(NamedTuple):
    """The payload of one packet."""

    data: bytes
    offset: int
    """Byte offset in the capture."""
    t_us: int
    """When it was captured, us since 1970."""

    def skip(self, count: int) -> Piece:
        """Return it without its first `count` bytes."""
        return Piece(self.data[count:], self.offset + count, self.t_us) if count else self


class TcpOrder:
    """Puts the segments of one TCP direction in order; a gap stays once too many wait for it."""

    def __init__(self) -> None:
        self._next: int | None = None
        self._waiting: dict[int, Piece] = {}

    def add(self, sequence: int, opens: bool, piece: Piece) -> list[Piece]:
        """Take a segment and return what is now in order; repeated bytes are dropped."""
        ready = []
        if self._next is None or opens or abs(self._ahead(sequence)) > _WINDOW:
            ready = self.flush()
            self._next = sequence
        held = self._waiting.get(sequence)
        if held is None or len(held.data) < len(piece.data):
            self._waiting[sequence] = piece
        ready += self._in_order()
        while self._too_many_wait():
            ready += self._jump()
        return ready

    def flush(self) -> list[Piece]:
        """Return all that waits, in order, across the gaps."""
        ready: list[Piece] = []
        while self._waiting:
            ready += self._jump()
        return ready

    def _too_many_wait(self) -> bool:
        """Whether it is time to stop hoping for the missing segment."""
        size = sum(len(piece.data) for piece in self._waiting.values())
        return len(self._waiting) > _MAX_WAITING or size > _MAX_WAITING_BYTES

    def _jump(self) -> list[Piece]:
        """Give up the missing segment before the first that waits."""
        self._next = min(self._waiting, key=self._ahead)
        return self._in_order()

    def _in_order(self) -> list[Piece]:
        """Take out the segments that continue the stream."""
        ready = []
        for sequence in sorted(self._waiting, key=self._ahead):
            if (ahead := self._ahead(sequence)) > 0:
                break
            fresh = self._waiting.pop(sequence).skip(-ahead)
            if fresh.data:
                ready.append(fresh)
                self._next = ((self._next or 0) + len(fresh.data)) & 0xFFFFFFFF
        return ready

    def _ahead(self, sequence: int) -> int:
        """How far `sequence` lies ahead of the next expected, with the 32-bit wrap."""
        return ((sequence - (self._next or 0) + (1 << 31)) & 0xFFFFFFFF) - (1 << 31)


class _Flow:
    """One byte stream: a candidate first, numbered once it is known to carry MAVLink."""

    def __init__(self) -> None:
        self.order = TcpOrder()
        self.number: int | None = None
        self.other = False
        self.pieces: list[Piece] = []

    def joined(self) -> bytes:
        return b"".join(piece.data for piece in self.pieces)


class Flows:
    """The byte streams of a capture that carry MAVLink, numbered in the order they show it."""

    def __init__(self) -> None:
        self.weight = 0
        """How much waits for `drain`: its bytes and a little for each piece."""
        self.other_packets = 0
        """Packets that belong to no MAVLink flow."""
        self.over_limit = False
        """Whether MAVLink flows beyond MAX_FLOWS were left out."""
        self._watched: dict[FlowKey, _Flow] = {}
        self._numbered: dict[FlowKey, _Flow] = {}

    def datagram(self, key: FlowKey, piece: Piece) -> None:
        """Add a UDP payload."""
        self._append(self._flow(key), key, [piece])

    def segment(self, key: FlowKey, sequence: int, opens: bool, piece: Piece) -> None:
        """Add a TCP payload, which may come late, twice or never."""
        flow = self._flow(key)
        pieces = [piece] if flow.other else flow.order.add(sequence, opens, piece)
        self._append(flow, key, pieces)

    def drain(self) -> list[Chunk]:
        """Return the bytes gathered since the last call, a chunk per flow that has any."""
        flows = [flow for flow in self._numbered.values() if flow.pieces]
        chunks = [_chunk(flow) for flow in flows]
        for flow in flows:
            flow.pieces = []
        self.weight = 0
        return chunks

    def finish(self) -> list[Chunk]:
        """Return the rest at the end of the capture."""
        for key, flow in [*self._numbered.items(), *self._watched.items()]:
            self._append(flow, key, flow.order.flush())
        if not self._numbered:
            for key, flow in list(self._watched.items()):
                if sniff(flow.joined()) is Kind.RAW:
                    self._admit(flow, key)
        self.other_packets += sum(len(flow.pieces) for flow in self._watched.values())
        return self.drain()

    def _flow(self, key: FlowKey) -> _Flow:
        """Return the flow of `key`; when too many are watched the oldest candidate is forgotten."""
        flow = self._numbered.get(key) or self._watched.get(key)
        if flow is None:
            if len(self._watched) >= _MAX_WATCHED:
                oldest = self._watched.pop(next(iter(self._watched)))
                self.other_packets += len(oldest.pieces)
            flow = self._watched[key] = _Flow()
        return flow

    def _append(self, flow: _Flow, key: FlowKey, pieces: list[Piece]) -> None:
        """Add pieces in their order and decide about the flow when that is still open."""
        if flow.other:
            self.other_packets += len(pieces)
            return
        flow.pieces += pieces
        if flow.number is not None:
            self.weight += _weight(pieces)
        elif pieces and carries_frames(flow.joined()):
            self._admit(flow, key)
        elif _weight(flow.pieces) > _TRIAL_WEIGHT:
            self._reject(flow)

    def _admit(self, flow: _Flow, key: FlowKey) -> None:
        """Give a flow that carries MAVLink its number, while there is room."""
        if len(self._numbered) == MAX_FLOWS:
            self.over_limit = True
            self._reject(flow)
            return
        flow.number = len(self._numbered)
        self._numbered[key] = self._watched.pop(key)
        self.weight += _weight(flow.pieces)

    def _reject(self, flow: _Flow) -> None:
        """Stop looking into a flow."""
        flow.other = True
        self.other_packets += len(flow.pieces)
        flow.pieces = []


def _weight(pieces: list[Piece]) -> int:
    """How much memory pieces take, about."""
    return sum(len(piece.data) + _PIECE_WEIGHT for piece in pieces)


def _chunk(flow: _Flow) -> Chunk:
    """Join the pieces of a flow."""
    data, offsets, t_us = zip(*flow.pieces, strict=True)
    ends = np.cumsum([len(piece) for piece in data], dtype=np.int64)
    starts = np.concatenate([np.zeros(1, np.int64), ends[:-1]])
    times = np.array(t_us, np.int64)
    return Chunk(b"".join(data), starts, np.array(offsets, np.int64), times, flow.number or 0)
