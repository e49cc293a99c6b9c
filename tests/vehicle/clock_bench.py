"""Made-up recordings with one thing wrong with a clock each, and clean ones that look nearly so."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mavframecheck.wire.encode import encode_frame, encode_payload, stamped
from tests.strategies import DIALECT

START_US = 1_750_000_000_000_000
AUTOPILOT, COMPANION, GCS = (1, 1), (1, 191), (255, 190)
Fields = dict[str, int | float]


@dataclass(frozen=True)
class Message:
    """A message on its way: when it is sent and received, from whom, what."""

    sent: float
    t: float
    sender: tuple[int, int]
    name: str
    fields: Fields


Story = Iterable[Message]
Stamp = Callable[[float], float]
"""From true time since the start, s, to what the sender's clock shows, s."""


def stream(
    sender: tuple[int, int],
    name: str,
    field: str,
    stamp: Stamp,
    *,
    hz: float = 10.0,
    until: float = 60.0,
    begin: float = 0.0,
    late: Callable[[float], float] = lambda _: 0.01,
    jitter: float = 0.004,
    seed: int = 1,
    unit: float | None = None,
    **fields: float,
) -> Iterator[Message]:
    """Yield messages every 1 / `hz` s that arrive `late` s later, give or take exponential `jitter`."""
    noise = np.random.default_rng(seed)
    length = {"time_boot_ms": 1e3, "time_usec": 1e6, "usec": 1e6, "time_unix_usec": 1e6}
    scale = length.get(field, 1e9) if unit is None else unit
    for t in np.arange(begin, until, 1 / hz).tolist():
        size = 32 if field == "time_boot_ms" else 64
        value = int(stamp(t) * scale) % 2**size
        arrives = t + late(t) + float(noise.exponential(jitter))
        yield Message(t, arrives, sender, name, {**fields, field: value})


def heartbeats(until: float = 60.0, autopilot: int = 3) -> Iterator[Message]:
    """Yield the heartbeats of an autopilot (3 ArduPilot, 12 PX4)."""
    for t in np.arange(0.0, until, 1.0).tolist():
        fields: Fields = {"type": 2, "autopilot": autopilot}
        yield Message(t, t, AUTOPILOT, "HEARTBEAT", fields)


def vehicle(
    clock: Stamp, *, until: float = 60.0, begin: float = 0.0, seed: int = 1
) -> Iterator[Message]:
    """Yield four streams of an autopilot by one clock."""
    for k, (name, field, hz) in enumerate(
        (
            ("ATTITUDE", "time_boot_ms", 10.0),
            ("LOCAL_POSITION_NED", "time_boot_ms", 5.0),
            ("RAW_IMU", "time_usec", 8.0),
            ("SCALED_PRESSURE", "time_boot_ms", 2.0),
        )
    ):
        yield from stream(
            AUTOPILOT, name, field, clock, hz=hz, seed=seed + k, until=until, begin=begin
        )


def recording(*stories: Story, receive: Stamp = lambda t: t) -> bytes:
    """Return a tlog of stories told at once; `receive` is the recorder's clock.

    What one sender sends keeps its order on the way.
    """
    seq: dict[tuple[int, int], int] = {}
    arrived: dict[tuple[int, int], float] = {}
    records = []
    for message in sorted((m for story in stories for m in story), key=lambda m: m.sent):
        seq[message.sender] = seq.get(message.sender, -1) + 1
        arrived[message.sender] = max(message.t, arrived.get(message.sender, 0.0))
        layout = DIALECT.by_name[message.name]
        frame = encode_frame(
            layout,
            encode_payload(layout, dict(message.fields)),
            sysid=message.sender[0],
            compid=message.sender[1],
            seq=seq[message.sender] % 256,
        )
        records.append((arrived[message.sender], frame))
    records.sort(key=lambda record: record[0])
    return b"".join(stamped(one, START_US + round(receive(t) * 1e6)) for t, one in records)


def merged(data: bytes, *, delay_s: float, every: int = 1, lost: float = 0.1) -> bytes:
    """Return a tlog in which frames come again `delay_s` later over a second link, some of them lost."""
    records, at, noise = [], 0, np.random.default_rng(3)
    while at < len(data):
        size = 8 + 12 + data[at + 9]
        records.append((int.from_bytes(data[at : at + 8], "big"), data[at + 8 : at + size]))
        at += size
    again = [
        (t + round(delay_s * 1e6), frame) for t, frame in records[::every] if noise.random() > lost
    ]
    out = sorted(records + again, key=lambda record: record[0])
    return b"".join(t.to_bytes(8, "big") + frame for t, frame in out)


def boot(t: float) -> float:
    """Return the clock of a vehicle that was started 45 s before the recording."""
    return 45.0 + t


def unix(t: float) -> float:
    """Return the time of day."""
    return START_US * 1e-6 + t


def vision(stamp: Stamp, **settings: float | Callable[[float], float]) -> Iterator[Message]:
    """Yield positions from a companion."""
    given = {"hz": 20.0, "seed": 9, **settings}
    return stream(COMPANION, "VISION_POSITION_ESTIMATE", "usec", stamp, **given)  # type: ignore[arg-type]


def restarting(at: float, down: float) -> Iterator[Message]:
    """Yield a vehicle that is restarted."""
    yield from vehicle(boot, until=at)
    yield from vehicle(lambda t: t - at - down + 0.2, begin=at + down, seed=50)


def frozen(at: float) -> Iterator[Message]:
    """Yield positions whose stamp stands still for ten seconds while they change."""
    clock = lambda t: boot(at) if at <= t < at + 10 else boot(t)  # noqa: E731
    for k, message in enumerate(vision(clock)):
        yield replace(message, fields={**message.fields, "x": 0.1 * k})


def asking(until: float = 60.0) -> Iterator[Message]:
    """Yield TIMESYNC questions of the vehicle."""
    return stream(AUTOPILOT, "TIMESYNC", "ts1", boot, hz=5.0, until=until, seed=20)


def answering(unit: float) -> Iterator[Message]:
    """Yield the answers of a companion by the time of day, in `unit` per second."""
    return stream(
        COMPANION, "TIMESYNC", "tc1", unix, hz=5.0, seed=21, unit=unit, late=lambda _: 0.03
    )


CLEAN: dict[str, bytes] = {
    "one clock": recording(heartbeats(), vehicle(boot), vision(boot)),
    "jitter of 200 ms": recording(heartbeats(), vehicle(boot), vision(boot, jitter=0.2, hz=5.0)),
    "clock 1.5 % slow": recording(
        heartbeats(), vehicle(lambda t: 45 + 0.985 * t), vision(lambda t: 45 + 0.985 * t)
    ),
    "drift of 50 ppm": recording(
        heartbeats(300), vehicle(lambda t: 45 + 1.00005 * t, until=300), vision(boot, until=300)
    ),
    **{
        f"{speed} times as fast": recording(
            heartbeats(),
            vehicle(lambda t, speed=speed: 45 + speed * t),  # type: ignore[misc]
            vision(lambda t, speed=speed: 45 + speed * t),  # type: ignore[misc]
        )
        for speed in (0.5, 2.0, 5.0, 10.0)
    },
    "fast and slow by turns": recording(
        heartbeats(), vehicle(lambda t: 45 + t + 0.6 * t * np.sin(t / 15) ** 2)
    ),
    "not stamped": recording(heartbeats(), vehicle(boot), vision(lambda _: 0.0)),
    "always 10": recording(heartbeats(), vehicle(boot), vision(lambda _: 1e-5)),
    "the sender's own clock": recording(heartbeats(), vehicle(boot), vision(lambda t: 5739.0 + t)),
    "time of day for an ArduPilot": recording(heartbeats(), vehicle(boot), vision(unix)),
    "time of day, answered": recording(
        heartbeats(autopilot=12), vehicle(boot), vision(unix), asking(), answering(1e9)
    ),
    "late but stamped": recording(heartbeats(), vehicle(boot), vision(boot, late=lambda _: 0.45)),
    "restart": recording(heartbeats(), restarting(20.0, 8.0)),
    "two links": merged(recording(heartbeats(), vehicle(boot), vision(boot)), delay_s=0.05),
    "a second link 12 s late": merged(
        recording(heartbeats(), vehicle(boot), vision(boot)), delay_s=12.0
    ),
    "link lost for half a minute": recording(
        heartbeats(20), vehicle(boot, until=20), vehicle(boot, begin=50, until=80, seed=40)
    ),
    "bursts of four seconds": recording(
        heartbeats(), vehicle(boot), receive=lambda t: 4 * np.ceil(t / 4) + 0.001 * (t % 4)
    ),
}
"""Recordings without a mistake: no finding but information."""

FAULTY: dict[str, tuple[str, bytes]] = {
    "stamps step back": (
        "MFC801",
        recording(heartbeats(), vehicle(boot), vision(lambda t: boot(t) - 20 * (t > 30))),
    ),
    "milliseconds for microseconds": (
        "MFC802",
        recording(heartbeats(), vehicle(boot), vision(boot, unit=1e3)),
    ),
    "nanoseconds for microseconds": (
        "MFC802",
        recording(heartbeats(), vehicle(boot), vision(boot, unit=1e9)),
    ),
    "milliseconds, five times as fast": (
        "MFC802",
        recording(
            heartbeats(), vehicle(lambda t: 45 + 5 * t), vision(lambda t: 45 + 5 * t, unit=1e3)
        ),
    ),
    "time of day since boot": (
        "MFC803",
        recording(
            heartbeats(),
            vehicle(boot),
            stream(
                COMPANION,
                "SET_POSITION_TARGET_LOCAL_NED",
                "time_boot_ms",
                unix,
                type_mask=0x0DF8,
                coordinate_frame=1,
            ),
        ),
    ),
    "boot, then time of day": (
        "MFC804",
        recording(heartbeats(), vehicle(boot), vision(lambda t: unix(t) if t > 30 else boot(t))),
    ),
    "time of day, not answered": (
        "MFC805",
        recording(heartbeats(autopilot=12), vehicle(boot), vision(unix), asking()),
    ),
    "stamp stands still": ("MFC806", recording(heartbeats(), vehicle(boot), frozen(20.0))),
    "32 bits of microseconds": (
        "MFC807",
        recording(heartbeats(), vehicle(boot), vision(lambda t: (4270.0 + t) % (2**32 * 1e-6))),
    ),
    "a queue that fills": (
        "MFC809",
        recording(
            heartbeats(120),
            vehicle(boot, until=120),
            vision(boot, until=120, late=lambda t: 0.01 * t),
        ),
    ),
    "answers in microseconds": (
        "MFC810",
        recording(heartbeats(autopilot=12), vehicle(boot), vision(unix), asking(), answering(1e6)),
    ),
    "milliseconds since 1970": (
        "MFC811",
        recording(
            heartbeats(),
            vehicle(boot),
            stream(GCS, "SYSTEM_TIME", "time_unix_usec", unix, hz=1.0, unit=1e3),
        ),
    ),
    "the recorder's clock is set back": (
        "MFC814",
        recording(heartbeats(), vehicle(boot), receive=lambda t: t - 30 * (t > 25)),
    ),
    "two vehicles under one id": (
        "MFC006",
        recording(heartbeats(), vehicle(boot), vehicle(lambda t: 900 + t, seed=30)),
    ),
}
"""What is wrong, the code that must be found, and the recording."""
