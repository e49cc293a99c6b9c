"""The parts of a link that need no peer: time, the inbox, the recorder, a followed file."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from mavframecheck.sources import SourceError
from mavframecheck.sources.links.clock import Clock
from mavframecheck.sources.links.follow import Follower
from mavframecheck.sources.links.link import MAX_PEERS, Inbox, checked
from mavframecheck.sources.links.recorder import Recorder
from samples.make import HERE


def test_clock_that_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stamps go on; by how much the clock was set is told once."""
    clock = Clock()
    before, real = clock.now_us(), time.time
    assert clock.jump_s() is None
    monkeypatch.setattr(time, "time", lambda: real() - 3600)
    assert clock.jump_s() == pytest.approx(-3600, abs=1)
    assert clock.jump_s() is None
    assert 0 <= clock.now_us() - before < 60_000_000


def test_peers_have_flows_of_their_own() -> None:
    """Bytes keep their order of arrival as offsets; too many peers share a flow."""
    inbox = Inbox(Clock())
    for number in range(MAX_PEERS + 5):
        inbox.put(b"ab", number)
    inbox.put(b"cd", 0)
    chunks = inbox.chunks()
    assert len(chunks) == MAX_PEERS + 1
    assert (chunks[0].data, chunks[0].offsets.tolist()) == (b"abcd", [0, 2 * (MAX_PEERS + 5)])
    assert chunks[-1].data == b"ab" * 5
    assert inbox.chunks() == []


def test_inbox_is_bounded() -> None:
    """What comes while too much waits is dropped and counted."""
    inbox = Inbox(Clock(), room=10)
    for _ in range(3):
        inbox.put(b"123456", None)
    assert (inbox.dropped(), inbox.dropped()) == (12, 0)
    assert [chunk.data for chunk in inbox.chunks()] == [b"123456"]
    inbox.put(b"123456", None)
    assert inbox.dropped() == 0


@pytest.mark.parametrize(
    "address",
    [
        *("udpin:0.0.0.0:14550", "udpout:gcs.local:1", "tcp:h:65535", "tcpin:h:1"),
        *("/dev/ttyACM0,57600", "/dev/serial/by-id/usb-FTDI", "COM3", "com12,115200"),
    ],
)
def test_links(address: str) -> None:
    assert checked(address) == address


@pytest.mark.parametrize(
    "address",
    ["", "udpin:1", "udp:h:1", "tcp:h:0", "tcp:h:65536", "file.tlog", "COMX", "tcp:h:1:2"],
)
def test_no_links(address: str) -> None:
    with pytest.raises(SourceError, match="a link is udpin:HOST:PORT"):
        checked(address)


def test_recorder(tmp_path: Path) -> None:
    """What was written is there at once; a file is never written over."""
    path = tmp_path / "new.tlog"
    recorder = Recorder(path)
    recorder.write(b"one")
    recorder.write(b"")
    assert path.read_bytes() == b"one"
    with pytest.raises(SourceError, match="record under another name"):
        Recorder(path)
    recorder.close()
    with pytest.raises(SourceError, match="cannot be written"):
        Recorder(tmp_path / "nowhere" / "new.tlog")


def test_follow(tmp_path: Path) -> None:
    """A file is read as it grows, and from its start when it was begun again."""
    data, path = (HERE / "clean_copter.tlog").read_bytes(), tmp_path / "growing.tlog"
    path.write_bytes(data[:500])
    file = Follower(path)
    assert (file.read(), file.read()) == (data[:500], b"")
    path.write_bytes(data)
    assert not file.began_again()
    assert file.read() == data[500:]
    path.write_bytes(data[:100])
    assert file.began_again()
    assert file.read() == data[:100]
    file.close()


def test_not_to_be_followed(tmp_path: Path) -> None:
    path = tmp_path / "plan.plan"
    path.write_text('{"fileType": "Plan"}')
    with pytest.raises(SourceError, match="plan"):
        Follower(path)
    with pytest.raises(SourceError, match="name a tlog"):
        Follower(tmp_path / "nothing.tlog")
