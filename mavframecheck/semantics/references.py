"""What a position or a rotation refers to: coordinate system, axes, origin, datum, projection, height.

One word such as "local" or "WGS 84" tends to stand for all of them; here they are told apart. The
tables are `data/references.csv` and `data/heights.csv`; `data/selected.csv` says what the selectors
that are no MAV_FRAME announce.
"""

from __future__ import annotations

from functools import cache

import msgspec

from mavframecheck.semantics import _tables
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.enums import AltRef, Frame, FrameKind
from mavframecheck.semantics.mavframe import FRAMES, FrameFacts, frame_facts, frame_name


class Reference(msgspec.Struct, frozen=True):
    """Four things that one word for a frame tends to mix up."""

    name: str
    """A MAV_FRAME (`LOCAL_NED`), or a word of `docs/conventions.md` (`wgs84`)."""
    label: str
    """How it is called in a sentence."""
    system: str
    """Coordinate system: `geodetic`, `cartesian`, `height`, `angle`, `rotation`..."""
    axes: str
    """Directions of the axes."""
    origin: str
    """Where zero lies; `none` for what has no origin, such as a velocity."""
    datum: str
    """What ties it to the Earth: `WGS 84`, or `none`."""
    projection: str
    """How the round Earth became flat, or `none`."""


class HeightReference(msgspec.Struct, frozen=True):
    """What a height is measured from."""

    name: str
    """A word of `AltRef`."""
    label: str
    """How it is called in a sentence: `above home`."""
    surface: str
    """Where zero lies."""


@cache
def _references() -> dict[str, Reference]:
    """Return every reference by name: those of the catalogue's words, and every MAV_FRAME."""
    words = {row["name"]: Reference(**row) for row in _tables.read("references")}
    plane = words[Frame.LOCAL_NED].projection
    return words | {facts.name: _of_mav_frame(facts, plane) for facts in FRAMES}


def _of_mav_frame(facts: FrameFacts, plane: str) -> Reference:
    """Return the reference of a MAV_FRAME; `plane` is how a local frame at the origin is projected."""
    is_global = facts.kind is FrameKind.GLOBAL
    return Reference(
        name=facts.name,
        label=facts.name,
        system={FrameKind.GLOBAL: "geodetic", FrameKind.MISSION: "none"}.get(
            facts.kind, "cartesian"
        ),
        axes=facts.words if facts.kind is not FrameKind.GLOBAL else "latitude, longitude, up",
        origin="centre of the Earth" if is_global else facts.origin or "none",
        datum="WGS 84" if is_global else "none",
        projection=plane if facts.origin == "local origin" else "none",
    )


def reference(name: str) -> Reference:
    """Return the reference called `name`; an unknown one (`frame 99`) is said to be undefined."""
    undefined = Reference(name, name, *["undefined"] * 5)
    return _references().get(name, undefined)


@cache
def _heights() -> dict[str, HeightReference]:
    return {row["name"]: HeightReference(**row) for row in _tables.read("heights")}


def height_reference(name: str) -> HeightReference:
    """Return the height reference called `name`, a word of `AltRef`; KeyError for `by_frame`."""
    return _heights()[name]


@cache
def _selected() -> dict[tuple[str, int], tuple[str, str]]:
    """Return (enumeration, value) -> words for frame and height."""
    return {
        (row["enum"], int(row["value"])): (row["frame"], row["height"])
        for row in _tables.read("selected")
    }


def selected_reference(enum: str, value: int) -> str:
    """Return the name of the reference that a selector of enumeration `enum` announces by `value`."""
    if enum == "MAV_FRAME":
        return frame_name(value)
    if enum in ("GIMBAL_DEVICE_FLAGS", "GIMBAL_MANAGER_FLAGS"):
        return _gimbal_reference(enum, value)
    return _selected().get((enum, value), ("", ""))[0] or Frame.UNSPECIFIED


def _gimbal_reference(enum: str, flags: int) -> str:
    """Yaw is from north or from the heading as its flag says, else as YAW_LOCK says."""
    north = bool(flags & constant(f"{enum}.YAW_IN_EARTH_FRAME"))
    heading = bool(flags & constant(f"{enum}.YAW_IN_VEHICLE_FRAME"))
    if north and heading:
        return Frame.UNSPECIFIED
    locked = bool(flags & constant(f"{enum}.YAW_LOCK"))
    return "gimbal_north" if north or (locked and not heading) else "gimbal_heading"


def selected_height(enum: str, value: int) -> str:
    """Return the height reference that a selector of enumeration `enum` announces by `value`."""
    if enum == "MAV_FRAME":
        facts = frame_facts(value)
        return facts.alt_ref or AltRef.UNSPECIFIED if facts else AltRef.UNSPECIFIED
    if enum == "RALLY_FLAGS":
        stated = value & constant("RALLY_FLAGS.ALT_FRAME_VALID")
        return _RALLY_HEIGHTS[value >> 3 & 3] if stated else AltRef.HOME
    return _selected().get((enum, value), ("", ""))[1] or AltRef.UNSPECIFIED


_RALLY_HEIGHTS = (AltRef.MSL, AltRef.HOME, AltRef.ORIGIN, AltRef.TERRAIN)
"""By bits 3 and 4 of RALLY_FLAGS."""
