"""Write the geoid of `mavframecheck/geo/data` from the public-domain EGM96 grid.

``python -m tools.make_geoid egm96_15.gtx``: the file is in Debian's package `proj-data`. The same
grid gives the same bytes, as long as zlib compresses alike. Then put the printed checksums into
`mavframecheck/geo/data/README.md`.
"""

from __future__ import annotations

import hashlib
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mavframecheck.geo.geoid import COLUMNS, DATA, ROWS, STEPS

HEADER = struct.Struct(">4d2i")
"""GTX: south and west edge, steps north and east (degrees), rows, columns; then big-endian float32."""


def centimetres(gtx: bytes) -> npt.NDArray[np.int16]:
    """Return (ROWS, COLUMNS) the undulations of a GTX file, cm, southernmost row first."""
    header = HEADER.unpack_from(gtx)
    if header != (-90.0, -180.0, 1 / STEPS, 1 / STEPS, ROWS, COLUMNS):
        raise SystemExit(f"not the whole Earth in quarters of a degree: the header says {header}")
    metres = np.frombuffer(gtx, ">f4", offset=HEADER.size).reshape(ROWS, COLUMNS)
    return np.rint(metres.astype(np.float64) * 100).astype(np.int16)


def packed(grid: npt.NDArray[np.int16]) -> bytes:
    """Return the file: what each point adds to the ones west and south of it, int16, compressed."""
    rows = np.diff(grid, axis=0, prepend=np.zeros((1, COLUMNS), np.int16))
    deltas = np.diff(rows, axis=1, prepend=np.zeros((ROWS, 1), np.int16))
    return zlib.compress(deltas.astype("<i2").tobytes(), 9)


def main(arguments: list[str]) -> None:
    """Write the file and print its checksum and that of its source."""
    if len(arguments) != 1:
        raise SystemExit("usage: python -m tools.make_geoid egm96_15.gtx")
    source = Path(arguments[0]).read_bytes()
    made = packed(centimetres(source))
    DATA.write_bytes(made)
    for name, content in (("egm96_15.gtx", source), (DATA.name, made)):
        print(f"{name}\t{len(content)} bytes\tsha256 {hashlib.sha256(content).hexdigest()}")


if __name__ == "__main__":
    main(sys.argv[1:])
