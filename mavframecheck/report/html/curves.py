"""Traces as the page draws them: short numbers, torn where nothing was heard."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.model.trace import Figure, Trace
from mavframecheck.report.escape import sentence
from mavframecheck.vehicle.thinning import extremes

Floats = npt.NDArray[np.float64]

_GAP_S = 5.0
_GAP_TIMES = 10.0
"""A line is torn where neighbours are further apart than both: s, and times the usual distance."""


def curve(trace: Trace, start: float, most: int) -> dict[str, Any]:
    """Return a line over time for the page: times from `start`, s, no more than about `most` points."""
    t, y = thin(np.array(trace.t) - start, np.array(trace.y), most)
    t, y = torn(t, y)
    return {
        "label": sentence(trace.label),
        "role": trace.role,
        "t": [round(each, 3) for each in t.tolist()],
        "y": [_short(each) for each in y.tolist()],
    }


def figure(drawn: Figure, start: float, most: int) -> dict[str, Any]:
    """Return a figure of lines over time for the page."""
    return {
        "unit": sentence(drawn.unit),
        "series": [curve(trace, start, most) for trace in drawn.traces],
    }


def thin(t: Floats, y: Floats, most: int) -> tuple[Floats, Floats]:
    """Return least and greatest of every few rows, so that about `most` are left."""
    if len(t) <= most:
        return t, y
    stretch = np.arange(len(t)) * max(most // 2, 1) // len(t)
    places = extremes(stretch, y[:, np.newaxis])
    return t[places], y[places]


def torn(t: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the same with NaN put into long gaps."""
    if len(t) < 3:
        return t, y
    apart = np.diff(t)
    gaps = np.flatnonzero((apart > _GAP_S) & (apart > _GAP_TIMES * np.median(apart)))
    return np.insert(t, gaps + 1, (t[gaps] + t[gaps + 1]) / 2), np.insert(y, gaps + 1, np.nan)


def _short(value: float) -> float | None:
    """Return a number of seven digits; None for what is none."""
    return float(f"{value:.7g}") if np.isfinite(value) else None
