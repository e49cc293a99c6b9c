"""The screen of `watch`: lines of a given width and number, the worst first.

Everything that came over a link is escaped, and only text objects are used, so that nothing in it is taken
for markup. What does not fit is counted, never silently left out.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence

from rich.text import Text

from mavframecheck.model import Severity, Vehicle
from mavframecheck.model.contract import Terms
from mavframecheck.model.live import Change, Event, LinkStatus, Place, SenderStatus, Standing, View
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import SEVERITY_COLOURS
from mavframecheck.report.live import clock
from mavframecheck.report.words import component, plural

WIDE = 130
"""Columns from which streams stand beside the rest."""
FEWEST_STREAMS = 6
"""Lines that must be left for streams below the findings."""
_BARS = "▁▂▃▄▅▆▇█"
_STATES = {
    "up": "green",
    "waiting": "yellow",
    "silent": "bold white on red",
    "closed": "bold white on red",
}
SILENT_S = 5.0
_MOST_SENDERS = 5
_EVENTS = 3
"""Events shown at least."""


def screen(
    views: Sequence[View], log: Sequence[Change | Event], now: float, width: int, height: int
) -> list[Text]:
    """Return `height` lines of `width` columns; `log` is what was said so far, newest last."""
    if width < WIDE:
        return _page(views, log, now, width, height, streams=True)
    left = width * 6 // 10
    pages = zip(
        _page(views, log, now, left - 1, height, streams=False),
        _stream_page(views, width - left - 2, height),
    )
    return [_beside(one, other, left) for one, other in pages]


def _page(
    views: Sequence[View],
    log: Sequence[Change | Event],
    now: float,
    width: int,
    height: int,
    *,
    streams: bool,
) -> list[Text]:
    """Return the page with everything, or without the streams."""
    head = [_title(views, now, width)]
    for view in views:
        head += [_link(view.status, width), *_senders(view, width), *_places(view.places)]
        head += _contract(view)
    tail = _log(log, width, max(_EVENTS, height // 7))
    room = height - len(head) - len(tail)
    body = _findings(views, width, room)
    if streams and room - len(body) >= FEWEST_STREAMS:
        body += _streams(views, width, room - len(body))
    return _fitted([*head, *body], height - len(tail), width) + tail


def _fitted(lines: list[Text], height: int, width: int) -> list[Text]:
    """Return exactly `height` lines, none longer than `width`."""
    for line in lines:
        line.truncate(width, overflow="ellipsis")
    return (lines + [Text("")] * height)[:height]


def _beside(one: Text, other: Text, column: int) -> Text:
    one = one.copy()
    one.pad_right(max(0, column - one.cell_len))
    return Text.assemble(one, ("│ ", "dim"), other)


def _title(views: Sequence[View], now: float, width: int) -> Text:
    """Return the first line: how all is, at one look."""
    verdict, style = _verdict(views)
    title = Text.assemble(("mavframecheck watch", "bold"), "  ", (f" {verdict} ", style))
    right = f"{clock(now)} UTC"
    title.pad_right(max(1, width - title.cell_len - len(right)))
    title.append(right, "dim")
    return title


def _verdict(views: Sequence[View]) -> tuple[str, str]:
    lost = [view for view in views if view.status.state in ("silent", "closed")]
    if lost:
        quiet = max((view.status.quiet_s or 0.0 for view in lost), default=0.0)
        return f"LINK LOST {_age(quiet)}" if quiet else "NO LINK", "bold white on red"
    active = [each.finding.severity for view in views for each in view.findings if each.active]
    for severity, style in (
        (Severity.ERROR, "bold white on red"),
        (Severity.WARNING, "bold black on yellow"),
    ):
        number = active.count(severity)
        if number:
            return plural(number, str(severity).upper()), style
    if any(view.deviations for view in views):
        return "NOT AS AGREED", "bold black on yellow"
    if any(view.status.state == "waiting" for view in views):
        return "WAITING", "bold black on yellow"
    return "ALL WELL", "bold black on green"


def _link(status: LinkStatus, width: int) -> Text:
    """Return a line about a link: state, rates, loss, garbage, recording."""
    parts = [f"{status.rate_hz:.0f} msg/s", f"{status.bytes_per_s / 1000:.1f} kB/s"]
    if status.quiet_s is not None and status.state != "up":
        parts = [f"last heard {_age(status.quiet_s)} ago, {plural(status.messages, 'message')}"]
    elif status.loss is not None:
        parts.append(f"loss {status.loss:.1%}")
    if status.garbage_bytes:
        parts.append(f"{status.garbage_bytes} bytes garbage")
    if status.record_bytes is not None:
        parts.append(f"rec {status.record_bytes / 1e6:.1f} MB")
    name = textwrap.shorten(sentence(status.link), max(20, width - 50), placeholder="...")
    return Text.assemble(
        (name, "bold"), " ", (status.state, _STATES[status.state]), "  ", ", ".join(parts)
    )


def _senders(view: View, width: int) -> Iterator[Text]:
    """Yield a line for each component."""
    shown = view.senders[:_MOST_SENDERS]
    for vehicle, status in shown:
        yield _sender(vehicle, status, width)
    if len(view.senders) > len(shown):
        yield Text(f"  and {plural(len(view.senders) - len(shown), 'more component')}", "dim")


def _sender(vehicle: Vehicle, status: SenderStatus, width: int) -> Text:
    who = textwrap.shorten(component(vehicle), max(12, width - 44), placeholder="...")
    line = Text.assemble(f"  {vehicle.sysid}/{vehicle.compid}".ljust(10), who, "  ")
    if status.quiet_s >= SILENT_S:
        return line.append(f"silent for {_age(status.quiet_s)}", "bold red")
    parts = [f"{status.rate_hz:.0f}/s"]
    if status.loss is not None:
        parts.append(f"loss {status.loss:.1%}")
    if status.latency_s is not None:
        parts.append(f"late {status.latency_s * 1e3:.0f} ms")
    return line.append(", ".join(parts), "dim")


def _places(places: Iterable[Place]) -> Iterator[Text]:
    for place in places:
        moved = f", moved {plural(place.moves, 'time')}" if place.moves else ""
        at = f"{place.lat:.6f} {place.lon:.6f}, {place.alt_msl:.1f} m MSL"
        line = Text.assemble(
            f"  {place.what} of {place.system}".ljust(15),
            at,
            (f" ({sentence(place.source)}){moved}", "dim"),
        )
        yield line


def _contract(view: View) -> Iterator[Text]:
    """Yield how a link differs from its contract."""
    if view.deviations is None:
        return
    if not view.deviations:
        yield Text("  as agreed: every stream of the contract", "green")
        return
    for each in view.deviations[:3]:
        yield Text(f"  not as agreed: {sentence(each.text)}", "yellow")
    if len(view.deviations) > 3:
        yield Text(
            f"  and {plural(len(view.deviations) - 3, 'more difference')} from the contract",
            "yellow",
        )


def _findings(views: Sequence[View], width: int, room: int) -> list[Text]:
    """Return the findings that fit, worst first, and how many do not."""
    standing = [each for view in views for each in view.findings]
    if not standing:
        judging = sum(view.judging for view in views)
        return [
            Text(""),
            Text(f"no findings; {plural(judging, 'rule')} had something to judge", "green"),
        ]
    lines = [Text("")]
    for number, each in enumerate(standing):
        block = _finding(each, width)
        more = len(standing) - number - 1
        if len(lines) + len(block) + bool(more) > room:
            lines.append(Text(f"and {plural(more + 1, 'more finding')}", "dim"))
            break
        lines += block
    return lines


def _finding(standing: Standing, width: int) -> list[Text]:
    """Return a finding: what, since when, how it looks, what to do; information, or one that ended, is a line."""
    finding = standing.finding
    full = standing.active and finding.severity is not Severity.INFO
    when = f"{finding.count}x, for {_age(standing.age_s)}"
    if not standing.active:
        when = f"{finding.count}x, last {_age(standing.last_s)} ago"
    style = f"bold {SEVERITY_COLOURS[finding.severity]}" if full else "dim"
    line = Text.assemble(
        (f"{finding.severity} {sentence(finding.code)}", style),
        f" {sentence(finding.subject)} ",
        (when, "dim"),
    )
    if len(standing.residuals) > 1:
        line.append(f"  {bars(standing.residuals)} left {standing.residuals[-1]:.2g}", "cyan")
    if not full:
        return [line]
    text = textwrap.wrap(sentence(finding.text), width - 4)
    fix = textwrap.wrap(f"do: {sentence(finding.fix)}", width - 4, subsequent_indent="    ")
    return [
        line,
        *(Text(f"    {each}") for each in _at_most(text, 3)),
        *(Text(f"    {each}", "green") for each in _at_most(fix, 2)),
    ]


def _at_most(lines: list[str], most: int) -> list[str]:
    return lines if len(lines) <= most else [*lines[: most - 1], f"{lines[most - 1]} ..."]


def bars(values: Sequence[float]) -> str:
    """Return a sparkline from zero to the largest of `values`; a gap for what is no number."""
    top = max((each for each in values if math.isfinite(each)), default=0.0) or 1.0
    return "".join(_bar(each / top) for each in values)


def _bar(share: float) -> str:
    if not math.isfinite(share):
        return " "
    return _BARS[min(int(max(share, 0.0) * len(_BARS)), len(_BARS) - 1)]


def _stream_page(views: Sequence[View], width: int, height: int) -> list[Text]:
    return _fitted(_streams(views, width, height), height, width)


def _streams(views: Sequence[View], width: int, room: int) -> list[Text]:
    """Return a line for each stream that says something of place: what it is counted in."""
    streams = [each for view in views for each in view.streams if each.frames or each.heights]
    name, frames, heights = _columns(width)
    lines = [
        Text(""),
        Text(f"{'stream':{name}}{'Hz':>5} {'frame':{frames}}{'heights':{heights}}clock", "bold"),
    ]
    for number, each in enumerate(streams):
        if len(lines) == room - 1 and number < len(streams) - 1:
            lines.append(Text(f"and {plural(len(streams) - number, 'more stream')}", "dim"))
            break
        lines.append(_stream(each, name, frames, heights))
    return lines if streams else []


def _columns(width: int) -> tuple[int, int, int]:
    """Return the widths of name, frames and heights."""
    name = min(40, max(26, width * 4 // 10))
    rest = width - name - 6 - 8
    return name, rest // 2, rest - rest // 2


def _stream(stream: Terms, name: int, frames: int, heights: int) -> Text:
    rate = f"{stream.rate_hz:.3g}" if stream.rate_hz is not None else "-"
    clocks = {each.partition(": ")[2] for each in stream.clocks}
    title = _cut(f"{stream.sender} {stream.message}", name)
    return Text.assemble(
        f"{title:{name}}{rate:>5} ",
        (f"{_cut(' '.join(stream.frames) or '-', frames):{frames}}", "cyan"),
        f"{_cut(' '.join(stream.heights) or '-', heights):{heights}}",
        (" ".join(sorted(clocks)) or "-", "dim"),
    )


def _cut(text: str, width: int) -> str:
    text = sentence(text)
    return text if len(text) < width else f"{text[: width - 3]}.."


def _log(log: Sequence[Change | Event], width: int, most: int) -> list[Text]:
    """Return the last events, below a line."""
    events = [each for each in log if isinstance(each, Event)][-most:]
    lines = [Text("─" * width, "dim")] if events else []
    for each in events:
        lines.append(Text(f"{clock(each.time)} {sentence(each.text)}", "dim"))
        lines[-1].truncate(width, overflow="ellipsis")
    return lines


def _age(seconds: float) -> str:
    """Return ``12 s``, ``3:04`` or ``1:02:03``."""
    whole = int(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes}:{rest:02d}"
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"
