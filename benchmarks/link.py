"""`make bench-link`: a live link against the required figures.

*Latency*: `watch` as a process on a UDP port, a flight sent to it over and over by a second process at
5 000 messages a second, and now and then a message with a mistake, each by a component of its own: from
sending it to reading the finding. *Load* and *memory*: the same engine fed with two hours of flight by
batches of 100 ms at 10 000 messages a second, as fast as it goes.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from mavframecheck.engine import Settings, load_pack
from mavframecheck.engine.live.pulse import Pulse
from mavframecheck.engine.live.session import Session
from mavframecheck.wire import Dialect, batch_of, load_dialect, whole
from mavframecheck.wire.encode import encode_frame, encode_payload, stamped
from mavframecheck.wire.framing import Framer

SAMPLE = Path(__file__).parents[1] / "samples" / "clean_copter.tlog"
FLIGHT = "sitl/clean_px4_mission_rtl.tlog"
RATE, LOAD = 5000, 10_000
MISTAKES, FIRST_COMPONENT = 150, 20
PAUSE_S = 0.2
LASTS_S = 60.0
"""The flight is sent for so long at most (s)."""
SPAN_S = 0.1
STAMPS_S = {"time_boot_ms": 1e3, "time_usec": 1e6, "time_unix_usec": 1e6}
"""Fields that go on from one copy of the flight to the next, and how much they count in a second."""


class Sent(NamedTuple):
    """A frame of the flight, and when it came, s after the first one."""

    t_s: float
    name: str
    version: int
    sysid: int
    compid: int
    payload: bytes
    frame: bytes


class Flight:
    """A recorded flight that can be flown again, later."""

    def __init__(self, path: Path) -> None:
        """Read the flight in a tlog."""
        self.dialect = load_dialect()
        data = path.read_bytes()
        self.sent = list(_sent(data, self.dialect))
        self.length_s = self.sent[-1].t_s + SPAN_S
        self._seq: dict[int, int] = {}

    def again(self, after_s: float) -> Iterator[tuple[float, bytes]]:
        """Yield time and frame of every message, all clocks ahead by `after_s`."""
        for each in self.sent:
            yield each.t_s + after_s, self._later(each, after_s)

    def _later(self, sent: Sent, after_s: float) -> bytes:
        layout = self.dialect.by_name[sent.name]
        row = np.frombuffer(sent.payload.ljust(layout.dtype.itemsize, b"\0"), layout.dtype).copy()
        for name, per_s in STAMPS_S.items():
            if name in layout.by_name and row[name][0]:
                row[name] += np.array(after_s * per_s).astype(row.dtype[name])
        sender = sent.sysid * 256 + sent.compid
        seq = self._seq[sender] = (self._seq.get(sender, -1) + 1) & 0xFF
        return encode_frame(
            layout,
            row.tobytes(),
            sysid=sent.sysid,
            compid=sent.compid,
            seq=seq,
            version=2 if sent.version == 2 else 1,
        )


def _sent(data: bytes, dialect: Dialect) -> Iterator[Sent]:
    scan = Framer(dialect, stamped=True).feed(whole(data, 0))
    batch = batch_of([scan], dialect)
    frames, began = batch.frames, int(batch.frames.t_us[0])
    for row in np.flatnonzero(frames.good).tolist():
        start, size = int(frames.start[row]), int(frames.size[row])
        payload = int(frames.payload[row])
        yield Sent(
            (int(frames.t_us[row]) - began) * 1e-6,
            dialect.layouts[int(frames.msgid[row])].name,
            int(frames.version[row]),
            int(frames.sysid[row]),
            int(frames.compid[row]),
            batch.buffer[payload : payload + int(frames.length[row])],
            batch.buffer[start : start + size],
        )


# Latency


def mistake(number: int, dialect: Dialect) -> bytes:
    """Return a setpoint of a companion of its own with a frame that no autopilot takes."""
    layout = dialect.by_name["SET_POSITION_TARGET_LOCAL_NED"]
    values = {"target_system": 1, "coordinate_frame": 5, "type_mask": 0x0DF8}
    payload = encode_payload(layout, values)
    return encode_frame(layout, payload, sysid=1, compid=FIRST_COMPONENT + number, seq=0)


def fly(path: Path, port: int, rate: float, stop: Event) -> None:
    """Send a flight over and over at `rate` messages a second."""
    flight, link = Flight(path), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    copies = range(math.ceil(LASTS_S * rate / len(flight.sent)))
    frames = [frame for copy in copies for _, frame in flight.again(copy * flight.length_s)]
    began = time.monotonic()
    for number, frame in enumerate(frames):
        if number % 10 == 0:
            if stop.is_set():
                return
            time.sleep(max(0.0, began + number / rate - time.monotonic()))
        link.sendto(frame, ("127.0.0.1", port))


def latencies(path: Path) -> tuple[list[float], float]:
    """Return the latency of each mistake, s, and the rate that was received, Hz."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "mavframecheck", "watch", f"udpin:127.0.0.1:{port}"]
    stop = multiprocessing.Event()
    found: dict[int, float] = {}
    with subprocess.Popen([*command, "--format", "jsonl"], stdout=subprocess.PIPE) as watch:
        lines = iter(watch.stdout or ())
        next(lines)
        ended: dict[str, object] = {}

        def read() -> None:
            for line in lines:
                now, said = time.monotonic(), json.loads(line)
                if said.get("what") == "found":
                    found.setdefault(said["finding"]["compid"], now)
                if said["type"] == "file":
                    ended.update(said)

        reader = threading.Thread(target=read)
        reader.start()
        sender = multiprocessing.Process(target=fly, args=(path, port, RATE, stop))
        sender.start()
        time.sleep(20.0)
        sent = _send_mistakes(port)
        time.sleep(2.0)
        stop.set()
        sender.join()
        watch.terminate()
        reader.join()
    late = [found[compid] - at for compid, at in sent.items() if compid in found]
    print(f"{len(late)} of {len(sent)} mistakes were found while the link was up")
    duration = float(str(ended["duration_s"]))
    return late, int(str(ended["messages"])) / duration


def _send_mistakes(port: int) -> dict[int, float]:
    dialect, sent = load_dialect(), {}
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    frames = [mistake(number, dialect) for number in range(MISTAKES)]
    pauses = np.random.default_rng(1).uniform(0.5, 1.5, MISTAKES) * PAUSE_S
    for number, (frame, pause) in enumerate(zip(frames, pauses)):
        time.sleep(float(pause))
        sent[FIRST_COMPONENT + number] = time.monotonic()
        link.sendto(frame, ("127.0.0.1", port))
    return sent


# Load and memory


def rss_mb() -> float:
    """Return the memory that this process holds, MB."""
    status = Path("/proc/self/statm")
    if status.is_file():
        return int(status.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def fly_on(path: Path, hours: float) -> tuple[list[tuple[float, float]], list[float], int]:
    """Return memory (hours of flight, MB), and how long each batch took (s), and all messages.

    The flight is flown faster than it was, so that its messages come at 10 000 a second.
    """
    flight = Flight(path)
    session = Session("link", "link", load_pack(), Settings(), flight.dialect)
    pulse = Pulse("link", 0.0)
    memory, took, messages, after_s = [], [], 0, 0.0
    pending: list[bytes] = []
    per_batch = round(LOAD * SPAN_S)
    while after_s < hours * 3600:
        for t_s, frame in flight.again(after_s):
            pending.append(stamped(frame, 1_800_000_000_000_000 + round(t_s * 1e6)))
            if len(pending) < per_batch:
                continue
            records = b"".join(pending)
            pending.clear()
            began = time.process_time()
            batch = session.take(records)
            session.changes()
            session.ask()
            pulse.hear(batch, [], session.reading.context, t_s)
            pulse.events(t_s)
            took.append(time.process_time() - began)
            messages += len(batch)
        after_s += flight.length_s
        memory.append((after_s / 3600, rss_mb()))
    return memory, took, messages


def main() -> int:
    """Measure, print a table, and return 1 where a required figure is not met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--hours", type=float, default=2.0)
    chosen = parser.parse_args()
    path = chosen.corpus / FLIGHT
    path = path if path.is_file() else SAMPLE
    late, rate = latencies(path)
    memory, took, messages = fly_on(path, chosen.hours)
    table = Table("figure", "measured", "required", "met")
    p50, p99 = np.percentile(late, [50, 99]) * 1e3
    # What is kept of a flight is full within the first hour. Medians: while copies of the checks answer what
    # they would say, a reading is 20 MB higher.
    quarter = max(1, len(memory) // 4)
    grown = float(np.median([mb for _, mb in memory[-quarter:]]))
    grown -= float(np.median([mb for _, mb in memory[-2 * quarter : -quarter]]))
    peak = max(mb for _, mb in memory)
    load = messages / sum(took)
    rows = [
        ("latency p50", f"{p50:.0f} ms at {rate:.0f} messages/s", "", True),
        ("latency p99", f"{p99:.0f} ms", "< 300 ms", p99 < 300),
        ("messages received", f"{rate:.0f} /s of {RATE}", "99 %", rate > 0.99 * RATE),
        ("load", f"{load:.0f} messages/s of processor time", f">= {LOAD}", load >= LOAD),
        ("processor time of a batch, p99", f"{np.percentile(took, 99) * 1e3:.0f} ms", "", True),
        (
            "memory",
            f"at most {peak:.0f} MB, {grown:+.1f} MB in the last quarter",
            "< 5 MB more",
            grown < 5,
        ),
    ]
    for what, measured, required, met in rows:
        table.add_row(what, measured, required, "yes" if met else "NO")
    Console().print(table)
    print(
        "memory by hours of flight:",
        ", ".join(f"{h:.2f} h {mb:.0f} MB" for h, mb in memory[:: max(1, len(memory) // 8)]),
    )
    return int(not all(met for *_, met in rows))


if __name__ == "__main__":
    sys.exit(main())
