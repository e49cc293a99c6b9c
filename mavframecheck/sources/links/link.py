"""A link to a vehicle: pymavlink opens it, a thread of its own reads it, and nothing is sent unasked.

Bytes are stamped when they are received. Datagrams of different peers are different flows, so that
frames of one are never torn by those of another.
"""

from __future__ import annotations

import re
import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from mavframecheck.sources.links.clock import Clock
from mavframecheck.sources.stream import SourceError
from mavframecheck.wire.chunk import Chunk

RETRY_S = 1.0
"""Between attempts to open a link that went away (s)."""
PATIENCE_S = 0.2
"""How long a read waits (s) before it looks whether the link is to be closed."""
MAX_PEERS = 64
"""Peers of a port whose bytes are kept apart; further ones share a flow."""
MAX_WAITING = 64 * 1024 * 1024
"""Bytes that may wait to be read; what comes then is dropped, and said."""
_BUFFER = 4 * 1024 * 1024
_DATAGRAM = 65535
_NETWORK = re.compile(r"(udpin|udpout|tcp|tcpin):([^:]+):(\d{1,5})")
_SERIAL = re.compile(r"(/dev/.+|COM\d+(,\d+)?)", re.IGNORECASE)
_FORMS = (
    "a link is udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT, "
    "or a serial port with its speed, such as /dev/ttyUSB0,57600 or COM3,57600"
)


def checked(address: str) -> str:
    """Return `address` if it names a link; SourceError tells what links look like."""
    network = _NETWORK.fullmatch(address)
    if network is not None and 0 < int(network[3]) < 65536:
        return address
    if network is None and _SERIAL.fullmatch(address):
        return address
    raise SourceError(f"{address}: {_FORMS}")


class Piece(NamedTuple):
    """Bytes as one read gave them."""

    t_us: int
    peer: int
    data: bytes


class News(NamedTuple):
    """The port opened, or closed and why."""

    open: bool
    why: str


class Inbox:
    """What came over one link, and perhaps over its relay, in the order in which it came."""

    def __init__(self, clock: Clock, room: int = MAX_WAITING) -> None:
        """Stamp what comes with the time of `clock`; keep at most `room` bytes until they are taken."""
        self._clock = clock
        self._room = room
        self._pieces: deque[Piece] = deque()
        self._lock = threading.Lock()
        self._waiting = 0
        self._taken = 0
        self._dropped = 0
        self._peers: dict[object, int] = {}

    def put(self, data: bytes, peer: object) -> None:
        """Add bytes of `peer`, received now."""
        t_us = self._clock.now_us()
        with self._lock:
            if self._waiting + len(data) > self._room:
                self._dropped += len(data)
                return
            if peer not in self._peers and len(self._peers) < MAX_PEERS:
                self._peers[peer] = len(self._peers)
            self._waiting += len(data)
            self._pieces.append(Piece(t_us, self._peers.get(peer, MAX_PEERS), data))

    def chunks(self) -> list[Chunk]:
        """Return what came since the last call: a chunk for each flow."""
        with self._lock:
            pieces, self._pieces, self._waiting = self._pieces, deque(), 0
        flows: dict[int, list[tuple[int, Piece]]] = {}
        for piece in pieces:
            flows.setdefault(piece.peer, []).append((self._taken, piece))
            self._taken += len(piece.data)
        return [_chunk(flow, came) for flow, came in sorted(flows.items())]

    def dropped(self) -> int:
        """Return the bytes dropped since the last call, because too many waited."""
        with self._lock:
            dropped, self._dropped = self._dropped, 0
        return dropped


class Link:
    """One link, read in a thread from `start` to `close`; it opens again when it went away."""

    def __init__(self, address: str, inbox: Inbox) -> None:
        """Read from `address`, as pymavlink writes it, into `inbox`; SourceError when it is no link."""
        self.name = checked(address)
        self.news: deque[News] = deque()
        """What happened to the port; the reader of the link takes it from here."""
        self.forward: Callable[[bytes], None] | None = None
        """Is given all that comes, at once and unchanged."""
        self._inbox = inbox
        self._connection: Any = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"link {address}", daemon=True)

    def start(self) -> None:
        """Begin to read; SourceError when a port of this computer cannot be had."""
        if self.name.startswith(("udp", "tcpin")):
            try:
                self._connection = _opened(self.name)
            except (OSError, ValueError) as error:
                raise SourceError(f"{self.name}: {_said(error)}; choose another port") from error
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Send bytes to whoever is on the link; what cannot be sent is lost, as on any link."""
        connection = self._connection
        if connection is None:
            return
        with suppress(OSError):
            if isinstance(connection.port, socket.socket) and not hasattr(connection, "clients"):
                connection.port.sendall(data)
            elif connection.port is not None:
                connection.write(data)

    def close(self) -> None:
        """Stop reading and close the port."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        failed = ""
        while not self._stop.is_set():
            try:
                self._connection = self._connection or _opened(self.name)
                self.news.append(News(True, "open"))
                failed = ""
                for data, peer in _received(self._connection, self._stop):
                    self._put(data, peer)
                why = "the other side closed it"
            except (OSError, ValueError, ModuleNotFoundError) as error:
                why = _said(error)
            if self._connection is not None:
                with suppress(OSError):
                    self._connection.close()
                self._connection = None
            if why != failed and not self._stop.is_set():
                self.news.append(News(False, why))
                failed = why
            self._stop.wait(RETRY_S)

    def _put(self, data: bytes, peer: object) -> None:
        self._inbox.put(data, (self.name, peer))
        if self.forward is not None:
            self.forward(data)


def _chunk(flow: int, came: list[tuple[int, Piece]]) -> Chunk:
    """Return the pieces of one flow, each with its place among all bytes of the link."""
    sizes = [len(piece.data) for _, piece in came]
    return Chunk(
        b"".join(piece.data for _, piece in came),
        np.cumsum([0, *sizes[:-1]]),
        np.array([offset for offset, _ in came]),
        np.array([piece.t_us for _, piece in came]),
        flow,
    )


def _opened(address: str) -> Any:
    """Have pymavlink open a link; OSError when that fails."""
    from pymavlink import mavutil

    connection = mavutil.mavlink_connection(address, retries=1)
    if address.startswith("udp"):
        with suppress(OSError):  # as much as the system lets us have
            connection.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
    return connection


def _received(connection: Any, stop: threading.Event) -> Iterator[tuple[bytes, object]]:
    """Yield what comes over an open link, and from whom, until it closes or is to stop."""
    port = connection.port
    if hasattr(connection, "listen"):
        port = _accepted(connection, stop)
    if isinstance(port, socket.socket):
        port.settimeout(PATIENCE_S)
        yield from (
            _datagrams(connection, stop)
            if hasattr(connection, "udp_server")
            else _stream(port, stop)
        )
    elif port is not None:
        yield from _serial(port, stop)


def _accepted(connection: Any, stop: threading.Event) -> socket.socket | None:
    """Wait for somebody who connects."""
    connection.listen.settimeout(PATIENCE_S)
    while not stop.is_set():
        with suppress(TimeoutError):
            connection.port, _ = connection.listen.accept()
            port: socket.socket = connection.port
            return port
    return None


def _datagrams(connection: Any, stop: threading.Event) -> Iterator[tuple[bytes, object]]:
    while not stop.is_set():
        with suppress(TimeoutError, ConnectionRefusedError, ConnectionResetError):
            data, peer = connection.port.recvfrom(_DATAGRAM)
            if connection.udp_server and len(connection.clients) < MAX_PEERS:
                connection.clients.add(peer)  # whom pymavlink answers
            yield data, peer


def _stream(port: socket.socket, stop: threading.Event) -> Iterator[tuple[bytes, object]]:
    while not stop.is_set():
        with suppress(TimeoutError):
            data = port.recv(_DATAGRAM)
            if not data:
                return
            yield data, None


def _serial(port: Any, stop: threading.Event) -> Iterator[tuple[bytes, object]]:
    port.timeout = PATIENCE_S
    while not stop.is_set():
        data = port.read(1)
        if data:
            yield data + port.read(port.in_waiting), None


def _said(error: Exception) -> str:
    """Return in plain words why a link cannot be opened or went away."""
    if isinstance(error, ModuleNotFoundError) and error.name == "serial":
        return "serial ports need pyserial: pip install 'mavframecheck[serial]'"
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return reason or type(error).__name__
