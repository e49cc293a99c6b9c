"""The page of one recording: what its template is filled with."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from mavframecheck.model import ByteLocation, FileReport, Finding, Rule, Severity
from mavframecheck.model.trace import Detail, Figure, Flight, FrameBytes, Proof, Trace, key_of
from mavframecheck.report import Checked, Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.html import curves, heights, meaning
from mavframecheck.report.html.frame import fill
from mavframecheck.report.html.plan import Mark, Path, plan
from mavframecheck.report.told import evidence_rows, when
from mavframecheck.report.verdict import found, judged, verdicts
from mavframecheck.report.words import component, duration, plural, utc
from mavframecheck.vehicle.flight import on_plane

MAX_BYTES = 1_900_000
"""A page is no larger: curves are drawn from fewer points until it fits."""
POINTS = (1600, 800, 400, 200, 80)
"""Points of a curve over the flight that are tried; those of a figure are a third."""
MOST_FIGURES = 60
"""Findings whose proof is drawn, the worst ones."""
MOST_RUNS = 2000
_SURE = {"high": "sure", "medium": "fairly sure", "low": "not very sure"}


class Card(NamedTuple):
    """A finding as it is shown."""

    anchor: str
    finding: Finding
    when: str
    evidence: list[tuple[str, str]]
    rule: Rule | None
    sure: str
    figures: list[tuple[Figure, str, Markup | None]]
    """What is drawn, its key among the data, and a map where it is one."""
    frame: FrameBytes | None
    dump: list[tuple[str, str, str]]


def page_of(checked: Checked, context: Context) -> str:
    """Return the page of a recording, no larger than `MAX_BYTES`."""
    text = ""
    for most in POINTS:
        text = _page(checked, context, most)
        if len(text.encode()) <= MAX_BYTES:
            break
    return text


def _page(checked: Checked, context: Context, most: int) -> str:
    file, findings, detail = checked.file, checked.findings, checked.detail
    cards = _cards(checked, context)
    counts = Counter(finding.severity for finding in findings)
    start = file.time_start if file.time_start is not None and _timed(detail) else 0.0
    return fill(
        "page.html.j2",
        scripts=("uPlot.iife.min.js", "page.js"),
        styles=("uPlot.min.css", "page.css"),
        data=_data(detail, cards, start, most),
        title=sentence(file.path),
        file=file,
        verdict=verdict(file, counts),
        counts={each.value: counts[each] for each in Severity},
        facts=_facts(file),
        senders=[(f"{v.sysid}/{v.compid}", component(v), v.messages) for v in file.vehicles],
        cards=cards,
        top=_top(cards),
        plan=None if detail is None else flight_plan(detail.flight),
        tracks=[] if detail is None else sorted({t.role for t in detail.flight.tracks}),
        rows=[] if detail is None else meaning.rows(detail.survey),
        runs=file.runs[:MOST_RUNS],
        rules={rule.code: rule for rule in context.rules},
        ends=Counter(verdicts(file.runs).values()),
        judged=judged([file], verbose=True),
        suppressed=checked.suppressed,
        version=context.version,
    )


def _timed(detail: Detail | None) -> bool:
    return detail is not None and detail.flight.timed


def verdict(file: FileReport, counts: Counter[Severity]) -> str:
    """Return what is to be thought of a recording, in a sentence."""
    ends = Counter(verdicts(file.runs).values())
    rules = f"{plural(ends['ran'], 'rule')} of {sum(ends.values())} could judge it"
    if not file.messages:
        return "Nothing in this file could be decoded."
    if not counts:
        return f"Nothing wrong was found; {rules}."
    worst = "Numbers in this recording do not mean what somebody thinks"
    if not counts[Severity.ERROR]:
        worst = "This recording is worth a second look"
        if not counts[Severity.WARNING]:
            worst = "Nothing wrong was found, and something worth knowing"
    return f"{worst}: {found(counts)}; {rules}."


def _facts(file: FileReport) -> list[tuple[str, str, str]]:
    """Return name, key and value of what was read."""
    facts = [("Recording", "kind", file.kind)]
    if file.duration_s is not None:
        facts.append(("Duration", "duration_s", duration(file.duration_s)))
    if file.time_start is not None:
        facts.append(("Began", "time_start", utc(file.time_start)))
    facts.append(("Frames", "messages", str(file.messages)))
    facts += [
        (name, key, str(getattr(file, key)))
        for name, key in (
            ("Bad checksums", "bad_crc"),
            ("Unknown messages", "unknown"),
            ("Bytes skipped", "skipped_bytes"),
        )
        if getattr(file, key)
    ]
    return facts


def _cards(checked: Checked, context: Context) -> list[Card]:
    """Return the findings, the worst first; the surest of these, then in order of time."""
    rules = {rule.code: rule for rule in context.rules}
    proofs = {} if checked.detail is None else checked.detail.proofs
    order = sorted(range(len(checked.findings)), key=lambda k: _rank(checked.findings[k]))
    cards = []
    for place, k in enumerate(order):
        finding = checked.findings[k]
        proof = proofs.get(key_of(finding), Proof())
        drawn = proof.figures if place < MOST_FIGURES else ()
        cards.append(
            Card(
                anchor=f"finding-{k + 1}",
                finding=finding,
                when=when(finding, checked.file),
                evidence=[row for row in evidence_rows(finding) if row[0] != "fix"],
                rule=rules.get(finding.code),
                sure=_SURE[finding.confidence],
                figures=[(f, f"{k}-{n}", _map(f)) for n, f in enumerate(drawn)],
                frame=proof.frame,
                dump=[] if proof.frame is None else dump(proof.frame),
            )
        )
    return cards


def _rank(finding: Finding) -> tuple[int, int, float]:
    sure = list(_SURE).index(finding.confidence)
    return -finding.severity.rank, sure, finding.time_first or 0.0


def _top(cards: Sequence[Card]) -> list[Card]:
    """Return the three most important findings, each of another rule."""
    return list({card.finding.code: card for card in reversed(cards)}.values())[::-1][:3]


def dump(frame: FrameBytes) -> list[tuple[str, str, str]]:
    """Return offset, hexadecimal and characters of every 16 bytes."""
    lines = []
    for at in range(0, len(frame.data), 16):
        part = frame.data[at : at + 16]
        text = "".join(chr(each) if 32 <= each < 127 else "." for each in part)
        lines.append((str(frame.offset + at), part.hex(" "), text))
    return lines


def _map(figure: Figure) -> Markup | None:
    if figure.kind != "plan":
        return None
    paths = [
        Path(t.label, t.role, np.array(t.x), np.array(t.y), must=t.role == "reference")
        for t in figure.traces
    ]
    sent = [p._replace(dots=p.role == "claimed" and len(p.east) < 200) for p in paths]
    return plan(sent if "sent" in figure.title else paths, (), 400, 300, figure.title)


_MUST = ("vehicle", "gnss", "truth")
_DOTS = ("sent", "target")


def flight_plan(flight: Flight) -> Markup | None:
    """Return the map of a flight; None where no position is known."""
    tracks = sorted(flight.tracks, key=lambda each: _DRAWN.index(each.role))
    known = [each for each in tracks if len(each.t)]
    if not known:
        return None
    lat0, lon0 = _centre(flight, known)
    to_m = functools.partial(_metres, lat0=lat0, lon0=lon0)
    paths = [
        Path(
            f"{t.label} ({t.role})", t.role, *to_m(t.y, t.x or ()), t.role in _MUST, t.role in _DOTS
        )
        for t in known
    ]
    several = len({point.system for point in flight.points}) > 1
    marks = []
    for kind, label, lat, lon in dict.fromkeys(
        (p.kind, p.label if several else p.kind, round(p.lat, 6), round(p.lon, 6))
        for p in flight.points
    ):
        east, north = to_m((lat,), (lon,))
        if np.isfinite(east).all():
            marks.append(Mark(kind, label, float(east[0]), float(north[0])))
    return plan(paths, marks, 1100, 620, "Where the vehicles were, seen from above, north up")


_DRAWN = ("plan", "target", "truth", "gnss", "vehicle", "sent")
"""Roles of tracks in the order in which they are drawn."""


def _centre(flight: Flight, tracks: Sequence[Trace]) -> tuple[float, float]:
    """Return the place that metres count from: home, else the middle of the vehicle's track."""
    for point in flight.points:
        if point.kind == "home":
            return point.lat, point.lon
    best = max(tracks, key=lambda each: (each.role in _MUST, len(each.t)))
    return float(np.nanmedian(best.y)), float(np.nanmedian(best.x or (0.0,)))


def _metres(
    lat: Sequence[float], lon: Sequence[float], lat0: float, lon0: float
) -> tuple[Any, Any]:
    north, east = on_plane(np.array(lat), np.array(lon), lat0, lon0)
    return east, north


def _data(detail: Detail | None, cards: Sequence[Card], start: float, most: int) -> dict[str, Any]:
    """Return what the scripts of the page draw."""
    drawn = {
        key: curves.figure(figure, start, max(most // 3, 60))
        for card in cards
        for figure, key, svg in card.figures
        if svg is None
    }
    marks = [
        {
            "anchor": card.anchor,
            "severity": card.finding.severity.value,
            "label": sentence(f"{card.finding.code} {card.finding.name}, {card.finding.subject}"),
            "from": _since(card.finding.time_first, start),
            "to": _since(card.finding.time_last, start),
        }
        for card in cards
        if isinstance(card.finding.location, ByteLocation)
    ]
    flown: dict[str, Any] = {"heights": [], "boots": [], "bands": []}
    if detail is not None:
        flight = detail.flight
        flown["heights"] = heights.curves_of(flight, start, most)
        flown["boots"] = [curves.curve(t, start, most // 2) for t in flight.boots]
        flown["bands"] = [
            {
                "system": band.system,
                "kind": band.kind,
                "label": sentence(band.label),
                "from": round(band.start - start, 3),
                "to": round(band.end - start, 3),
            }
            for band in flight.bands
        ]
    return {"start": start, "timed": _timed(detail), "marks": marks, "figures": drawn, **flown}


def _since(time: float | None, start: float) -> float | None:
    return None if time is None else round(time - start, 3)
