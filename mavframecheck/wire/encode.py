"""Columns back to frames: for examples of rules, tests and injected mistakes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from mavframecheck.wire.crc import crc16
from mavframecheck.wire.dialect import Layout
from mavframecheck.wire.frames import STX_V1, STX_V2


def encode_payload(layout: Layout, values: Mapping[str, Any]) -> bytes:
    """Return the full payload with `values` by field name, zero where none is given; KeyError for no field."""
    row = np.zeros(1, layout.dtype)
    for name, value in values.items():
        if name not in layout.by_name:
            message = f"{layout.name} has no field called {name!r}"
            raise KeyError(message)
        row[name][0] = value.encode() if isinstance(value, str) else value
    return row.tobytes()


def encode_frame(
    layout: Layout,
    payload: bytes,
    *,
    sysid: int,
    compid: int,
    seq: int,
    version: Literal[1, 2] = 2,
) -> bytes:
    """Return a frame: MAVLink 1 without extension fields, MAVLink 2 with trailing zeros cut off."""
    if version == 1:
        payload = payload[: layout.base_length]
        header = bytes([len(payload), seq & 0xFF, sysid, compid, layout.msgid])
        magic = STX_V1
    else:
        payload = payload.rstrip(b"\0") or payload[:1]
        header = bytes([len(payload), 0, 0, seq & 0xFF, sysid, compid]) + layout.msgid.to_bytes(
            3, "little"
        )
        magic = STX_V2
    crc = crc16(header + payload + bytes([layout.crc_extra]))
    return bytes([magic]) + header + payload + crc.to_bytes(2, "little")


def stamped(frame: bytes, t_us: int) -> bytes:
    """Return a tlog record: the big-endian receive time, us since 1970, then the frame."""
    return t_us.to_bytes(8, "big") + frame
