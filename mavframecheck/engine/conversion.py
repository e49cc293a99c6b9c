"""All positions of a recording in one representation: what cannot be converted says why."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.positions import Extract
from mavframecheck.geo import utm
from mavframecheck.semantics.enums import AltRef
from mavframecheck.semantics.positions import (
    BodyVector,
    EarthAxes,
    EcefPosition,
    GeodeticPosition,
    LocalPosition,
    MixingError,
    Origin,
    Position,
)

Bools = npt.NDArray[np.bool_]
Representation: TypeAlias = Literal["geodetic", "ecef", "ned", "enu", "utm"]

_AXES: dict[str, EarthAxes] = {"ned": "NED", "enu": "ENU"}
_NO_HEIGHT = "no height, which this representation needs"
_NO_LEVEL = "nothing says how high the level is that its height is counted from"


@dataclass(frozen=True)
class Target:
    """What positions are to become."""

    representation: Representation | None = None
    """None: each stays what it is."""
    height: AltRef | None = None
    """`ellipsoid` or `msl` for geodetic positions and UTM; None: as they are."""
    origin: Origin | None = None
    """Of local positions; None: the one in force of the vehicle."""
    zone: tuple[int, bool] | None = None
    """UTM zone, and whether it is the northern half; None: that of the first position."""


class Converter:
    """Converts extracts, batch by batch, with the zone that the first position chose."""

    def __init__(self, target: Target) -> None:
        """Convert to `target`."""
        self._target = target
        self._zone = target.zone

    def convert(self, extracts: Iterable[Extract]) -> list[Extract]:
        """Return the extracts of a batch in the target's representation."""
        target = self._target
        if target.representation is None:
            return [self._with_height(each) if target.height else each for each in extracts]
        if target.representation != "utm":
            return [self._one(each) for each in extracts]
        return self._to_utm([self._to_geodetic(each) for each in extracts])

    def _one(self, extract: Extract) -> Extract:
        if self._target.representation == "geodetic":
            return self._to_geodetic(extract)
        try:
            position = _point(extract.position)
            if isinstance(position, GeodeticPosition):
                position = position.above(AltRef.ELLIPSOID, extract.level_msl_m)
            converted = self._straight(position, extract.origin)
        except MixingError as error:
            return _refused(extract, str(error))
        found = np.asarray(np.isfinite(converted.xyz).all(axis=1))
        return _replaced(extract, converted, found)

    def _straight(
        self, position: GeodeticPosition | LocalPosition, in_force: Origin | None
    ) -> EcefPosition | LocalPosition:
        """Return a position along the straight axes of the target."""
        if self._target.representation == "ecef":
            return position.to_ecef()
        origin = self._target.origin or in_force
        if origin is None:
            raise MixingError("no local origin is in force; give one with --origin")
        return position.to_local(origin, _AXES[str(self._target.representation)])

    def _to_geodetic(self, extract: Extract) -> Extract:
        try:
            position = _point(extract.position)
            if isinstance(position, LocalPosition):
                position = position.to_geodetic()
                found = np.asarray(np.isfinite(position.lat_deg))
                extract = _replaced(extract, position, found)
        except MixingError as error:
            return _refused(extract, str(error))
        return self._with_height(extract)

    def _with_height(self, extract: Extract) -> Extract:
        """Return the extract with heights above what was asked for; one that has none stays without."""
        wanted, position = self._target.height, extract.position
        if wanted is None or not isinstance(position, GeodeticPosition):
            return extract
        try:
            raised = position.above(wanted, extract.level_msl_m)
        except MixingError as error:
            unknown = np.full(len(position), np.nan)
            blank = replace(position, height_m=unknown, height_reference=wanted)
            return _refused(extract, str(error), blank)
        found = np.isfinite(raised.height_m) | ~np.isfinite(position.height_m)
        return _replaced(extract, raised, found, _NO_LEVEL)

    def _to_utm(self, extracts: list[Extract]) -> list[Extract]:
        self._zone = self._zone or _first_zone(extracts)
        return [part for each in extracts for part in self._in_zone(each) if len(part)]

    def _in_zone(self, extract: Extract) -> Iterator[Extract]:
        """Yield what lies in the zone, on its map, and what does not, without a position."""
        position = extract.position
        if not isinstance(position, GeodeticPosition):
            yield extract
            return
        zones = utm.zone(position.lat_deg, position.lon_deg)
        good, on_a_map = extract.problem == "", zones > 0
        if self._zone is not None:
            number, north = self._zone
            inside = good & (zones == number) & ((position.lat_deg >= 0) == north)
            flat = position.take(inside).to_utm(number, north=north)
            yield replace(extract.take(inside), position=flat)
            words = f"not in UTM zone {flat.zone}{flat.hemisphere}: two zones do not mix"
            yield _refused(extract.take(good & on_a_map & ~inside), words)
        yield _refused(extract.take(~good | ~on_a_map), "UTM reaches from 80 S to 84 N")


def _point(position: Position | None) -> GeodeticPosition | LocalPosition:
    """Return a position that has a place on the Earth, or may have one."""
    if isinstance(position, GeodeticPosition | LocalPosition):
        return position
    raise MixingError("an offset in body axes needs the place and the attitude of the vehicle")


def _first_zone(extracts: list[Extract]) -> tuple[int, bool] | None:
    """Return zone and hemisphere of the first valid position of a batch, in frame order."""
    firsts = sorted(_candidates(extracts))
    return (firsts[0][-2], firsts[0][-1]) if firsts else None


def _candidates(extracts: list[Extract]) -> Iterator[tuple[int, int, int, bool]]:
    for place, extract in enumerate(extracts):
        position = extract.position
        if isinstance(position, GeodeticPosition):
            zones = utm.zone(position.lat_deg, position.lon_deg)
            good = np.flatnonzero((extract.problem == "") & (zones > 0))
            if len(good):
                row = good[np.argmin(extract.number[good])]
                north = bool(position.lat_deg[row] >= 0)
                yield int(extract.number[row]), place, int(zones[row]), north


def _refused(extract: Extract, reason: str, position: Position | None = None) -> Extract:
    """Return the extract without a position (or with what is left of it), and the reason."""
    problem = np.where(extract.problem == "", reason, extract.problem)
    measured = replace(extract.measured, valid=np.zeros(len(extract), np.bool_))
    frame = extract.frame if position is None else None
    return replace(extract, position=position, problem=problem, measured=measured, frame=frame)


def _replaced(
    extract: Extract, position: Position, found: Bools, words: str = _NO_HEIGHT
) -> Extract:
    """Return the extract with its new `position`; rows that are not `found` say `words`."""
    problem = np.where((extract.problem == "") & ~found, words, extract.problem)
    measured = extract.measured if isinstance(position, BodyVector) else position.measured
    measured = replace(measured, valid=problem == "")
    frame = f"local_{position.axes.lower()}" if isinstance(position, LocalPosition) else None
    return replace(extract, position=position, problem=problem, measured=measured, frame=frame)
