"""MAVLink enumeration values by name, so that no rule holds a magic number."""

from __future__ import annotations

from functools import cache

from mavframecheck.semantics import _tables
from mavframecheck.semantics.mavframe import FRAMES


@cache
def _enumerations() -> dict[str, dict[str, int]]:
    """Return enumeration -> short entry name -> value, from the three tables that name values."""
    values: dict[str, dict[str, int]] = {"MAV_FRAME": {f.name: f.id for f in FRAMES}}
    for row in _tables.read("enumerations"):
        values.setdefault(row["enum"], {})[row["name"]] = int(row["value"])
    for row in _tables.read("masks"):
        values.setdefault(row["enum"], {})[row["name"]] = int(row["bit"])
    return values


def entries(enum: str) -> dict[str, int]:
    """Return short name -> value of one enumeration; KeyError names the near misses."""
    known = _enumerations()
    if enum not in known:
        raise KeyError(_unknown("MAVLink enumeration", enum, known))
    return known[enum]


def constant(name: str) -> int:
    """Return the value of `ENUMERATION.ENTRY`, e.g. `MAV_FRAME.LOCAL_NED` -> 1.

    The entry is written without the prefix that all entries of its enumeration share.
    KeyError names the near misses.
    """
    enum, _, entry = name.partition(".")
    known = entries(enum)
    if entry not in known:
        raise KeyError(_unknown(f"entry of {enum}", entry, known))
    return known[entry]


def entry_name(enum: str, value: int) -> str:
    """Return the short name of a value, or the value as text when no table here names it."""
    return _names(enum).get(value, str(value))


@cache
def _names(enum: str) -> dict[int, str]:
    return {value: name for name, value in _enumerations().get(enum, {}).items()}


def _unknown(what: str, name: str, known: dict[str, dict[str, int]] | dict[str, int]) -> str:
    """Return the error text for an unknown name, with the nearest known names."""
    import difflib  # only a mistake needs it

    near = difflib.get_close_matches(name, list(known), n=3, cutoff=0.5)
    hint = f"; did you mean {', '.join(near)}?" if near else ""
    return f"unknown {what}: {name}{hint}"
