"""`watch` on real sockets: what it says, what it records, and how it ends."""

from __future__ import annotations

import functools
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import pytest
from click.testing import CliRunner
from pymavlink import mavutil

from mavframecheck.cli import main
from mavframecheck.cli.watching import Watch, Wishes
from mavframecheck.engine import Settings
from mavframecheck.engine.live.notify import COMPONENT
from mavframecheck.model import Finding, Severity
from mavframecheck.model.contract import Deviation
from mavframecheck.model.live import Change, Event
from mavframecheck.report import Checked
from mavframecheck.sources.links import clock, link
from mavframecheck.wire.encode import stamped
from samples.make import HERE
from tests.engine.judged import judge, shipped
from tests.links import PATIENCE_S, free_port, peer, records, wait_for
from tests.strategies import DIALECT, frame

SAMPLE = HERE / "degrees_in_scaled_field.tlog"
CORPUS = Path(__file__).parents[3] / "shared" / "corpus" / "sitl"
posix = pytest.mark.skipif(os.name != "posix", reason="signals and pseudo-terminals are of POSIX")


class Heard:
    """Keeps what a watch says."""

    wants_meaning = False

    def __init__(self) -> None:
        self.said: list[Change | Event] = []
        self.differ: Sequence[Deviation] | None = None
        self.results: Sequence[Checked] = ()

    def say(self, said: Sequence[Change | Event]) -> None:
        self.said += said

    def show(self, watched: Any, now: float) -> None:
        pass

    def end(self, results: Sequence[Checked], differ: Sequence[Deviation] | None) -> None:
        self.results, self.differ = results, differ

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def events(self) -> list[str]:
        return [each.what for each in self.said if isinstance(each, Event)]

    def found(self) -> list[str]:
        return [e.finding.code for e in self.said if isinstance(e, Change) and e.what == "found"]


class Stage:
    """A watch whose ticks and time are the test's."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *links: str, **wishes: Any) -> None:
        self.t_us = 1_800_000_000_000_000
        self.jump_s: float | None = None
        monkeypatch.setattr(clock.Clock, "now_us", lambda _: self.t_us)
        monkeypatch.setattr(clock.Clock, "jump_s", lambda _: self.jump_s)
        self.heard = Heard()
        self.watch = Watch(Wishes(links=links, **wishes), shipped(), Settings(), DIALECT)
        self.watch.start(meaning=False)

    def tick(self, seconds: float = 0.0) -> None:
        """Let time pass and see what came."""
        self.t_us += round(seconds * 1e6)
        self.watch.tick(self.heard)

    def until(self, *events: str) -> None:
        """See what comes until all of `events` were said."""
        self.sees(lambda: set(events) <= set(self.heard.events()))

    def sees(self, happened: Callable[[], object]) -> None:
        """See what comes until something happened."""

        def ticked() -> object:
            self.tick()
            return happened()

        wait_for(ticked)

    def waiting(self, place: int = 0) -> int:
        """Return the bytes that were received on a link and not looked at."""
        line: Any = self.watch.watched[place].line
        waiting: int = line._inbox._waiting
        return waiting

    def replay(self, tlog: bytes, sender: Any, batch: int = 2000, place: int = 0) -> None:
        """Send the frames of a tlog one by one, each received at its own time."""
        for number, (t_us, data) in enumerate(records(tlog)):
            self.t_us = t_us
            before = self.waiting(place)
            sender.write(data)
            self.received(place, before + len(data))
            if number % batch == batch - 1:
                self.tick()
        self.tick()

    def received(self, place: int, size: int) -> None:
        """Wait until so many bytes are received and not looked at."""
        wait_for(lambda: self.waiting(place) == size)

    def end(self) -> int:
        return self.watch._end(self.heard)


def without_file(findings: Sequence[Finding]) -> list[tuple[Any, ...]]:
    """Return all that findings say but the file they are about."""
    names = [name for name in Finding.__struct_fields__ if name != "file"]
    return [tuple(getattr(each, name) for name in names) for each in findings]


def recordings() -> list[Any]:
    name = CORPUS / "fault_copter_gps_input_alt_mm.tlog"
    mark = pytest.mark.skipif(not name.is_file(), reason="no recordings in ../shared/corpus")
    return [SAMPLE, pytest.param(name, marks=mark)]


@pytest.mark.parametrize("path", recordings(), ids=lambda path: path.stem)
def test_over_a_socket(path: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The tlog equals what was sent byte for byte; `check` on it finds what the watch reported."""
    sent = path.read_bytes()
    port = free_port()
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}", record=tmp_path / "seen.tlog")
    with peer(f"udpout:127.0.0.1:{port}") as sender:
        stage.replay(sent, sender)
    code = stage.end()
    seen = (tmp_path / "seen.tlog").read_bytes()
    assert seen == sent
    report, findings = judge(seen, preview=False)
    (result,) = stage.heard.results
    assert without_file(result.findings) == without_file(findings)
    assert result.file.runs == report.runs
    assert code == any(f.severity.rank >= Severity.WARNING.rank for f in findings)
    assert "appeared" in stage.heard.events()
    assert set(stage.heard.found()) >= {each.code for each in findings}


@pytest.fixture
def port() -> int:
    return free_port()


def heartbeat(system: int = 1, seq: int = 0) -> bytes:
    return frame("HEARTBEAT", {"type": 2, "autopilot": 3}, sender=(system, 1), seq=seq)


def attitude(boot_ms: int, seq: int) -> bytes:
    return frame("ATTITUDE", {"time_boot_ms": boot_ms}, seq=seq)


def test_silence(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A link that says nothing for five seconds is silent, once; then it is back."""
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}")
    with peer(f"udpout:127.0.0.1:{port}") as sender:
        sender.write(heartbeat())
        stage.until("open", "appeared")
        stage.tick(4)
        assert "silent" not in stage.heard.events()
        stage.tick(2)
        stage.tick(60)
        assert stage.heard.events().count("silent") == 1
        assert stage.watch.watched[0].status(stage.watch.now()).state == "silent"
        sender.write(heartbeat(seq=1))
        stage.until("back")
    assert stage.end() == 0


def test_one_of_two_is_silent(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """While a ground station goes on, a vehicle that is lost is named."""
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}")
    with peer(f"udpout:127.0.0.1:{port}") as sender:
        for number in range(8):
            sender.write(heartbeat(255, number) + (heartbeat(7) if number == 0 else b""))
            wait_for(stage.waiting)
            stage.tick(1)
        silent = [e for e in stage.heard.said if isinstance(e, Event) and e.what == "silent"]
        assert [each.sysid for each in silent] == [7]
    stage.end()


def test_newcomer_and_garbage(port: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Another vehicle is announced; garbage is counted, said, and not recorded."""
    path = tmp_path / "seen.tlog"
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}", record=path)
    good = [heartbeat(), heartbeat(9), heartbeat(seq=1)]
    with peer(f"udpout:127.0.0.1:{port}") as sender:
        for data in (good[0], b"no frame" + good[1], good[2]):
            sender.write(data)
        stage.until("appeared", "garbage")
        stage.sees(lambda: stage.heard.events().count("appeared") == 2)
    assert stage.watch.watched[0].status(stage.watch.now()).garbage_bytes == len("no frame")
    assert stage.end() == 0
    assert [data for _, data in records(path.read_bytes())] == good


def test_reboot(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle whose clock begins again has restarted."""
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}")
    stamps = [*range(60_000, 62_000, 100), *range(100, 3_000, 100)]
    with peer(f"udpout:127.0.0.1:{port}") as sender:
        sender.write(heartbeat())
        for number, boot_ms in enumerate(stamps):
            sender.write(attitude(boot_ms, number + 1))
            wait_for(stage.waiting)
            stage.tick(0.1)
        stage.until("reboot")
    assert stage.heard.events().count("reboot") == 1
    stage.end()


def test_clock_of_this_computer(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """That it was set is said; stamps go on as before."""
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}")
    stage.jump_s = 3600.0
    stage.tick()
    (said,) = [e for e in stage.heard.said if isinstance(e, Event) and e.what == "clock"]
    assert "+3600.0 s" in said.text
    assert stage.end() == 3


def test_vehicle_comes_and_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A TCP server that is not there yet, closes, and returns (a port that closes may still take a call)."""
    monkeypatch.setattr(link, "RETRY_S", 0.01)
    port = free_port(socket.SOCK_STREAM)
    stage = Stage(monkeypatch, f"tcp:127.0.0.1:{port}")
    stage.until("closed")
    for number in range(2):
        with peer(f"tcpin:127.0.0.1:{port}") as vehicle:
            wait_for(lambda: vehicle.recv(1) or vehicle.port)
            vehicle.write(heartbeat(seq=number))
            stage.tick()
            stage.sees(functools.partial(counted, stage, 0, number + 1))
        stage.sees(functools.partial(closed, stage, number + 2))
    assert stage.heard.events().count("open") >= 2
    assert stage.end() == 0


def messages(stage: Stage, place: int = 0) -> int:
    return stage.watch.watched[place].status(stage.watch.now()).messages


def counted(stage: Stage, place: int, count: int) -> bool:
    return messages(stage, place) == count


def closed(stage: Stage, times: int) -> bool:
    return stage.heard.events().count("closed") >= times


def test_tcp_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle that connects to us; frames torn over several writes are whole again."""
    port = free_port(socket.SOCK_STREAM)
    stage = Stage(monkeypatch, f"tcpin:127.0.0.1:{port}")
    data = heartbeat() + heartbeat(seq=1)
    with peer(f"tcp:127.0.0.1:{port}") as vehicle:
        for place in range(0, len(data), 7):
            vehicle.write(data[place : place + 7])
            wait_for(stage.waiting)
            stage.tick()
        stage.sees(lambda: messages(stage) == 2)
    stage.end()


def test_two_links(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Each link is judged, and recorded, by itself."""
    ports = free_port(), free_port()
    links = [f"udpin:127.0.0.1:{each}" for each in ports]
    stage = Stage(monkeypatch, *links, record=tmp_path / "two.tlog")
    for place, each in enumerate(ports):
        with peer(f"udpout:127.0.0.1:{each}") as sender:
            sender.write(heartbeat(system=place + 1))
            stage.sees(functools.partial(counted, stage, place, 1))
    assert stage.end() == 0
    for place in (0, 1):
        ((_, data),) = records((tmp_path / f"two-{place + 1}.tlog").read_bytes())
        assert data == heartbeat(system=place + 1)


def test_relay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between vehicle and ground station every byte passes both ways, and both are judged."""
    port, station_port = free_port(), free_port()
    relay = f"udpout:127.0.0.1:{station_port}"
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}", relay=relay)
    down, up = b"\0 no frame" + heartbeat(), heartbeat(255)
    with peer(f"udpout:127.0.0.1:{port}") as vehicle, peer(relay.replace("out", "in")) as station:
        vehicle.write(down)
        assert received(station) == down
        station.write(up)
        assert received(vehicle) == up
        stage.sees(lambda: messages(stage) == 2)
    stage.end()


def received(side: Any) -> bytes:
    """Return the next datagram that a peer gets."""
    got = b""

    def came() -> bytes:
        nonlocal got
        got = side.recv() or b""
        return got

    wait_for(came)
    return got


@posix
def test_serial(monkeypatch: pytest.MonkeyPatch) -> None:
    """A serial port, as a pseudo-terminal is one."""
    import tty

    ours, theirs = os.openpty()
    tty.setraw(ours)
    stage = Stage(monkeypatch, f"{os.ttyname(theirs)},57600")
    stage.until("open")
    os.write(ours, heartbeat())
    stage.sees(lambda: messages(stage) == 1)
    stage.end()
    os.close(ours)
    os.close(theirs)


def test_follow(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A tlog that grows, by records and by parts of them."""
    data, path = SAMPLE.read_bytes(), tmp_path / "growing.tlog"
    path.write_bytes(data[:1000])
    stage = Stage(monkeypatch, files=(path,))
    for place in range(1000, len(data), 5000):
        with path.open("ab") as file:
            file.write(data[place : place + 5000])
        stage.tick()
    stage.end()
    (result,) = stage.heard.results
    report, findings = judge(data, preview=False)
    assert without_file(result.findings) == without_file(findings)
    assert result.file.messages == report.messages


def test_full_disk(port: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A recording that cannot go on is said and makes the exit code 2; the watch goes on."""
    path = tmp_path / "seen.tlog"
    stage = Stage(monkeypatch, f"udpin:127.0.0.1:{port}", record=path)
    recorder: Any = stage.watch.watched[0]._recorder
    with peer(f"udpout:127.0.0.1:{port}") as sender:
        sender.write(heartbeat())
        stage.until("appeared")
        whole = recorder._file

        class Full:
            def write(self, data: bytes) -> int:
                return int(whole.write(data[:5]))

            def __getattr__(self, name: str) -> Any:
                return getattr(whole, name)

        recorder._file = Full()
        sender.write(heartbeat(seq=1))
        stage.until("record")
        sender.write(heartbeat(seq=2))
        stage.sees(lambda: messages(stage) == 3)
    assert stage.end() == 2
    assert [data for _, data in records(path.read_bytes())] == [heartbeat()]


def test_notify(port: int) -> None:
    """The ground station gets findings as STATUSTEXT of a component of the system concerned."""
    link, station = f"udpin:127.0.0.1:{port}", f"udpin:127.0.0.1:{free_port()}"
    with (
        peer(station) as ground,
        process(link, "--notify", station.replace("in", "out", 1)) as running,
        peer(f"udpout:{link[6:]}") as vehicle,
    ):
        heard(running, "open")
        for _, data in records(SAMPLE.read_bytes()):
            vehicle.write(data)
        finding = heard(running, "found")["finding"]
        told = ground.recv_match(type="STATUSTEXT", blocking=True, timeout=PATIENCE_S)
        assert (told.get_srcSystem(), told.get_srcComponent()) == (finding["sysid"], COMPONENT)
        assert told.text.startswith(finding["code"])
        assert not vehicle.recv()


def test_contract(port: int, tmp_path: Path) -> None:
    """What a recording shows is kept by the same flight, and broken by one that lacks streams."""
    made = CliRunner().invoke(main, ["inspect", "--contract", str(SAMPLE)])
    path = tmp_path / "contract.toml"
    path.write_text(made.stdout)
    kept = differences(tmp_path, path, SAMPLE.read_bytes())
    assert kept == []
    without = [stamped(data, t_us) for t_us, data in records(SAMPLE.read_bytes()) if data[7] != 33]
    broken = differences(tmp_path, path, b"".join(without))
    assert [(each["what"], each["message"]) for each in broken] == [
        ("missing", "GLOBAL_POSITION_INT")
    ]


def differences(folder: Path, contract: Path, data: bytes) -> list[dict[str, Any]]:
    """Return how a tlog, followed, differs from a contract."""
    path = folder / "followed.tlog"
    path.write_bytes(data)
    arguments = ["--follow", str(path), "--expect", str(contract), "--for", "0.5s"]
    ended = CliRunner().invoke(main, ["watch", "--format", "jsonl", *arguments])
    said = [json.loads(line) for line in ended.stdout.splitlines()]
    return [each for each in said if each["type"] == "deviation"]


# As a process


@contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run `mavframecheck watch` with lines of JSON."""
    command = [sys.executable, "-m", "mavframecheck", "watch", "--format", "jsonl", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            yield running
        finally:
            running.kill()


def heard(running: subprocess.Popen[str], what: str) -> dict[str, Any]:
    """Return the next event, change or other line of a kind."""
    assert running.stdout is not None
    for text in running.stdout:
        said: dict[str, Any] = json.loads(text)
        if what in (said.get("what"), said["type"]):
            return said
    raise AssertionError(f"it ended without {what}")


@posix
def test_killed(port: int, tmp_path: Path) -> None:
    """What was received before a kill -9 is on disk: pymavlink reads it to the last full record."""
    path = tmp_path / "seen.tlog"
    sent = [heartbeat(seq=number) for number in range(20)]
    link = f"udpin:127.0.0.1:{port}"
    with process(link, "--record", str(path)) as running, peer(f"udpout:{link[6:]}") as vehicle:
        heard(running, "open")
        for each in sent:
            vehicle.write(each)
        wait_for(lambda: path.stat().st_size == len(sent) * (8 + len(sent[0])))
        running.kill()
    log = mavutil.mavlink_connection(str(path))
    read = [bytes(message.get_msgbuf()) for message in iter(log.recv_msg, None)]
    log.close()
    assert read == sent


@posix
def test_terminated(port: int) -> None:
    """SIGTERM and Ctrl-C end the watch with its report."""
    with process(f"udpin:127.0.0.1:{port}") as running:
        with peer(f"udpout:127.0.0.1:{port}") as vehicle:
            heard(running, "open")
            vehicle.write(heartbeat())
            heard(running, "appeared")
        running.send_signal(signal.SIGTERM)
        assert heard(running, "file")["messages"] == 1
        assert running.wait() == 0


def test_exit_on(port: int) -> None:
    """The first finding that is bad enough ends the watch."""
    link = f"udpin:127.0.0.1:{port}"
    with process(link, "--exit-on", "error") as running, peer(f"udpout:{link[6:]}") as vehicle:
        heard(running, "open")
        for _, data in records(SAMPLE.read_bytes()):
            vehicle.write(data)
        assert heard(running, "found")["finding"]["code"] == "MFC302"
        assert running.wait() == 1


def test_for() -> None:
    """The watch ends by itself; nothing decodable is exit code 3."""
    with process(f"udpin:127.0.0.1:{free_port()}", "--for", "0.3s") as running:
        assert heard(running, "file")["messages"] == 0
        assert running.wait() == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["udp:1"], "udp:1: a link is udpin:HOST:PORT"),
        (["tcp:host:99999"], "a link is"),
        (["udpin:127.0.0.1:1", "--for", "soon"], "'soon' is not a length of time"),
        (["udpin:127.0.0.1:1", "udpin:127.0.0.1:2", "--relay", "udpout:a:1"], "name one"),
        (["--follow", "no-such-file.tlog"], "no-such-file.tlog"),
        ([], "Give a link"),
    ],
)
def test_usage(arguments: list[str], words: str) -> None:
    result = CliRunner().invoke(main, ["watch", *arguments])
    assert result.exit_code == 2
    assert words in result.stderr


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_port_in_use(tmp_path: Path) -> None:
    """A port that another program has (pymavlink does not close the socket that it cannot bind)."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        path = tmp_path / "seen.tlog"
        arguments = [f"tcpin:127.0.0.1:{port}", "--record", str(path)]
        result = CliRunner().invoke(main, ["watch", *arguments])
    assert result.exit_code == 2
    assert "choose another port" in result.stderr
    assert not path.exists()


def test_record_keeps_what_is_there(tmp_path: Path) -> None:
    """A recording is never written over."""
    path = tmp_path / "old.tlog"
    path.write_bytes(b"old")
    link = f"udpin:127.0.0.1:{free_port()}"
    result = CliRunner().invoke(main, ["watch", link, "--record", str(path)])
    assert result.exit_code == 2
    assert path.read_bytes() == b"old"
