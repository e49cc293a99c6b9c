"""Gathers, in the pass that judges, what a report that draws shows: curves, tracks, the semantic map, bytes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mavframecheck.engine.hexdump import first_frames
from mavframecheck.engine.proofs import Proofs
from mavframecheck.engine.reading import Reading
from mavframecheck.engine.settings import Settings
from mavframecheck.engine.survey import Survey, summary
from mavframecheck.engine.tracks import TrackBook, points
from mavframecheck.model import Finding
from mavframecheck.model.trace import Detail, Figure, Flight, Proof, Trace, key_of
from mavframecheck.sources import Kind, Recording
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.flight import FlightBook, on_plane
from mavframecheck.wire import Batch, Dialect

AROUND_S = 10.0
"""A map of where a vehicle was sent shows its track so long before and after, s."""


class Gatherer:
    """Sees a recording being judged."""

    def __init__(self, recording: Recording) -> None:
        """Start with nothing seen of `recording`."""
        self.timed = recording.kind is not Kind.RAW
        self.proofs = Proofs(timed=self.timed)
        self._name = recording.name
        self._flight = FlightBook(timed=self.timed)
        self._tracks = TrackBook(timed=self.timed)
        self._survey = Survey()

    def update(self, batch: Batch, context: Context) -> None:
        """Take in a batch."""
        self._flight.update(batch, context)
        self._tracks.update(batch, context)
        self._survey.update(batch, context)

    def detail(
        self,
        reading: Reading,
        findings: Sequence[Finding],
        figures: Sequence[tuple[Figure, ...]],
        settings: Settings,
        dialect: Dialect,
    ) -> Detail:
        """Return what was gathered; `figures` are those of each finding."""
        flight = self._flown(reading.context)
        frames = first_frames(self._path, findings, settings, dialect)
        return Detail(
            flight=flight,
            proofs={
                key_of(finding): Proof(figures=(*drawn, *sent_to(finding, flight)), frame=frame)
                for finding, drawn, frame in zip(findings, figures, frames, strict=True)
            },
            survey=summary(reading, self._survey.finish(reading.vehicles())),
        )

    @property
    def _path(self) -> str:
        return "-" if self._name == "<stdin>" else self._name

    def _flown(self, context: Context) -> Flight:
        return Flight(
            timed=self.timed,
            bands=tuple(self._flight.bands()),
            heights=tuple(self._flight.heights()),
            boots=tuple(self._flight.boots()),
            tracks=tuple(self._tracks.traces(context)),
            points=tuple(points(context.registry)),
        )


def sent_to(finding: Finding, flight: Flight) -> tuple[Figure, ...]:
    """Return a map of where a finding's stream sent the vehicle, and where that was; none for others."""
    label = f"{finding.sysid}/{finding.compid} {finding.message_name}"
    sent = [each for each in flight.tracks if each.label == label and each.role in ("sent", "plan")]
    was = [each for each in flight.tracks if each.role == "vehicle"]
    since, until = finding.time_first, finding.time_last
    if not sent or not was or since is None or until is None or not flight.timed:
        return ()
    best = max(was, key=lambda each: len(each.t))
    track = _between(best, since - AROUND_S, until + AROUND_S)
    goals = _between(sent[0], since, until)
    if not track.t or not goals.t:
        return ()
    lines = (_local(goals, track, "sent to", "claimed"), _local(track, track, "was", "reference"))
    return (
        Figure(title="Where it was sent, and where it was", kind="plan", unit="m", traces=lines),
    )


def _between(trace: Trace, since: float, until: float) -> Trace:
    t = np.array(trace.t)
    rows = slice(int(np.searchsorted(t, since)), int(np.searchsorted(t, until, side="right")))
    return Trace(
        label=trace.label,
        role=trace.role,
        t=trace.t[rows],
        y=trace.y[rows],
        x=trace.x[rows] if trace.x is not None else None,
    )


def _local(trace: Trace, centre: Trace, label: str, role: str) -> Trace:
    """Return latitude and longitude as metres from where `centre` begins."""
    lon0 = centre.x[0] if centre.x else 0.0
    north, east = on_plane(np.array(trace.y), np.array(trace.x), centre.y[0], lon0)
    y, x = tuple(north.tolist()), tuple(east.tolist())
    return Trace(label=label, role=role, t=trace.t, y=y, x=x)
