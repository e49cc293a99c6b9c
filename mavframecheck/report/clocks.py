"""`inspect --clocks`: the clocks of recordings, as a table for people and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from mavframecheck.model.clocks import ClockExchange, ClockRestart, ClockStream, FileClocks
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import FilePage
from mavframecheck.report.words import extent, plural, utc

_DOMAINS = {
    "boot": "boot",
    "unix": "1970 (UTC)",
    "vehicle": "vehicle's boot",
    "sender": "its own",
    "mixed": "boot and 1970",
    "constant": "stands still",
    None: "not stamped",
}
_HEAD = ("stamp", "clock", "unit", "count", "began / offset", "rate error", "p50", "p99", "notes")
_RIGHT = frozenset({3, 4, 5, 6, 7})
_FAR = 0.1
"""A rate further than this from 1 is said as a factor: parts in a million are for crystals."""


class ClockPage(FilePage[FileClocks]):
    """Writes clock tables for one context."""

    def file(self, clocks: FileClocks) -> Iterator[str]:
        """Yield the head, a table for each component, restarts and exchanges."""
        yield self.bold(sentence(clocks.path))
        yield from self.wrap(extent(clocks), "  ", "    ")
        for note in clocks.notes:
            yield from self.wrap(f"note: {note}", "  ", "    ")
        started = {(each.sysid, each.compid): each.boot_utc for each in clocks.components}
        for sender, streams in groupby(clocks.streams, lambda each: (each.sysid, each.compid)):
            yield ""
            said = f", started {utc(started[sender])} by its own clock" if sender in started else ""
            yield self.paint("{}/{}".format(*sender), "cyan") + said
            yield from self._table(list(streams))
        rest = [*map(_restarted, clocks.restarts), *map(_exchanged, clocks.exchanges)]
        if rest:
            yield ""
        for line in rest:
            yield from self.wrap(line, "  ", "    ")

    def _table(self, streams: list[ClockStream]) -> Iterator[str]:
        rows = [_HEAD, *(tuple(map(sentence, _row(stream))) for stream in streams)]
        widths = [max(len(row[k]) for row in rows) for k in range(len(_HEAD))]
        for number, row in enumerate(rows):
            cells = [
                cell.rjust(width) if k in _RIGHT else cell.ljust(width)
                for k, (cell, width) in enumerate(zip(row, widths))
            ]
            line = "  " + "  ".join(cells).rstrip()
            yield line if number else self.dim(line)


def _row(stream: ClockStream) -> tuple[str, ...]:
    """Return the cells of a stream."""
    name = f"{stream.message}.{stream.field}"
    if stream.target is not None:
        name += f" to {stream.target}"
    return (
        name,
        _DOMAINS[stream.domain],
        stream.unit,
        str(stream.count),
        _offset(stream),
        _rate(stream),
        _milliseconds(stream.latency_p50_s),
        _milliseconds(stream.latency_p99_s),
        "; ".join(_notes(stream)),
    )


def _offset(stream: ClockStream) -> str:
    if stream.offset_s is None:
        return ""
    if stream.domain == "unix":
        return f"{stream.offset_s:+.3f} s"
    return utc(stream.offset_s)


def _rate(stream: ClockStream) -> str:
    if stream.rate is None or stream.error_ppm is None:
        return ""
    if abs(stream.rate - 1) > _FAR:
        return f"x {stream.rate:.4g}"
    return f"{stream.error_ppm:+.0f} ppm"


def _milliseconds(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds * 1e3:.0f} ms"


def _notes(stream: ClockStream) -> Iterator[str]:
    if stream.unset:
        yield f"{stream.unset} not stamped"
    if stream.repeated:
        yield f"{stream.repeated} repeated"
    if stream.backward:
        yield f"{stream.backward} back"
    steps = [f"{step.receive_s - step.stamp_s:+.1f} s" for step in stream.steps]
    if steps:
        more = f" and {len(steps) - 4} more" if len(steps) > 4 else ""
        yield f"steps {', '.join(steps[:4])}{more}"


def _restarted(each: ClockRestart) -> str:
    when = "" if each.time is None else f" at {utc(each.time)}"
    return (
        f"{each.sysid}/{each.compid} begins again{when}: {plural(each.streams, 'stream')}, "
        f"up {each.uptime_s:.1f} s before, {each.since_s:.1f} s after"
    )


def _exchanged(each: ClockExchange) -> str:
    asked = f"TIMESYNC: {each.asker} asks {plural(each.questions, 'time')}"
    if each.answerer is None or each.ahead_s is None:
        return f"{asked}, nobody answers"
    way = "ahead of" if each.ahead_s >= 0 else "behind"
    answers = f"{each.answerer} answers {each.answers}"
    return f"{asked}, {answers}: its clock is {abs(each.ahead_s):.6f} s {way} the asker's"
