"""Unit strings of the MAVLink XML and what one step of each is in SI.

The XML writes scaled units in three ways: a prefix (`cm/s`), a power (`degE7`) or a factor.
`m/s*5` means "metres per second times five" (divide to get m/s), `deg/2` means "degrees divided
by two" (multiply). The units marked "ours" are used where the XML states none.
"""

from __future__ import annotations

from math import pi

from mavframecheck.semantics.enums import Quantity

STANDARD_GRAVITY = 9.80665
"""m/s^2 in one g (CGPM 1901)."""

_SCALES: dict[str, tuple[float, str]] = {
    "": (1.0, ""),
    # length
    "m": (1.0, "m"),
    "dm": (0.1, "m"),
    "cm": (1e-2, "m"),
    "mm": (1e-3, "m"),
    "dam": (10.0, "m"),
    "m*1e4": (1e-4, "m"),  # ours: x and y of the *_INT messages in a local frame
    "cm^2": (1e-4, "m^2"),
    # speed and acceleration
    "m/s": (1.0, "m/s"),
    "dm/s": (0.1, "m/s"),
    "cm/s": (1e-2, "m/s"),
    "mm/s": (1e-3, "m/s"),
    "m/s*5": (0.2, "m/s"),
    "m/s/s": (1.0, "m/s^2"),
    "mG": (1e-3 * STANDARD_GRAVITY, "m/s^2"),
    # angle
    "rad": (1.0, "rad"),
    "deg": (1.0, "deg"),
    "cdeg": (1e-2, "deg"),
    "deg/2": (2.0, "deg"),
    "degE7": (1e-7, "deg"),
    "degE5": (1e-5, "deg"),
    "deg*255/360": (360 / 255, "deg"),  # ours: units="deg" with multiplier="360/255"
    "rad/s": (1.0, "rad/s"),
    "mrad/s": (1e-3, "rad/s"),
    "deg/s": (1.0, "deg/s"),
    "ddeg/s": (0.1, "deg/s"),
    "rad/s/s": (1.0, "rad/s^2"),  # ours
    # time
    "s": (1.0, "s"),
    "cs": (1e-2, "s"),
    "ms": (1e-3, "s"),
    "us": (1e-6, "s"),
    "ns": (1e-9, "s"),
    "week": (604_800.0, "s"),  # ours: GPS weeks
    # the rest
    "hPa": (1e2, "Pa"),
    "gauss": (1e-4, "T"),
    "mgauss": (1e-7, "T"),
    "degC": (1.0, "degC"),
    "cdegC": (1e-2, "degC"),
    "%": (1e-2, "1"),
    "dop*100": (1e-2, "1"),  # ours: dilution of precision times 100
    "dpix": (0.1, "pix"),
}

UNITS: frozenset[str] = frozenset(_SCALES)
"""Every unit string that a row of the catalogue may carry."""

_RADIANS = {"deg": "rad", "deg/s": "rad/s"}
_STAY_IN_DEGREES = (Quantity.LATITUDE, Quantity.LONGITUDE)


def to_si(unit: str, quantity: Quantity) -> tuple[float, str]:
    """Return the factor from one raw step to SI, and the SI unit.

    Latitude and longitude stay in degrees, every other angle becomes radians.
    """
    scale, si_unit = _SCALES[unit]
    if si_unit in _RADIANS and quantity not in _STAY_IN_DEGREES:
        return scale * pi / 180, _RADIANS[si_unit]
    return scale, si_unit
