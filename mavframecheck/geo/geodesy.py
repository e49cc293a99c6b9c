"""Distances, bearings, ECEF and local axes on the WGS 84 ellipsoid.

Positions are degrees and, where there is a height, metres above the ellipsoid. Arguments may have any
shapes that broadcast to one another. NaN comes out where a latitude is beyond 90 degrees or anything
is not finite; longitudes may be turned round any number of times.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mavframecheck.geo.rotations import ned_from_ecef, turn

Floats = npt.NDArray[np.float64]

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
"""WGS 84, NIMA TR8350.2."""
ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)
DEEPEST_M = 5_350_000.0
"""Points nearer to the centre of the Earth than this have no geodetic position here."""


def distance_m(
    lat1: npt.ArrayLike, lon1: npt.ArrayLike, lat2: npt.ArrayLike, lon2: npt.ArrayLike
) -> Floats:
    """Return the shortest way along the ellipsoid, m; height plays no part.

    Within 0.0002 % (and a micrometre) up to 10 000 km, within 0.2 % anywhere, the worst being points on
    opposite sides of the Earth. Source: the formula of Andoyer and Lambert, first order in the flattening.
    """
    with np.errstate(all="ignore"):
        beta1, beta2 = _reduced(lat1), _reduced(lat2)
        middle, half = (beta1 + beta2) / 2, (beta2 - beta1) / 2
        east = np.radians(np.subtract(lon2, lon1)) / 2
        sin_east, cos_east = np.sin(east), np.cos(east)
        sin_middle, cos_middle = np.sin(middle), np.cos(middle)
        sin_half, cos_half = np.sin(half), np.cos(half)
        near = (sin_half * cos_east) ** 2 + (cos_middle * sin_east) ** 2
        far = (cos_half * cos_east) ** 2 + (sin_middle * sin_east) ** 2
        arc = 2 * np.arctan2(np.sqrt(near), np.sqrt(far))
        bow = np.sin(arc)
        shorter = (arc - bow) * _share((sin_middle * cos_half) ** 2, far)
        shorter += (arc + bow) * _share((cos_middle * sin_half) ** 2, near)
        metres: Floats = np.asarray(SEMI_MAJOR_M * (arc - FLATTENING / 2 * shorter))
    return metres


def bearing_deg(
    lat1: npt.ArrayLike, lon1: npt.ArrayLike, lat2: npt.ArrayLike, lon2: npt.ArrayLike
) -> Floats:
    """Return in which direction position 2 lies from position 1, degrees in [0, 360) from true north.

    NaN where the two are the same. In degrees because it is for people to read. It is where the straight
    line to position 2 points in the horizontal plane of position 1 (the normal section). The shortest
    way sets out within 0.001 degrees of that up to 1 000 km, 0.12 up to 10 000 km and 0.5 up to
    15 000 km; for points on opposite sides of the Earth the two have nothing in common.
    """
    with np.errstate(all="ignore"):
        beta1, beta2, phi1 = _reduced(lat1), _reduced(lat2), np.radians(lat1)
        turn = np.radians(np.subtract(lon2, lon1))
        out = np.cos(beta2) * np.cos(turn) - np.cos(beta1)
        up = (1 - FLATTENING) * (np.sin(beta2) - np.sin(beta1))
        east = np.cos(beta2) * np.sin(turn)
        north = np.cos(phi1) * up - np.sin(phi1) * out
        degrees = np.degrees(np.arctan2(east, north))
        same = (east == 0) & (north == 0)
        return np.where(same, np.nan, np.where(degrees < 0, degrees + 360, degrees) % 360)


def ned_from_geodetic(
    lat: npt.ArrayLike,
    lon: npt.ArrayLike,
    h: npt.ArrayLike,
    lat0: npt.ArrayLike,
    lon0: npt.ArrayLike,
    h0: npt.ArrayLike,
) -> Floats:
    """Return (..., 3) m, NED: positions in the axes that are level at the origin (`lat0`, `lon0`, `h0`).

    Earth curves away below that plane: 8 m at 10 km. Local positions of autopilots are not these
    metres: they project on a sphere and differ by up to 0.7 % of the distance. Source: pymap3d.
    """
    import pymap3d

    given = np.broadcast_arrays(*(np.asarray(a, float) for a in (lat, lon, h, lat0, lon0, h0)))
    with np.errstate(all="ignore"):
        ned = np.stack(pymap3d.geodetic2ned(*given), axis=-1)
    return _where(_sound(*given) & (np.abs(given[0]) <= 90) & (np.abs(given[3]) <= 90), ned)


def geodetic_from_ned(
    ned: npt.ArrayLike, lat0: npt.ArrayLike, lon0: npt.ArrayLike, h0: npt.ArrayLike
) -> Floats:
    """Return (..., 3) latitude and longitude, degrees, and ellipsoid height, m: undoes `ned_from_geodetic`.

    `ned` is (..., 3) m; the others broadcast to its shape without the last axis. Longitude is in
    [-180, 180]. Source: pymap3d.
    """
    import pymap3d

    axes = np.moveaxis(np.asarray(ned, float), -1, 0)
    given = np.broadcast_arrays(*axes, *(np.asarray(a, float) for a in (lat0, lon0, h0)))
    with np.errstate(all="ignore"):
        geodetic = np.stack(pymap3d.ned2geodetic(*given), axis=-1)
    return _where(_sound(*given) & (np.abs(given[3]) <= 90), geodetic)


def ecef_from_geodetic(lat: npt.ArrayLike, lon: npt.ArrayLike, h: npt.ArrayLike) -> Floats:
    """Return (..., 3) m, ECEF: x to 0 N 0 E, y to 0 N 90 E, z to the north pole. Source: pymap3d.

    `h` is above the ellipsoid: a height above the sea put in its place moves the point up or down.
    """
    import pymap3d

    given = np.broadcast_arrays(*(np.asarray(a, float) for a in (lat, lon, h)))
    sound = _sound(*given) & (np.abs(given[0]) <= 90)
    place = [np.where(sound, column, 0.0) for column in given]
    return _where(sound, np.stack(pymap3d.geodetic2ecef(*place), axis=-1))


def geodetic_from_ecef(xyz: npt.ArrayLike) -> Floats:
    """Return (..., 3) latitude and longitude, degrees, and ellipsoid height, m, of (..., 3) m ECEF.

    Undoes `ecef_from_geodetic` to a micrometre within 1 000 km of the surface, to 0.1 mm up to 40 000 km.
    Deeper the result is NaN: towards the centre a point lies above several places at once.
    Source: pymap3d, whose latitude is then improved (at 1 000 km it is 2 cm off).
    """
    import pymap3d

    points = np.asarray(xyz, float)
    with np.errstate(all="ignore"):
        sound = np.linalg.norm(points, axis=-1) > DEEPEST_M
        sound &= _sound(*np.moveaxis(points, -1, 0))
        place = np.where(sound[..., np.newaxis], points, [SEMI_MAJOR_M, 0.0, 0.0])
        geodetic = np.stack(pymap3d.ecef2geodetic(*np.moveaxis(place, -1, 0)), axis=-1)
    return _where(sound, _improved(geodetic, place))


def _improved(geodetic: Floats, ecef: Floats) -> Floats:
    """Return positions whose latitude and height are corrected by how far they miss `ecef`, (..., 3)."""
    lat, lon, h = np.moveaxis(geodetic, -1, 0)
    off = turn(ned_from_ecef(lat, lon), ecef - ecef_from_geodetic(lat, lon, h))
    squash = 1 - ECCENTRICITY_SQUARED * np.sin(np.radians(lat)) ** 2
    radius = SEMI_MAJOR_M * (1 - ECCENTRICITY_SQUARED) / squash**1.5
    better = np.clip(lat + np.degrees(off[..., 0] / (radius + h)), -90, 90)
    return np.stack([better, lon, h - off[..., 2]], axis=-1)


def _reduced(lat: npt.ArrayLike) -> Floats:
    """Return the reduced (parametric) latitude, rad, of a geodetic one in degrees, NaN beyond the poles."""
    degrees = np.asarray(lat, float)
    phi = np.radians(np.where(np.abs(degrees) <= 90, degrees, np.nan))
    beta: Floats = np.arctan2((1 - FLATTENING) * np.sin(phi), np.cos(phi))
    return beta


def _share(part: Floats, whole: Floats) -> Floats:
    """Return ``part / whole``, 0 where there is nothing to divide."""
    return np.where(whole > 0, part / np.where(whole > 0, whole, 1), 0)


def _sound(*columns: Floats) -> npt.NDArray[np.bool_]:
    """Return where all of them are finite."""
    sound: npt.NDArray[np.bool_] = np.all([np.isfinite(column) for column in columns], axis=0)
    return sound


def _where(sound: npt.NDArray[np.bool_], vectors: Floats) -> Floats:
    """Return (..., 3) `vectors`, all three NaN where not `sound` (...)."""
    return np.where(sound[..., np.newaxis], vectors, np.nan)
