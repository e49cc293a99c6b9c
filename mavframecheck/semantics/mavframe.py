"""MAV_FRAME 0..21: what each value announces (`data/frames.csv`)."""

from __future__ import annotations

import msgspec

from mavframecheck.semantics import _tables
from mavframecheck.semantics.enums import AltRef, FrameKind, FrameStatus


class FrameFacts(msgspec.Struct, frozen=True):
    """One value of MAV_FRAME."""

    id: int
    name: str
    """Without the prefix: `GLOBAL_RELATIVE_ALT`."""
    status: FrameStatus
    kind: FrameKind
    axes: str
    """`lat lon up`, `NED`, `ENU`, `FRD`, `FLU`, or empty."""
    origin: str
    """Where zero lies: `wgs84`, `local origin`, `vehicle`, ..., or empty."""
    alt_ref: AltRef
    """Level of the third coordinate; `unspecified` when the third coordinate is no altitude."""
    superseded_by: int | None
    """The value to use instead."""
    words: str
    """A short phrase for people: "altitude above home"."""
    remark: str


def _facts(row: dict[str, str]) -> FrameFacts:
    newer = row["superseded_by"]
    return FrameFacts(
        id=int(row["id"]),
        name=row["name"],
        status=FrameStatus(row["status"]),
        kind=FrameKind(row["kind"]),
        axes=row["axes"],
        origin=row["origin"],
        alt_ref=AltRef(row["alt_ref"]),
        superseded_by=int(newer) if newer else None,
        words=row["words"],
        remark=row["remark"],
    )


FRAMES: tuple[FrameFacts, ...] = tuple(_facts(row) for row in _tables.read("frames"))
"""Every MAV_FRAME value, by number."""

FRAME_NAMES: dict[int, str] = {frame.id: frame.name for frame in FRAMES}
"""MAV_FRAME number -> short name."""


def frames_of(kind: FrameKind) -> tuple[int, ...]:
    """Return the MAV_FRAME numbers of one kind, ascending."""
    return tuple(frame.id for frame in FRAMES if frame.kind is kind)


GLOBAL_FRAMES = frames_of(FrameKind.GLOBAL)
"""Latitude and longitude; degE7 in the *_INT messages."""
LOCAL_FRAMES = frames_of(FrameKind.LOCAL)
"""Metres along axes that do not turn with the vehicle; 1e-4 m in the *_INT messages."""
BODY_FRAMES = frames_of(FrameKind.BODY)
"""Metres along axes that turn with the vehicle; 1e-4 m in the *_INT messages."""
METRIC_FRAMES = tuple(sorted(LOCAL_FRAMES + BODY_FRAMES))
"""Every frame whose coordinates are metres."""
RESERVED_FRAMES = tuple(f.id for f in FRAMES if f.status is FrameStatus.RESERVED)
"""Values that once meant something and must not be sent."""


def frame_facts(frame: int) -> FrameFacts | None:
    """Return the facts of a MAV_FRAME value, None for an undefined one."""
    return FRAMES[frame] if 0 <= frame < len(FRAMES) else None


def frame_name(frame: int) -> str:
    """Return `LOCAL_NED` for 1; an undefined value becomes `frame 99`."""
    return FRAME_NAMES.get(frame, f"frame {frame}")
