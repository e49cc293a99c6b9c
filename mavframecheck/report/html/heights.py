"""Heights on one axis: each as it was said, and all brought to mean sea level by what each counts from."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from mavframecheck.geo.geoid import undulation
from mavframecheck.model.trace import Flight, Trace
from mavframecheck.report.html.curves import curve

Floats = npt.NDArray[np.float64]


def curves_of(flight: Flight, start: float, most: int) -> list[dict[str, Any]]:
    """Return the heights of a flight; ``sea`` is the same above mean sea level, None where that is not known."""
    found = []
    for trace in flight.heights:
        said = curve(trace, start, most)
        t = np.array(said["t"]) + start
        level = _level(trace, flight, t)
        if level is None:
            sea = None
        else:
            pairs = zip(said["y"], level.tolist())
            sea = [None if y is None or np.isnan(z) else round(y + z, 3) for y, z in pairs]
        found.append({**said, "sea": sea})
    return found


def _level(trace: Trace, flight: Flight, t: Floats) -> Floats | None:
    """Return (n,) how high above mean sea level the zero of a height is; None where it is not known."""
    if trace.role in ("msl", "ground"):
        return np.zeros(len(t))
    if trace.role in ("home", "origin"):
        places = [p for p in flight.points if (p.kind, p.system) == (trace.role, trace.system)]
        known = [(p.time if p.time is not None else -np.inf, p.alt_msl) for p in places]
        return _last(known, t) if known else None
    if trace.role == "ellipsoid":
        return _geoid(flight, t)
    ground = next((each for each in flight.heights if each.role == "ground"), None)
    return None if ground is None else np.asarray(np.interp(t, ground.t, ground.y), np.float64)


def _last(known: list[tuple[float, float]], t: Floats) -> Floats:
    """Return the last of (time, value) before each time, the first one before all."""
    since, values = np.array(sorted(known)).T
    place = np.maximum(np.searchsorted(since, t, side="right") - 1, 0)
    return np.asarray(values[place], np.float64)


def _geoid(flight: Flight, t: Floats) -> Floats | None:
    """Return minus the undulation of the geoid along the track of a vehicle."""
    tracks = [each for each in flight.tracks if each.role in ("vehicle", "gnss") and each.x]
    if not tracks:
        return None
    best = max(tracks, key=lambda each: len(each.t))
    lat, lon = (np.interp(t, best.t, column) for column in (best.y, best.x or ()))
    return np.asarray(-undulation(lat, lon), np.float64)
