"""What proves a finding about clocks: receive time minus stamp, over the recording."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.model import Subject
from mavframecheck.model.trace import Figure, Trace
from mavframecheck.vehicle.flight import line
from mavframecheck.vehicle.timing import Clocks, Timing

MOST_STREAMS = 6
"""Streams of a component that are drawn where a finding names none."""
_NOTE = (
    "A level line is a clock that keeps time; a slope is one that runs fast or slow, or another unit; "
    "a step is a clock that was set, or a restart; what rises and falls back is delay on the way."
)


def offsets(clocks: Clocks, subject: Subject) -> Iterator[Figure]:
    """Yield how receive time and stamp part: of the stream of a finding, and of its sender's steadiest."""
    timed = [each for each in clocks.timings if len(each.stream.knots) > 1]
    sent = [each for each in timed if each.stream.subject[:2] == (subject.sysid, subject.compid)]
    named = [each for each in sent if each.stream.subject[2] == subject.message]
    others = sorted(
        (each for each in sent if each not in named), key=lambda each: -each.stream.stamped
    )
    drawn = [(each, "claimed") for each in named[:MOST_STREAMS]]
    room = 1 if named else MOST_STREAMS
    drawn += [(each, "reference" if named else "") for each in others[:room]]
    if drawn:
        traces = tuple(_offset(timing, role) for timing, role in drawn)
        title = "Receive time minus stamp, from its first value"
        yield Figure(title=title, kind="time", unit="s", traces=traces, note=_NOTE)


def _offset(timing: Timing, role: str) -> Trace:
    knots = timing.stream.knots
    t = knots["low_t_us"] * 1e-6
    lag = t - knots["low_stamp"] * timing.unit_s
    order = np.argsort(t, kind="stable")
    system, component, message, name = timing.stream.subject
    label = f"{system}/{component} {message}.{name}"
    return line(label, t[order], np.asarray(lag - lag[0])[order], role)
