"""Maps as SVG: north up, east to the right, one scale for both, which a bar tells.

What lies so far away that it would shrink the rest to a dot is an arrow at the edge with its distance.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from mavframecheck.report.escape import sentence

Floats = npt.NDArray[np.float64]

FAR = 6.0
"""What lies further from the middle than this many times the size of what must be seen is far."""
LEAST_M = 20.0
"""A map shows at least so much, m."""
_BAR_SHARE = 0.22
_ARROW_AT, _SHORTEST = 0.3, 60.0
"""Where on a line its direction is shown (share of its length), and from what length on."""
_MARGIN = 0.08
_MOST_MARKS = 40
_APART = 26.0
"""Marks nearer to each other on the drawing are one."""


class Path(NamedTuple):
    """A line, or places, on a map; (n,) m east and north, NaN where it is torn."""

    label: str
    role: str
    east: Floats
    north: Floats
    must: bool = True
    """Whether the map is made large enough for it."""
    dots: bool = False
    """Whether they are single places."""


class Mark(NamedTuple):
    """A place with a name."""

    kind: str
    label: str
    east: float
    north: float


class _View(NamedTuple):
    """From metres to the units of the drawing."""

    east: float
    north: float
    per_m: float
    width: int
    height: int

    def x(self, east: Floats | float) -> Floats:
        return np.asarray(self.width / 2 + (np.asarray(east) - self.east) * self.per_m)

    def y(self, north: Floats | float) -> Floats:
        return np.asarray(self.height / 2 - (np.asarray(north) - self.north) * self.per_m)


def plan(
    paths: Sequence[Path], marks: Sequence[Mark], width: int, height: int, title: str
) -> Markup:
    """Return a map of `paths` and `marks`, `width` by `height`."""
    view = _view(paths, marks, width, height)
    parts = [
        Markup('<svg class="plan" viewBox="0 0 {w} {h}" role="img" aria-label="{title}"').format(
            w=width, h=height, title=sentence(title)
        )
        + Markup(' data-per-m="{}" tabindex="0">').format(f"{view.per_m:.9g}"),
        *(part for path in paths for part in _path(path, view)),
        *(_mark(mark, view) for mark in _merged(marks, view)),
        *_bar(view),
        _NORTH.format(x=width - 26),
        Markup("</svg>"),
    ]
    return Markup("\n").join(parts)


_NORTH = Markup(
    '<g class="fixed north"><path d="M{x} 14l7 22l-7 -5l-7 5z"/><text x="{x}" y="50" '
    'text-anchor="middle">N</text></g>'
)


def _view(paths: Sequence[Path], marks: Sequence[Mark], width: int, height: int) -> _View:
    """Return the view that shows what must be seen, and of the rest what is not far."""
    must = [_places(path.east, path.north) for path in paths if path.must]
    must += [np.array([[mark.east, mark.north]]) for mark in marks if not must]
    seen = np.concatenate(must) if must else np.zeros((0, 2))
    if not len(seen):
        seen = np.concatenate([np.zeros((1, 2)), *(_places(p.east, p.north) for p in paths)])
    low, high = seen.min(axis=0), seen.max(axis=0)
    size = max(float((high - low).max()), LEAST_M)
    others = [_places(path.east, path.north) for path in paths if not path.must]
    others.append(np.array([[m.east, m.north] for m in marks]).reshape(-1, 2))
    for places in others:
        near = places[np.abs(places - (low + high) / 2).max(axis=1) < FAR * size]
        if len(near):
            low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
    east, north = ((low + high) / 2).tolist()
    wide, tall = np.maximum(high - low, LEAST_M / 2).tolist()
    per_m = (1 - 2 * _MARGIN) * min(width / max(wide, LEAST_M), height / max(tall, LEAST_M))
    return _View(east, north, per_m, width, height)


def _places(east: Floats, north: Floats) -> Floats:
    """Return (k, 2) the places of a path that are known."""
    places = np.column_stack((east, north))
    return places[np.isfinite(places).all(axis=1)]


def _path(path: Path, view: _View) -> Iterator[Markup]:
    """Yield a line or dots, and an arrow to what lies outside."""
    x, y = view.x(path.east), view.y(path.north)
    known = np.isfinite(x) & np.isfinite(y)
    outside = np.maximum(np.abs(x / view.width - 0.5), np.abs(y / view.height - 0.5)) > FAR
    inside = known & ~outside
    css = f"path {path.role}"
    title = Markup("<title>{}</title>").format(sentence(path.label))
    if path.dots:
        shape = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x[inside], y[inside]))
        css += " dots"
    else:
        shape = _line(x, y, inside)
    if shape:
        yield Markup('<path class="{}" d="{}">{}</path>').format(css, shape, title)
    if not path.dots:
        yield from _direction(path, x[inside], y[inside])
    far = np.flatnonzero(known & outside)
    if len(far):
        yield _arrow(path, view, int(far[0]))


def _direction(path: Path, x: Floats, y: Floats) -> Iterator[Markup]:
    """Yield an arrowhead early on a line: which way it goes."""
    gone = np.cumsum(np.hypot(np.diff(x), np.diff(y)))
    if not len(gone) or gone[-1] < _SHORTEST:
        return
    k = int(np.searchsorted(gone, _ARROW_AT * gone[-1]))
    turn = math.degrees(math.atan2(y[k + 1] - y[k], x[k + 1] - x[k]))
    yield Markup(
        '<path class="way {}" d="M6 0L-5 5L-5 -5z" transform="translate({} {}) rotate({})"/>'
    ).format(path.role, f"{x[k]:.1f}", f"{y[k]:.1f}", f"{turn:.0f}")


def _line(x: Floats, y: Floats, inside: npt.NDArray[np.bool_]) -> str:
    """Return the ``d`` of a path that is torn where `inside` is not."""
    pieces, pen = [], "M"
    for a, b, here in zip(x.tolist(), y.tolist(), inside.tolist()):
        if not here:
            pen = "M"
            continue
        pieces.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(pieces)


def _arrow(path: Path, view: _View, place: int) -> Markup:
    """Return an arrow at the edge towards a place that is far away."""
    east, north = float(path.east[place]) - view.east, float(path.north[place]) - view.north
    away, bearing = math.hypot(east, north), math.degrees(math.atan2(east, north))
    reach = min(view.width, view.height) / 2 - 30
    x, y = view.width / 2 + reach * east / away, view.height / 2 - reach * north / away
    text = f"{sentence(path.label)}: {distance(away)} away, {bearing % 360:.0f}\N{DEGREE SIGN}"
    return Markup(
        '<g class="far {role}"><path d="M{x} {y}l-6 14l6 -4l6 4z" transform="rotate({turn} {x} {y})"/>'
        '<text x="{tx}" y="{ty}" text-anchor="middle">{text}</text></g>'
    ).format(
        role=path.role,
        x=f"{x:.1f}",
        y=f"{y:.1f}",
        turn=f"{bearing:.1f}",
        tx=f"{min(max(x, 130), view.width - 130):.1f}",
        ty=f"{y + 30 if y < view.height / 2 else y - 22:.1f}",
        text=text,
    )


def _merged(marks: Sequence[Mark], view: _View) -> list[Mark]:
    """Return the marks inside the view; those that lie on each other as one with both names."""
    merged: list[Mark] = []
    for mark in (each for each in marks if _near(each, view)):
        for k, other in enumerate(merged):
            if math.hypot(mark.east - other.east, mark.north - other.north) * view.per_m < _APART:
                names = dict.fromkeys([*other.label.split(", "), mark.label])
                merged[k] = other._replace(label=", ".join(names))
                break
        else:
            merged.append(mark)
    return merged[:_MOST_MARKS]


def _near(mark: Mark, view: _View) -> bool:
    x, y = float(view.x(mark.east)), float(view.y(mark.north))
    return 0 <= x <= view.width and 0 <= y <= view.height


_SHAPES = {
    "home": "M-7 1L0 -7L7 1H4V7H-4V1Z",
    "origin": "M-7 0H7M0 -7V7M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0",
    "launch": "M-5 6L0 -6L5 6Z",
}


def _mark(mark: Mark, view: _View) -> Markup:
    return Markup(
        '<g class="mark {kind}" transform="translate({x} {y})"><path d="{shape}"/>'
        '<text x="10" y="4">{label}</text></g>'
    ).format(
        kind=mark.kind,
        x=f"{float(view.x(mark.east)):.1f}",
        y=f"{float(view.y(mark.north)):.1f}",
        shape=_SHAPES.get(mark.kind, ""),
        label=sentence(mark.label),
    )


def _bar(view: _View) -> Iterable[Markup]:
    """Yield the scale: a bar of a round length."""
    metres = round_length(view.width * _BAR_SHARE / view.per_m)
    length, y = metres * view.per_m, view.height - 16
    yield Markup(
        '<g class="fixed scale"><path d="M16 {up}v8h{length}v-8"/><text x="{middle}" y="{text_y}" '
        'text-anchor="middle">{text}</text></g>'
    ).format(
        up=y - 8,
        length=f"{length:.1f}",
        middle=f"{16 + length / 2:.1f}",
        text_y=y - 6,
        text=distance(metres),
    )


def round_length(most_m: float) -> float:
    """Return the greatest of 1, 2 and 5 times a power of ten that is no longer than `most_m`."""
    power: float = 10.0 ** math.floor(math.log10(most_m))
    return next(k * power for k in (5, 2, 1) if k * power <= most_m * (1 + 1e-9))


def distance(metres: float) -> str:
    """Return ``50 m`` or ``5317 km``."""
    return f"{metres:g} m" if metres < 1000 and metres == round(metres, 3) else _long(metres)


def _long(metres: float) -> str:
    if metres < 1000:
        return f"{metres:.0f} m"
    return f"{metres / 1000:.1f} km" if metres < 100_000 else f"{metres / 1000:.0f} km"
