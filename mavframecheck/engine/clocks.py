"""The clock table of a recording: every stamp, whose clock it is and how that runs."""

from __future__ import annotations

from collections.abc import Iterator

from mavframecheck.engine.reading import Progress, Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.model.clocks import (
    ClockExchange,
    ClockRestart,
    ClockStep,
    ClockStream,
    ComponentClock,
    FileClocks,
)
from mavframecheck.sources import open_recording
from mavframecheck.vehicle.clocks import ClockBook, StampStream
from mavframecheck.vehicle.timing import Clocks, Restart, Timing
from mavframecheck.wire import load_dialect

MOST_STEPS = 20
"""Steps of a stream that are listed."""
_UNITS = {1e-3: "ns", 1.0: "us", 1e3: "ms"}


def clocks_of_file(path: str, settings: Settings, progress: Progress | None = None) -> FileClocks:
    """Follow the clocks of the recording at `path` (``-``: standard input).

    `progress` is told how many bytes were read so far. Raises `SourceError` when the recording cannot
    be read, `DialectError` when the dialect cannot be used.
    """
    dialect = load_dialect(settings.dialect)
    with open_recording(path, settings.input_kind) as recording:
        reading = Reading(recording, settings, dialect)
        for _ in reading.understood(progress):
            _ = reading.context.clocks
        context = reading.context
        clocks, book = context.timing, context.clocks
        return FileClocks(
            **reading.summary(),
            streams=tuple(_stream(each, clocks) for each in book.settled()),
            restarts=tuple(_restart(each) for each in clocks.restarts if each.streams > 1),
            exchanges=tuple(_exchanges(book)),
            components=tuple(_components(clocks)),
        )


def _stream(stream: StampStream, clocks: Clocks) -> ClockStream:
    """Return what is known of a stream."""
    timing = next((each for each in clocks.timings if each.stream is stream), None)
    sysid, compid, message, field = stream.subject
    pool = None if timing is None else clocks.shared(timing)
    late = None if timing is None else timing.latency(pool)
    rate = None if timing is None else timing.rate
    return ClockStream(
        sysid=sysid,
        compid=compid,
        message=message,
        field=field,
        target=stream.key.target or None,
        instance=stream.key.instance or None,
        count=stream.rows,
        unset=stream.unset,
        clock=str(stream.field.clock),
        domain=None if timing is None else clocks.domain(timing),
        unit=_UNITS[stream.field.unit_us],
        rate=rate,
        offset_s=None if timing is None or rate is None else timing.offset_s,
        error_ppm=None if rate is None else (rate - 1) * 1e6,
        latency_p50_s=None if late is None else late[0],
        latency_p99_s=None if late is None else late[1],
        repeated=stream.repeated,
        backward=stream.back,
        steps=() if timing is None else tuple(_steps(timing)),
    )


def _steps(timing: Timing) -> Iterator[ClockStep]:
    for step in timing.steps[:MOST_STEPS]:
        yield ClockStep(
            time=_seconds(step.seen.t_us),
            receive_s=step.receive_s,
            stamp_s=step.stamp_s,
            offset=step.seen.offset,
        )


def _restart(restart: Restart) -> ClockRestart:
    return ClockRestart(
        sysid=restart.sender >> 8,
        compid=restart.sender & 0xFF,
        time=_seconds(restart.seen.t_us),
        uptime_s=restart.uptime_s,
        since_s=restart.since_s,
        streams=restart.streams,
    )


def _exchanges(book: ClockBook) -> Iterator[ClockExchange]:
    """Yield who answers whom, and the questions that nobody answers."""
    pairs = book.exchanges.pairs
    for asker, questions in sorted(book.exchanges.asked.items()):
        mine = [pair for key, pair in sorted(pairs.items()) if key[0] == asker]
        for pair in mine:
            yield ClockExchange(
                asker=_named(asker),
                answerer=_named(pair.answerer),
                questions=questions,
                answers=pair.answers,
                ahead_s=pair.ahead_ns * 1e-9,
            )
        if not mine:
            yield ClockExchange(
                asker=_named(asker), answerer=None, questions=questions, answers=0, ahead_s=None
            )


def _components(clocks: Clocks) -> Iterator[ComponentClock]:
    for sender in sorted(clocks.of):
        started = clocks.boot_utc(sender)
        if started is not None:
            yield ComponentClock(sysid=sender >> 8, compid=sender & 0xFF, boot_utc=started)


def _named(sender: int) -> str:
    return f"{sender >> 8}/{sender & 0xFF}"


def _seconds(t_us: int | None) -> float | None:
    return None if t_us is None else t_us * 1e-6
