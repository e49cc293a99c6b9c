"""The unit in which sources hand bytes to framing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Chunk(NamedTuple):
    """A run of consecutive bytes of one flow, with where and when each piece of it was received.

    A file read in order is one piece per chunk; a packet capture has one piece per packet payload.
    Consecutive chunks of a flow continue each other, so a frame may span two of them.
    """

    data: bytes
    """The bytes, pieces joined."""
    starts: npt.NDArray[np.int64]
    """(k,) index in `data` at which each piece begins; `starts[0]` is 0."""
    offsets: npt.NDArray[np.int64]
    """(k,) byte offset of each piece in the recording."""
    t_us: npt.NDArray[np.int64] | None = None
    """(k,) receive time of each piece, us since 1970; None when the container carries none."""
    flow: int = 0
    """Which byte stream of the recording: 0 in a file, one per direction and peer in a capture."""


def whole(data: bytes, offset: int) -> Chunk:
    """Return a chunk of one piece without a receive time, `offset` bytes into its recording."""
    return Chunk(data, np.zeros(1, np.int64), np.array([offset], np.int64))
