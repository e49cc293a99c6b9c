"""Bit masks that say which fields of their message count (`data/masks.csv`)."""

from __future__ import annotations

from functools import cache

import msgspec

from mavframecheck.semantics import _tables, catalogue
from mavframecheck.semantics.enums import MaskSense


class MaskBit(msgspec.Struct, frozen=True):
    """One named bit (or bit group) of a mask enumeration."""

    enum: str
    bit: int
    """Mask value: 1, 2, 4, ... (24 for the two-bit field of RALLY_FLAGS)."""
    name: str
    """Without the prefix: `X_IGNORE`."""
    words: str
    """What the bit is about, for people: "x"."""
    sense: MaskSense
    """What a set bit says: its field is ignored, its field is given, or a flag of its own."""
    dialect: str
    """`upstream`: only mavlink/mavlink has the bit; `ours`: the XML names the bits in text only."""


@cache
def _masks() -> dict[str, tuple[MaskBit, ...]]:
    masks: dict[str, list[MaskBit]] = {}
    for row in _tables.read("masks"):
        bit = MaskBit(
            enum=row["enum"],
            bit=int(row["bit"]),
            name=row["name"],
            words=row["words"],
            sense=MaskSense(row["sense"]),
            dialect=row["dialect"],
        )
        masks.setdefault(bit.enum, []).append(bit)
    return {enum: tuple(bits) for enum, bits in masks.items()}


def mask_enums() -> tuple[str, ...]:
    """Return the names of all mask enumerations."""
    return tuple(_masks())


def bits(enum: str) -> tuple[MaskBit, ...]:
    """Return the bits of a mask enumeration, ascending."""
    return _masks()[enum]


def mask_of(message: str, field: str) -> str | None:
    """Return the mask enumeration of a field, None when it is no mask."""
    tags = catalogue.tags_of(message, field)
    named = [tag.enum for tag in tags if tag.enum in _masks()]
    return named[0] if named else None


def mask_fields(enum: str) -> tuple[tuple[str, str], ...]:
    """Return the (message, field) pairs that carry a mask enumeration."""
    return tuple((tag.message, tag.field) for tag in catalogue.find(enum=enum))


def undefined_bits(enum: str, value: int) -> int:
    """Return the bits of `value` that the enumeration does not define."""
    for bit in bits(enum):
        value &= ~bit.bit
    return value


def words(enum: str, value: int) -> list[str]:
    """Decode a mask into short phrases: `uses x, y, z`, `ignores yaw`, `FORCE_SET set`.

    A field whose bit means "ignore" is used when the bit is clear; one whose bit means "use" is
    ignored when it is clear.
    """
    used: list[str] = []
    ignored: list[str] = []
    flags: list[str] = []
    for bit in bits(enum):
        is_set = bool(value & bit.bit)
        if bit.sense is MaskSense.FLAG:
            flags += [f"{bit.name} set"] if is_set else []
        elif is_set == (bit.sense is MaskSense.USE):
            used.append(bit.words)
        else:
            ignored.append(bit.words)
    phrases = [
        f"{verb} {', '.join(fields)}"
        for verb, fields in (("uses", used), ("ignores", ignored))
        if fields
    ]
    strange = undefined_bits(enum, value)
    return phrases + flags + ([f"undefined bits 0x{strange:X}"] if strange else [])


def governed_fields(message: str, field: str) -> tuple[str, ...]:
    """Return the fields whose validity a mask field decides."""
    return tuple(tag.field for tag in catalogue.tags(message) if tag.ignore_field == field)
