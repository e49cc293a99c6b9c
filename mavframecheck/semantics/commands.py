"""MAV_CMD parameters that carry a position, an angle, a speed or a length (`data/commands.csv`)."""

from __future__ import annotations

from functools import cache
from itertools import groupby

import msgspec

from mavframecheck.semantics import _tables

CARRIERS: dict[str, tuple[str, ...]] = {
    "COMMAND_INT": ("param1", "param2", "param3", "param4", "x", "y", "z"),
    "COMMAND_LONG": ("param1", "param2", "param3", "param4", "param5", "param6", "param7"),
    "MISSION_ITEM": ("param1", "param2", "param3", "param4", "x", "y", "z"),
    "MISSION_ITEM_INT": ("param1", "param2", "param3", "param4", "x", "y", "z"),
}
"""Messages that carry any command: the field that holds each of params 1 to 7."""

INT_CARRIERS = ("COMMAND_INT", "MISSION_ITEM_INT")
"""Carriers whose x and y are scaled integers."""

BY_CARRIER = "by_carrier"
"""Unit of a latitude or longitude that takes the scale of its carrier (generic location view)."""


class CommandRows(msgspec.Struct, frozen=True):
    """What is known of one MAV_CMD; `rows` are its tagged parameters as written in the table."""

    name: str
    """Without the prefix: `NAV_WAYPOINT`."""
    id: int
    location: bool
    """The XML says `hasLocation`."""
    rows: tuple[dict[str, str], ...]


@cache
def all_commands() -> dict[int, CommandRows]:
    """Return every tagged command by number."""
    groups = groupby(_tables.read("commands"), key=lambda row: row["id"])
    facts = [_facts(tuple(rows)) for _, rows in groups]
    return {fact.id: fact for fact in facts}


def _facts(rows: tuple[dict[str, str], ...]) -> CommandRows:
    first = rows[0]
    return CommandRows(first["command"], int(first["id"]), first["location"] == "yes", rows)


@cache
def location_commands() -> tuple[int, ...]:
    """Return the commands whose params 5 and 6 are latitude and longitude in the carrier's scale."""
    return _having("5", "latitude")


@cache
def altitude_commands() -> tuple[int, ...]:
    """Return the commands whose param 7 is a height in the carrier's frame."""
    return _having("7", "altitude")


def _having(param: str, quantity: str) -> tuple[int, ...]:
    """Return the commands that have `quantity` in `param`, in the generic scale of the carrier."""
    return tuple(
        fact.id
        for fact in all_commands().values()
        for row in fact.rows
        if row["param"] == param and row["quantity"] == quantity and row["unit"] == BY_CARRIER
    )
