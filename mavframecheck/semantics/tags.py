"""`FieldTag`: what one field of one message means, and under which condition."""

from __future__ import annotations

from typing import Literal

import msgspec

from mavframecheck.semantics.enums import (
    DIAGONALS,
    AltRef,
    Axis,
    Clock,
    CovLayout,
    Frame,
    Positive,
    Quantity,
    RefPoint,
)


class Condition(msgspec.Struct, frozen=True):
    """A view holds in the rows where `field` has one of `values` (raw integers)."""

    field: str
    values: tuple[int, ...]


class Sentinel(msgspec.Struct, frozen=True):
    """A raw value that is a code, not a measurement."""

    kind: Literal["nan", "value", "below"]
    """`below`: every raw value below `value` is the code."""
    value: float
    """Raw value; NaN when `kind` is `nan`."""
    meaning: str
    """What the code says, for people: "unknown", "ignore", "north"."""
    scope: Literal["element", "first", "all"] = "element"
    """In an array: each element for itself, element 0 for the whole array, or all elements equal."""
    known: bool = False
    """True when the code stands for a known value (36000 = north), False when nothing is known."""


class FieldTag(msgspec.Struct, frozen=True):
    """The meaning of one field of one message, in one view; a row of `data/fields.csv`."""

    message: str
    field: str
    when: tuple[Condition, ...]
    """Conditions on fields of the same row, all of them; empty: always."""
    group: str
    """`[subject.]kind`: the vector or triple it belongs to, e.g. `position`, `next.position`."""
    quantity: Quantity
    unit: str
    """Unit of the raw number as on the wire, e.g. `degE7` (`units.py`)."""
    scale: float
    """SI value = raw value times scale."""
    si_unit: str
    """`deg` for latitude and longitude, else SI; empty for bare numbers."""
    frame: Frame
    frame_field: str
    """Field of the same row that selects the frame or the altitude reference, or empty."""
    axis: Axis
    positive: Positive
    alt_ref: AltRef
    clock: Clock
    ignore_field: str
    """Field of the same row whose bit says whether this one is given, or empty."""
    ignore_bit: int
    """Mask value of that bit (1, 2, 4, ...), 0 without one."""
    ignore_when_set: bool
    """True: a set bit means ignored. False: a set bit means valid."""
    sentinels: tuple[Sentinel, ...]
    cov_layout: CovLayout
    ref_point: RefPoint
    time_field: str
    """Field of the same row that stamps this one, or empty."""
    instance_field: str
    """Field of the same row that tells instances apart, or empty."""
    enum: str
    """MAVLink enumeration of a selector or mask, e.g. `MAV_FRAME`, or empty."""
    selects: tuple[str, ...]
    """Fields of the same message whose meaning or validity depends on this one."""
    dialect: Literal["", "upstream"]
    """`upstream`: only the XML of mavlink/mavlink has the field, not pymavlink's."""
    source: str
    """Where the meaning was read: xml, px4-src, ardupilot-src, devguide, issues."""
    remark: str
    """Why, exceptions, contradictions: for people."""

    @property
    def diagonal(self) -> tuple[int, ...]:
        """Indices of the variances in a covariance array, empty for anything else."""
        return DIAGONALS.get(self.cov_layout, ())

    @property
    def subject(self) -> str:
        """Whom the group describes: empty for the message's main subject, else e.g. `home`."""
        return self.group.rpartition(".")[0]
