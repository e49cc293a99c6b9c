"""Poses of gimbals and cameras that are older than what they are used with.

Where a gimbal points is not judged: it may be held, moved or slow, and nothing else measures it. What is judged is the
vehicle in its pose: the heading that turns its frame into that of the Earth, and the place that an image was taken at.
Both must be those of the vehicle at that moment.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mavframecheck.checks.base import Observation, Verdict
from mavframecheck.checks.motion.judge import Judge, Listener
from mavframecheck.checks.motion.series import GAP_S, Series, thinned
from mavframecheck.checks.standing import FrozenImages
from mavframecheck.geo import quaternions as q4
from mavframecheck.geo.alignment import trimmed_rms
from mavframecheck.geo.rotations import wrapped
from mavframecheck.model import Scalar, Subject
from mavframecheck.vehicle import Context
from mavframecheck.vehicle.tracks import Track
from mavframecheck.wire import Batch, Dialect

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

FIELDS = {
    "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": "q",
    "GIMBAL_DEVICE_ATTITUDE_STATUS": "delta_yaw",
    "MOUNT_ORIENTATION": "yaw_absolute",
}
"""Where messages say the heading of the vehicle."""
JUDGED_ELSEWHERE = "GIMBAL_DEVICE_ATTITUDE_STATUS"
"""Where it stands still while the vehicle turns away, MFC123 says so."""
GRID_S = 0.1
DELAYS_S: Floats = np.arange(-0.5, 4.05, 0.1)
"""Delays that are tried, s."""
LEAST = 50
"""Moments that are compared."""
SHOWS = np.radians(3.0)
"""A delay shows where the heading of the vehicle is so far from what it was then, rad, ..."""
CLEARLY = 0.4
"""... and what is left with it is less than this share of what is left without."""
FOLLOWS = np.radians(10.0)
"""A heading that is less off than this, rad, follows the vehicle, ..."""
FOLLOWED = 0.2
"""... as it does in this share of the messages where it freezes in others: one that never does is not of this rule."""


class _Told(NamedTuple):
    """What a heading shows."""

    kind: str
    """``fresh``, ``late`` or ``frozen``."""
    seconds: float
    """How late it is, or how long it stood still."""
    left: float
    """How far it is then off the vehicle's, rad, ..."""
    said: float
    """... and as it is said; or how far the vehicle turned meanwhile."""


class StalePose(Listener):
    """Headings of the vehicle, and places of images, that lag behind the vehicle."""

    def __init__(self, params: Mapping[str, Any], dialect: Dialect) -> None:
        """Listen with nothing heard so far."""
        super().__init__(params, dialect)
        self._images = FrozenImages({**params, "min_rows": params["min_images"]}, dialect)
        self._found: list[tuple[Track, _Told | str]] | None = None

    def update(self, batch: Batch, context: Context) -> None:
        """Let the judge hear a batch, and follow the images in it."""
        super().update(batch, context)
        self._images.only = self.only
        self._images.update(batch, context)

    def finish(self) -> Iterable[Observation]:
        """Return one observation for every stream that is late or stands still."""
        for track, told in self._headings():
            if isinstance(told, _Told) and told.kind != "fresh":
                key = track.key
                field = FIELDS[key.message]
                whom = Subject(key.sender >> 8, key.sender & 0xFF, key.message, field)
                values = _values(key.message, told)
                yield Observation(whom, track.first, track.last, track.rows, values)
        for found in self._images.finish():
            yield found._replace(values={**_NOTHING, "kind": "image", **found.values})

    def verdict(self) -> Verdict:
        """Return the rows that could be told, or what was missing."""
        told = [(track, each) for track, each in self._headings()]
        images = self._images.verdict()
        rows = sum(track.rows for track, each in told if isinstance(each, _Told)) + images.checked
        reasons = {f"{track.key.message}: {each}" for track, each in told if isinstance(each, str)}
        missing = "; ".join(sorted(reasons | ({images.insufficient} - {""})))
        return Verdict(rows, partly=missing) if rows else Verdict(0, missing)

    def _headings(self) -> list[tuple[Track, _Told | str]]:
        """Return what the heading in each stream shows."""
        if self._found is None and self._judge is not None:
            tracks = [track for message in FIELDS for track in self._judge.tracks_of(message)]
            mine = [track for track in tracks if self.concerns_sender(track.key.sender)]
            self._found = [
                (track, told) for track in mine for told in _told(self._judge, track, self.params)
            ]
        return self._found or []


_NOTHING: dict[str, Scalar] = dict.fromkeys(
    ("seconds", "left", "labelled", "lat", "lon", "moved_m"), float("nan")
)
"""Values that only some findings have."""


def _told(judge: Judge, track: Track, params: Mapping[str, Any]) -> Iterator[_Told | str]:
    """Yield what the heading in a stream shows, or why it shows nothing; nothing where it says none."""
    said = judge.series(track)
    said = said.where(np.asarray(np.isfinite(said.attitude).all(axis=1)))
    lies = judge.own(track.key.sender >> 8, "ATTITUDE")
    if not len(said.t):
        return
    if lies is None:
        yield "no ATTITUDE of the vehicle"
        return
    true = judge.series(lies)
    stands = None if said.message == JUDGED_ELSEWHERE else _frozen(said, true, params)
    yield stands or _late(said, true, params)


def _off(said: Series, true: Series, at: Floats, delay_s: float) -> Floats:
    """Return (n,) by how much the heading said is off that of the vehicle so long before, rad, but for a constant."""
    off = _yaw(said.attitudes(at)) - _yaw(true.attitudes(at - delay_s))
    known = off[np.isfinite(off)]
    usual = float(np.angle(np.exp(1j * known).sum())) if len(known) else 0.0
    rest = wrapped(known - usual)
    return wrapped(off - usual - (float(np.median(rest)) if len(rest) else 0.0))


def _yaw(lies: Floats) -> Floats:
    return q4.euler_from_quaternion(lies)[:, 2]


def _late(said: Series, true: Series, params: Mapping[str, Any]) -> _Told | str:
    """Say how late a heading is, or why that does not show."""
    at = thinned(said.t, GRID_S)
    by_delay = np.stack([_off(said, true, at, delay) for delay in DELAYS_S.tolist()])
    known = np.isfinite(by_delay).all(axis=0)
    if np.count_nonzero(known) < LEAST:
        return "hardly said at the same time as ATTITUDE"
    left = np.array([trimmed_rms(np.abs(off), 0.97) for off in by_delay[:, known]])
    best, now = int(np.argmin(left)), int(np.argmin(np.abs(DELAYS_S)))
    least_s = float(params["min_delay_s"])
    late = DELAYS_S[best] >= least_s and best < len(DELAYS_S) - 1
    if late and left[now] >= SHOWS and left[best] <= CLEARLY * left[now]:
        return _Told("late", float(DELAYS_S[best]), float(left[best]), float(left[now]))
    turned = _off(true, true, at[known], least_s)
    shows = trimmed_rms(np.abs(turned[np.isfinite(turned)]), 0.97)
    if not shows >= SHOWS:
        return f"the vehicle turns too little to show a delay of {least_s:g} s"
    if late or left[best] > CLEARLY * shows:
        return "its heading follows the vehicle's too roughly"
    return _Told("fresh", float(DELAYS_S[best]), float(left[best]), float(left[now]))


def _frozen(said: Series, true: Series, params: Mapping[str, Any]) -> _Told | None:
    """Return the stretch in which a heading stays the same to the last digit while the vehicle turns most; or none."""
    now = _yaw(true.attitudes(said.t))
    changes = np.any(said.attitude[1:] != said.attitude[:-1], axis=1)
    torn = np.flatnonzero(changes | (np.diff(said.t) > GAP_S)) + 1
    stretches = [k for k in np.split(np.arange(len(said.t)), torn) if len(k) >= params["min_rows"]]
    found = [each for k in stretches if (each := _stood(said, now, k, params)) is not None]
    stands = np.zeros(len(now), np.bool_)
    stands[[row for k, _ in found for row in k.tolist()]] = True
    follows = np.abs(_off(said, true, said.t[~stands], 0.0)) < FOLLOWS
    if not found or np.count_nonzero(follows) < FOLLOWED * len(now):
        return None
    return max((told for _, told in found), key=lambda told: told.said)


def _stood(
    said: Series, now: Floats, rows: npt.NDArray[np.int64], params: Mapping[str, Any]
) -> tuple[npt.NDArray[np.int64], _Told] | None:
    """Return a stretch of equal headings, and what it shows: nothing unless the vehicle turned far meanwhile."""
    seconds = float(said.t[rows[-1]] - said.t[rows[0]])
    known = now[rows][np.isfinite(now[rows])]
    turned = float(np.abs(wrapped(known - known[0])).max()) if len(known) else 0.0
    enough = seconds >= params["min_frozen_s"] and np.degrees(turned) >= params["min_turned_deg"]
    return (rows, _Told("frozen", seconds, 0.0, turned)) if enough else None


def _values(message: str, told: _Told) -> dict[str, Scalar]:
    return {
        **_NOTHING,
        "message": message,
        "kind": told.kind,
        "seconds": told.seconds,
        "left": float(np.degrees(told.left)),
        "labelled": float(np.degrees(told.said)),
    }
