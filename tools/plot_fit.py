"""Write docs/fit.svg: a camera's position beside the way of the vehicle, as labelled and put right.

The recording is `samples/vision_in_enu.tlog`; which correction is drawn is what the judge itself says.
``make generate`` runs it, and a test compares.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.motion import axes
from mavframecheck.checks.motion.series import Series, series_of
from mavframecheck.vehicle.tracks import Tracks
from mavframecheck.wire import load_dialect, read_batches, whole

Floats = npt.NDArray[np.float64]

HERE = Path(__file__).parents[1]
SAMPLE, TARGET = HERE / "samples" / "vision_in_enu.tlog", HERE / "docs" / "fit.svg"
STREAM, REFERENCE = "VISION_POSITION_ESTIMATE", "GLOBAL_POSITION_INT"
WIDTH, SIDE, TOP, GAP, LOW = 760, 300, 96, 60, 110
"""Of the picture and its panels, px: the lower panels are `LOW` high."""
GREY, ORANGE, BLUE = "#888888", "#d55e00", "#0072b2"


def series(path: Path) -> tuple[Series, Series]:
    """Return the stream under test and the way of the vehicle."""
    tracks = Tracks()
    for batch in read_batches([[whole(path.read_bytes(), 0)]], load_dialect(), stamped=True):
        tracks.update(batch)
    found = {key.message: series_of(track) for key, track in tracks.tracks.items()}
    return found[STREAM], found[REFERENCE]


def picture(path: Path) -> str:
    """Return the picture as SVG."""
    stream, reference = series(path)
    fit = axes.compare(stream, reference, axes.NED)
    if isinstance(fit, axes.Undecided):
        raise SystemExit(f"{path}: {fit.why}")
    at = stream.t[np.isfinite(reference.places(stream.t)[:, 0])]
    true = reference.places(at - fit.delay_s)
    said = stream.places(at)
    mended = said @ fit.matrix / fit.scale
    columns = [
        (f"as labelled ({axes.NED.name}): off by {fit.labelled_m:.1f} m", said, ORANGE),
        (f"{fit.says}: off by {fit.residual_m:.2f} m", mended, BLUE),
    ]
    body = [
        _text(16, 26, f"{STREAM} beside the way of the vehicle", size=16, weight="bold"),
        _text(16, 46, f"displacements over {fit.span_s:.0f} s, {fit.track_m:.0f} m of track"),
    ]
    for place, (title, track, colour) in enumerate(columns):
        left = 16 + place * (SIDE + GAP + 22)
        shifted = track + (true - track)[0]
        body += [_text(left, TOP - 12, title, colour)]
        body += _panel(
            left, TOP, SIDE, (true[:, 1], true[:, 0]), (shifted[:, 1], shifted[:, 0]), colour
        )
        body += [_text(left + 6, TOP + 18, "from above: north up, east right", GREY)]
        low = TOP + SIDE + 22
        body += _panel(left, low, LOW, (at, -true[:, 2]), (at, -shifted[:, 2]), colour)
        body += [_text(left + 6, low + 18, "height over time", GREY)]
    height = TOP + SIDE + LOW + 64
    body += [_line(16, height - 20, GREY), _text(46, height - 16, f"the vehicle ({REFERENCE})")]
    body += [_line(286, height - 20, ORANGE), _line(318, height - 20, BLUE)]
    body += [_text(350, height - 16, f"the stream ({STREAM})")]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif">'
    back = f'<rect width="{WIDTH}" height="{height}" fill="white"/>'
    return "\n".join([head, back, *body, "</svg>\n"])


def _panel(
    left: float,
    top: float,
    height: float,
    true: tuple[Floats, Floats],
    said: tuple[Floats, Floats],
    colour: str,
) -> Iterator[str]:
    """Yield a frame and two lines in it, the same scale for both; square metres where it is square."""
    x, y = np.concatenate((true[0], said[0])), np.concatenate((true[1], said[1]))
    low, size = np.array([x.min(), y.min()]), np.array([np.ptp(x), np.ptp(y)])
    if height == SIDE:
        size = np.full(2, size.max())
    scale = np.array([SIDE - 40, height - 46]) / np.maximum(size, 1e-9)
    yield f'<rect x="{left}" y="{top}" width="{SIDE}" height="{height}" fill="none" stroke="#bbbbbb"/>'
    for line, paint, width in ((true, GREY, 7), (said, colour, 2)):
        px = left + 20 + (line[0] - low[0]) * scale[0]
        py = top + height - 16 - (line[1] - low[1]) * scale[1]
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(px.tolist(), py.tolist(), strict=True))
        yield f'<polyline points="{points}" fill="none" stroke="{paint}" stroke-width="{width}"/>'


def _text(
    x: float, y: float, text: str, colour: str = "black", size: int = 13, weight: str = "normal"
) -> str:
    return f'<text x="{x}" y="{y}" fill="{colour}" font-size="{size}" font-weight="{weight}">{text}</text>'


def _line(x: float, y: float, colour: str) -> str:
    return f'<line x1="{x}" y1="{y}" x2="{x + 24}" y2="{y}" stroke="{colour}" stroke-width="3"/>'


if __name__ == "__main__":
    TARGET.write_text(picture(SAMPLE), encoding="utf-8")
