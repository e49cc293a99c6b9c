"""Positions and vectors as types: columns of numbers that know what they are and refuse to be mixed.

A position is not three numbers. Each type here holds (n,) or (n, 3) columns of one frame, and says so:
datum, height reference, axes, origin; beside them `Measured` says when, by which clock, of which point,
by whom and how well. What does not fit together raises `MixingError`. Subtracting positions of one
frame gives a vector; points are moved and turned from frame to frame, vectors only turned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Literal, NoReturn, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from mavframecheck.geo import geodesy, rotations, utm
from mavframecheck.geo.geoid import undulation
from mavframecheck.semantics.enums import AltRef, Clock, RefPoint
from mavframecheck.semantics.references import height_reference as height_words

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

WGS84 = "WGS84"
NO_TIME = np.iinfo(np.int64).min
"""In a column of times: not known."""

EarthAxes: TypeAlias = Literal["NED", "ENU"]
"""Axes tied to the directions on the ground; the others (FRD, FLU) are turned by a heading."""
_TURNS: dict[tuple[str, str], Floats] = {
    ("NED", "ENU"): rotations.ENU_FROM_NED,
    ("ENU", "NED"): rotations.ENU_FROM_NED,
    ("FRD", "FLU"): rotations.FLU_FROM_FRD,
    ("FLU", "FRD"): rotations.FLU_FROM_FRD,
}


class MixingError(TypeError):
    """Two things do not fit together: frames, origins, heights, zones or units."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a local frame is zero. Two origins are one only when all they say is the same."""

    origin_id: str | None
    """Its name in a registry; None: known by its place alone."""
    lat_deg: float
    lon_deg: float
    height_m: float
    height_reference: AltRef
    """`ellipsoid` or `msl`; anything else is no place."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "height_reference", AltRef(self.height_reference))

    def __str__(self) -> str:
        return f"origin {self.origin_id or f'{self.lat_deg:.7f}, {self.lon_deg:.7f}'}"

    @property
    def ellipsoid_height_m(self) -> float:
        """Height above the WGS 84 ellipsoid, through the geoid where it is given above sea level."""
        place = GeodeticPosition(
            [self.lat_deg], [self.lon_deg], [self.height_m], self.height_reference
        )
        return float(place.above(AltRef.ELLIPSOID).height_m[0])

    @property
    def ecef_m(self) -> Floats:
        """(3,) m, ECEF."""
        return geodesy.ecef_from_geodetic(self.lat_deg, self.lon_deg, self.ellipsoid_height_m)

    @property
    def ned_from_ecef(self) -> Floats:
        """(3, 3): the axes of the local frame, written in ECEF."""
        return rotations.ned_from_ecef(self.lat_deg, self.lon_deg)


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """What a position says beside its numbers. Columns are (n,) unless said otherwise, or None: not known."""

    source: str = ""
    """Who says so: ``1/1 GPS_RAW_INT``."""
    point: RefPoint = RefPoint.NONE
    """The point of the vehicle (or another thing) that it is about."""
    clock: Clock = Clock.NONE
    """Clock of `time_ns`."""
    time_ns: Ints | None = None
    """When it was measured, on the clock of whoever measured it; `NO_TIME` where unknown."""
    utc_ns: Ints | None = None
    """The same moment, ns since 1970 UTC."""
    received_ns: Ints | None = None
    """When it was received, ns since 1970 UTC."""
    valid: Bools | None = None
    covariance_m2: Floats | None = None
    """(n, 3, 3) m^2, in the axes named by `covariance_frame`; NaN where unknown."""
    covariance_frame: str = ""
    """``local_ned``, ``local_enu`` (at the point, or of the local frame), ``ecef``, ``own``."""
    horizontal_accuracy_m: Floats | None = None
    vertical_accuracy_m: Floats | None = None

    def take(self, rows: Ints | Bools) -> Self:
        """Return some of the rows."""
        taken: Self = _taken(self, rows)
        return taken

    def turned(self, matrix: Callable[[], Floats], frame: str) -> Self:
        """Return the same with its covariance turned by ``target_from_source`` into `frame`."""
        if self.covariance_m2 is None:
            return self
        turned = rotations.turn_covariance(matrix(), self.covariance_m2)
        return replace(self, covariance_m2=turned, covariance_frame=frame)

    def elapsed_s(self, since: Measured) -> Floats:
        """Return (n,) s between two measurements; refused across clocks, NaN where a time is unknown."""
        if self.clock != since.clock or not self.clock:
            raise MixingError(
                f"cannot subtract a time on the {since.clock or 'unknown'} clock from one on the "
                f"{self.clock or 'unknown'} clock: their zeros differ; compare utc_ns instead"
            )
        if self.time_ns is None or since.time_ns is None:
            raise MixingError("cannot subtract times that are not known")
        known = (self.time_ns != NO_TIME) & (since.time_ns != NO_TIME)
        return np.where(known, (self.time_ns - since.time_ns) * 1e-9, np.nan)


class _Typed:
    """What positions and vectors share."""

    # numpy would add a position to an array number by number, and lose what it is
    __array_ufunc__ = None

    def take(self, rows: Ints | Bools) -> Self:
        """Return some of the rows."""
        taken: Self = _taken(self, rows)
        return taken

    @property
    def described(self) -> str:
        """The frame in words."""
        raise NotImplementedError

    def __radd__(self, other: object) -> NoReturn:
        self._refuse("add", other, "numbers without a frame have no place")

    def __rsub__(self, other: object) -> NoReturn:
        self._refuse("subtract", other, "numbers without a frame have no place")

    def _refuse(self, verb: str, other: object, why: str) -> NoReturn:
        """Raise, naming both sides: "subtract B from A", "add B to A"."""
        word = "from" if verb == "subtract" else "to"
        raise MixingError(f"cannot {verb} {_named(other)} {word} {_named(self)}: {why}")


def _named(thing: object) -> str:
    return thing.described if isinstance(thing, _Typed) else f"plain {type(thing).__name__}"


def _taken(thing: Any, rows: Ints | Bools) -> Any:
    """Return a dataclass of columns with some rows of each."""
    changes: dict[str, Any] = {}
    for column in fields(thing):
        value = getattr(thing, column.name)
        if isinstance(value, np.ndarray):
            changes[column.name] = value[rows]
        elif isinstance(value, Measured):
            changes[column.name] = value.take(rows)
    return replace(thing, **changes)


class _Metric(_Typed):
    """Three metres along straight axes: `xyz`, and a key that tells whether two share a frame."""

    xyz: Floats

    def __post_init__(self) -> None:
        """Bring `xyz` to (n, 3)."""
        _set(self, xyz=_triples(self.xyz))

    @property
    def frame(self) -> tuple[object, ...]:
        """What must be equal for two to be in one frame; empty when nobody can tell."""
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self.xyz)

    def _same(self, verb: str, other: _Metric) -> None:
        if self.frame != other.frame:
            self._refuse(verb, other, "they are not in one frame; convert one of them first")
        if not self.frame:
            self._refuse(verb, other, "nothing says where the origin is, so it may have moved")


class _Vector(_Metric):
    """A free vector: a difference of positions, a velocity. It has no place."""

    unit: str

    def __add__(self, other: object) -> Any:
        """Return the sum of two vectors; a position is moved."""
        return other + self if isinstance(other, _Point) else self._plus("add", other, 1.0)

    def __sub__(self, other: object) -> Self:
        return self._plus("subtract", other, -1.0)

    def __neg__(self) -> Self:
        return self * -1.0

    def __mul__(self, factor: float) -> Self:
        return replace(self, xyz=self.xyz * factor)  # type: ignore[type-var]

    __rmul__ = __mul__

    @property
    def norm(self) -> Floats:
        """(n,) length, in `unit`."""
        return np.asarray(np.linalg.norm(self.xyz, axis=-1))

    def _plus(self, verb: str, other: object, sign: float) -> Self:
        if not isinstance(other, _Vector):
            self._refuse(verb, other, "only a vector goes with a vector")
        self._same(verb, other)
        if self.unit != other.unit:
            self._refuse(verb, other, f"{other.unit} are not {self.unit}")
        return replace(self, xyz=self.xyz + sign * other.xyz)  # type: ignore[type-var]


class _Point(_Metric):
    """A position along straight axes. Minus another it is a vector; a vector moves it."""

    measured: Measured

    def _difference(self, xyz: Floats) -> _Vector:
        """Return `xyz` as a vector of this frame."""
        raise NotImplementedError

    def __add__(self, other: object) -> Self:
        return self._moved("add", other, 1.0)

    def __sub__(self, other: object) -> Any:
        """Return the vector from another position to this one; minus a vector, a position."""
        if not isinstance(other, _Point):
            return self._moved("subtract", other, -1.0)
        self._same("subtract", other)
        return self._difference(self.xyz - other.xyz)

    def _moved(self, verb: str, other: object, sign: float) -> Self:
        if not isinstance(other, _Vector):
            self._refuse(verb, other, "only a vector can move a position")
        self._same_as_difference(verb, other)
        if other.unit != "m":
            self._refuse(verb, other, f"a position is moved by m, not by {other.unit}")
        return replace(self, xyz=self.xyz + sign * other.xyz)  # type: ignore[type-var]

    def _same_as_difference(self, verb: str, other: _Vector) -> None:
        if self._difference(other.xyz).frame != other.frame:
            self._refuse(verb, other, "they are not in one frame; turn the vector first")
        if not other.frame:
            self._refuse(verb, other, "nothing says where the origin is, so it may have moved")


@dataclass(frozen=True, eq=False)
class GeodeticPosition(_Typed):
    """Latitude, longitude and height on the WGS 84 ellipsoid; all columns (n,)."""

    lat_deg: Floats
    lon_deg: Floats
    height_m: Floats
    height_reference: AltRef
    """What the height is above. Nothing is assumed."""
    measured: Measured = field(default_factory=Measured)
    datum: str = WGS84
    representation: ClassVar[str] = "geodetic"

    def __init__(
        self,
        lat_deg: npt.ArrayLike,
        lon_deg: npt.ArrayLike,
        height_m: npt.ArrayLike,
        height_reference: AltRef | str,
        measured: Measured | None = None,
        datum: str = WGS84,
    ) -> None:
        columns = (np.atleast_1d(np.asarray(each, float)) for each in (lat_deg, lon_deg, height_m))
        lat, lon, height = np.broadcast_arrays(*columns)
        _set(self, lat_deg=lat, lon_deg=lon, height_m=height, datum=datum,
             height_reference=AltRef(height_reference), measured=measured or Measured())  # fmt: skip

    def __len__(self) -> int:
        return len(self.lat_deg)

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"a geodetic position on {self.datum}, {_height(self.height_reference)}"

    def __add__(self, other: object) -> NoReturn:
        self._refuse("add", other, "degrees are not metres; convert with to_ecef or to_local first")

    def __sub__(self, other: object) -> NoReturn:
        why = "degrees are not metres; convert both with to_ecef or to_local first"
        self._refuse("subtract", other, why)

    def above(self, reference: AltRef | str, level_msl_m: npt.ArrayLike | None = None) -> Self:
        """Return the same places with heights above `reference`, `ellipsoid` or `msl`.

        Mean sea level is the EGM96 geoid. A height above home or the origin needs `level_msl_m`, the
        height of that level above the sea. Above terrain, ground or pressure levels nothing helps.
        """
        wanted, own = AltRef(reference), self.height_reference
        if wanted == own:
            return self
        if wanted not in (AltRef.ELLIPSOID, AltRef.MSL):
            raise MixingError(f"heights become ones above the ellipsoid or the sea, not {wanted}")
        sign = 1.0 if wanted is AltRef.ELLIPSOID else -1.0
        if own in (AltRef.ELLIPSOID, AltRef.MSL):
            height = self.height_m + sign * undulation(self.lat_deg, self.lon_deg)
            return replace(self, height_m=height, height_reference=wanted)
        if own in (AltRef.HOME, AltRef.ORIGIN) and level_msl_m is not None:
            height = self.height_m + np.asarray(level_msl_m, float)
            return replace(self, height_m=height, height_reference=AltRef.MSL).above(wanted)
        raise MixingError(
            f"a height {height_words(own).label} cannot become one {height_words(wanted).label}: "
            f"nothing says how high that level is"
        )

    def height_difference_m(self, other: GeodeticPosition) -> Floats:
        """Return (n,) m by which these heights exceed others of the same reference; else refused."""
        unknown = self.height_reference in (AltRef.UNSPECIFIED, AltRef.NONE)
        if self.height_reference != other.height_reference or unknown:
            self._refuse("subtract", other, "their heights have different zeros; see above()")
        return np.asarray(self.height_m - other.height_m)

    def distance_m(self, other: GeodeticPosition) -> Floats:
        """Return (n,) m along the ellipsoid, whatever the heights; the antimeridian is no obstacle."""
        if self.datum != other.datum:
            self._refuse("compare", other, "their datums differ")
        return geodesy.distance_m(self.lat_deg, self.lon_deg, other.lat_deg, other.lon_deg)

    def to_ecef(self) -> EcefPosition:
        """Return the same points in ECEF; only heights above the ellipsoid will do."""
        self._needs_ellipsoid("ECEF")
        xyz = geodesy.ecef_from_geodetic(self.lat_deg, self.lon_deg, self.height_m)
        measured = self.measured.turned(lambda: _transposed(self._ned_from_ecef()), "ecef")
        return EcefPosition(xyz, measured, self.datum)

    def to_local(self, origin: Origin, axes: EarthAxes = "NED") -> LocalPosition:
        """Return the same points along the level axes at `origin`."""
        return self.to_ecef().to_local(origin, axes)

    def to_utm(self, zone: int | None = None, *, north: bool | None = None) -> ProjectedPosition:
        """Return the same points in one zone of UTM, by default the one they are all in.

        Positions in several zones or hemispheres are refused. Heights stay what they are.
        """
        zone, north = self._zone() if zone is None or north is None else (zone, north)
        flat = utm.utm_from_geodetic(self.lat_deg, self.lon_deg, zone, north=north)
        xyz = np.column_stack([flat, self.height_m])
        return ProjectedPosition(xyz, zone, north, self.height_reference, self.measured, self.datum)

    def _zone(self) -> tuple[int, bool]:
        known = np.isfinite(self.lat_deg) & np.isfinite(self.lon_deg)
        zones = np.unique(utm.zone(self.lat_deg[known], self.lon_deg[known]))
        halves = np.unique(self.lat_deg[known] >= 0)
        if not len(zones) or zones[0] == 0:
            raise MixingError(
                "UTM reaches from 80 S to 84 N: a position lies beyond, or none is known"
            )
        if len(zones) > 1 or len(halves) > 1:
            several = "zones" if len(zones) > 1 else "zone"
            where = "both hemispheres" if len(halves) > 1 else "one hemisphere"
            raise MixingError(
                f"positions lie in UTM {several} {', '.join(map(str, zones.tolist()))} of {where}: "
                f"one zone of one hemisphere is one map; choose it, or take geodetic or local positions"
            )
        return int(zones[0]), bool(halves[0])

    def _needs_ellipsoid(self, what: str) -> None:
        if self.height_reference is not AltRef.ELLIPSOID:
            raise MixingError(
                f"{what} needs heights above the ellipsoid, these are "
                f"{height_words(self.height_reference).label}: convert with above('ellipsoid')"
            )

    def _ned_from_ecef(self) -> Floats:
        return rotations.ned_from_ecef(self.lat_deg, self.lon_deg)


@dataclass(frozen=True, eq=False)
class EcefPosition(_Point):
    """(n, 3) m from the centre of the Earth: x to 0 N 0 E, y to 0 N 90 E, z to the north pole."""

    xyz: Floats
    measured: Measured = field(default_factory=Measured)
    datum: str = WGS84
    representation: ClassVar[str] = "ecef"

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return ("ECEF", self.datum)

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"an ECEF position on {self.datum}"

    def _difference(self, xyz: Floats) -> EcefVector:
        return EcefVector(xyz, "m", self.datum)

    def to_geodetic(self) -> GeodeticPosition:
        """Return latitude, longitude and height above the ellipsoid."""
        lat, lon, height = np.moveaxis(geodesy.geodetic_from_ecef(self.xyz), -1, 0)
        measured = self.measured.turned(lambda: rotations.ned_from_ecef(lat, lon), "local_ned")
        return GeodeticPosition(lat, lon, height, AltRef.ELLIPSOID, measured, self.datum)

    def to_local(self, origin: Origin, axes: EarthAxes = "NED") -> LocalPosition:
        """Return the points along the level axes at `origin`: moved, then turned."""
        matrix = _axes_from_ned(axes) @ origin.ned_from_ecef
        xyz = rotations.turn(matrix, self.xyz - origin.ecef_m)
        measured = self.measured.turned(lambda: matrix, f"local_{axes.lower()}")
        return LocalPosition(xyz, axes, origin, measured)


@dataclass(frozen=True, eq=False)
class LocalPosition(_Point):
    """(n, 3) m along straight axes from an origin."""

    xyz: Floats
    axes: str
    """``NED`` or ``ENU``; ``FRD`` or ``FLU`` of a fixed but arbitrary heading."""
    origin: Origin | None
    """None: nobody says where it is."""
    measured: Measured = field(default_factory=Measured)
    representation: ClassVar[str] = "cartesian"

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return ("local", self.axes, self.origin) if self.origin else ()

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"a local {self.axes} position from {self.origin or 'an unknown origin'}"

    def _difference(self, xyz: Floats) -> LocalVector:
        return LocalVector(xyz, self.axes, self.origin)

    def to_axes(self, axes: str) -> LocalPosition:
        """Return the same points along other axes of the same origin: NED and ENU, or FRD and FLU."""
        if axes == self.axes:
            return self
        matrix = _turn(self.axes, axes)
        measured = self.measured.turned(lambda: matrix, f"local_{axes.lower()}")
        return LocalPosition(rotations.turn(matrix, self.xyz), axes, self.origin, measured)

    def to_ecef(self) -> EcefPosition:
        """Return the same points in ECEF: turned, then moved."""
        origin = self._earth_origin()
        matrix = origin.ned_from_ecef.T @ _axes_from_ned(self.axes).T
        xyz = rotations.turn(matrix, self.xyz) + origin.ecef_m
        return EcefPosition(xyz, self.measured.turned(lambda: matrix, "ecef"))

    def to_geodetic(self) -> GeodeticPosition:
        """Return latitude, longitude and height above the ellipsoid."""
        return self.to_ecef().to_geodetic()

    def to_local(self, origin: Origin, axes: EarthAxes = "NED") -> LocalPosition:
        """Return the same points from another origin."""
        own = self._earth_origin()
        return self.to_axes(axes) if own == origin else self.to_ecef().to_local(origin, axes)

    def _earth_origin(self) -> Origin:
        if self.axes not in ("NED", "ENU"):
            raise MixingError(f"nothing says how {self.described} is turned from north")
        if self.origin is None:
            raise MixingError("nothing says where the origin of this local frame is")
        return self.origin


@dataclass(frozen=True, eq=False)
class ProjectedPosition(_Point):
    """(n, 3) m on the map of one UTM zone: easting, northing, height."""

    xyz: Floats
    zone: int
    """1 to 60."""
    north: bool
    """Hemisphere."""
    height_reference: AltRef
    measured: Measured = field(default_factory=Measured)
    datum: str = WGS84
    representation: ClassVar[str] = "utm"

    def __post_init__(self) -> None:
        if not 1 <= self.zone <= 60:
            raise MixingError("a UTM position needs its zone, 1 to 60")
        super().__post_init__()
        _set(self, height_reference=AltRef(self.height_reference))

    @property
    def hemisphere(self) -> str:
        """``N`` or ``S``."""
        return "N" if self.north else "S"

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return ("UTM", self.zone, self.north, self.height_reference, self.datum)

    @property
    def described(self) -> str:
        """The frame in words."""
        words = _height(self.height_reference)
        return f"a UTM position in zone {self.zone}{self.hemisphere} on {self.datum}, {words}"

    def _difference(self, xyz: Floats) -> MapVector:
        return MapVector(xyz, self.frame)

    def to_geodetic(self) -> GeodeticPosition:
        """Return latitude and longitude; heights stay what they are."""
        flat = utm.geodetic_from_utm(self.xyz[:, 0], self.xyz[:, 1], self.zone, north=self.north)
        return GeodeticPosition(
            *(flat[:, 0], flat[:, 1], self.xyz[:, 2]),
            self.height_reference,
            self.measured,
            self.datum,
        )


@dataclass(frozen=True, eq=False)
class EcefVector(_Vector):
    """(n, 3) along the axes of ECEF."""

    xyz: Floats
    unit: str = "m"
    datum: str = WGS84

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return ("ECEF", self.datum)

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"an ECEF vector, {self.unit}"

    def to_local(self, origin: Origin, axes: EarthAxes = "NED") -> LocalVector:
        """Return the same vectors along the level axes at `origin`: turned, not moved."""
        matrix = _axes_from_ned(axes) @ origin.ned_from_ecef
        return LocalVector(rotations.turn(matrix, self.xyz), axes, origin, self.unit)


@dataclass(frozen=True, eq=False)
class LocalVector(_Vector):
    """(n, 3) along the axes of a local frame."""

    xyz: Floats
    axes: str
    origin: Origin | None
    """Its directions, not its place: north at one origin is not north at another."""
    unit: str = "m"

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return ("local", self.axes, self.origin) if self.origin else ()

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"a local {self.axes} vector of {self.origin or 'an unknown origin'}, {self.unit}"

    def to_axes(self, axes: str) -> LocalVector:
        """Return the same vectors along other axes of the same origin."""
        turned = self.xyz if axes == self.axes else rotations.turn(_turn(self.axes, axes), self.xyz)
        return LocalVector(turned, axes, self.origin, self.unit)

    def to_ecef(self) -> EcefVector:
        """Return the same vectors in ECEF: turned, not moved."""
        if self.origin is None:
            raise MixingError("nothing says where the origin of this local frame is")
        matrix = self.origin.ned_from_ecef.T @ _axes_from_ned(self.axes).T
        return EcefVector(rotations.turn(matrix, self.xyz), self.unit)


@dataclass(frozen=True, eq=False)
class BodyVector(_Vector):
    """(n, 3) along the axes of the body: a velocity, or where something is from the body's zero."""

    xyz: Floats
    axes: str = "FRD"
    """``FRD`` or ``FLU``."""
    unit: str = "m"
    measured: Measured = field(default_factory=Measured)
    representation: ClassVar[str] = "cartesian"

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return ("body", self.axes)

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"a body {self.axes} vector, {self.unit}"

    def to_axes(self, axes: str) -> BodyVector:
        """Return the same vectors along FRD or FLU."""
        turned = self.xyz if axes == self.axes else rotations.turn(_turn(self.axes, axes), self.xyz)
        return replace(self, xyz=turned, axes=axes)

    def to_local(self, ned_from_frd: npt.ArrayLike, origin: Origin | None) -> LocalVector:
        """Return the same vectors in NED; `ned_from_frd` is the attitude, (3, 3) or (n, 3, 3)."""
        if not np.all(rotations.is_rotation(ned_from_frd)):
            raise MixingError("this attitude is no rotation: R R^T is not 1, or it is a reflection")
        turned = rotations.turn(ned_from_frd, self.to_axes("FRD").xyz)
        return LocalVector(turned, "NED", origin, self.unit)


@dataclass(frozen=True, eq=False)
class MapVector(_Vector):
    """(n, 3) m on a map: a difference of eastings, northings and heights; map metres, not ground metres."""

    xyz: Floats
    map: tuple[object, ...]
    """Frame of the positions whose difference it is."""
    unit: str = "m"

    @property
    def frame(self) -> tuple[object, ...]:
        """See `_Metric.frame`."""
        return self.map

    @property
    def described(self) -> str:
        """The frame in words."""
        return f"a map vector of UTM zone {self.map[1]}{'N' if self.map[2] else 'S'}"


Position: TypeAlias = (
    GeodeticPosition | EcefPosition | LocalPosition | ProjectedPosition | BodyVector
)
"""What a record of a recording can be."""


def _set(thing: object, **values: object) -> None:
    """Set fields of a frozen dataclass while it is made."""
    for name, value in values.items():
        object.__setattr__(thing, name, value)


def _triples(xyz: npt.ArrayLike) -> Floats:
    """Return (n, 3)."""
    columns = np.atleast_2d(np.asarray(xyz, float))
    if columns.ndim != 2 or columns.shape[1] != 3:
        raise ValueError(f"positions and vectors are (n, 3), not {columns.shape}")
    return columns


def _transposed(matrices: Floats) -> Floats:
    return np.swapaxes(matrices, -1, -2)


def _axes_from_ned(axes: str) -> Floats:
    if axes not in ("NED", "ENU"):
        raise MixingError(f"{axes} is not tied to north; local axes on the Earth are NED or ENU")
    return np.eye(3) if axes == "NED" else rotations.ENU_FROM_NED


def _turn(source: str, target: str) -> Floats:
    if (source, target) not in _TURNS:
        raise MixingError(f"nothing turns {source} into {target} without an attitude")
    return _TURNS[source, target]


def _height(reference: AltRef) -> str:
    return f"heights {height_words(reference).label}" if reference else "heights of no reference"
