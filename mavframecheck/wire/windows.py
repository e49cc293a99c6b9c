"""Bytes read as something wider at every place where it could begin."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def windows(octets: npt.NDArray[np.uint8], kind: str) -> npt.NDArray[Any]:
    """Return what begins at each byte of `octets`, (n,), read as a numpy `kind`: a view, without a copy.

    ``V10`` are ten bytes as they are. Index it with places: `take` would copy windows one by one.
    """
    width = np.dtype(kind).itemsize
    return np.ndarray(len(octets) - width + 1, kind, octets, strides=(1,))
