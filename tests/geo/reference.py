"""The geoid as PROJ computes it from the source grid: an oracle, and a table of what it said.

``python -m tests.geo.reference`` writes `egm96_reference.csv` again; it needs Debian's `proj-data`.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

Floats = npt.NDArray[np.float64]

GRID = Path("/usr/share/proj/egm96_15.gtx")
"""Where Debian's package `proj-data` puts it."""
TABLE = Path(__file__).with_name("egm96_reference.csv")

needs_grid = pytest.mark.skipif(
    not GRID.is_file(), reason="egm96_15.gtx is not installed (Debian: proj-data)"
)


def undulation(lat: Floats, lon: Floats) -> Floats:
    """Return (n,) m. The grid is named by its path: given codes, PROJ answers 0 where it finds none."""
    pyproj = pytest.importorskip("pyproj")
    pipeline = f"+proj=vgridshift +grids={GRID} +multiplier=1"
    shift = pyproj.Transformer.from_pipeline(pipeline)
    heights = shift.transform(np.radians(lon), np.radians(lat), np.zeros(len(lat)), radians=True)[2]
    return np.asarray(heights, np.float64)


def places() -> tuple[Floats, Floats]:
    """Return (n,) degrees each: places all over the Earth, even by area, and those where grids end."""
    rng = np.random.default_rng(96)
    lat = np.degrees(np.arcsin(rng.uniform(-1, 1, 180)))
    lon = rng.uniform(-180, 180, 180)
    edges = [(a, o) for a in (-90.0, -89.9, 0.0, 89.9, 90.0) for o in (-180, -179.9, 0.0, 179.9)]
    edge_lat, edge_lon = np.array(edges).T
    return np.round(np.append(lat, edge_lat), 7), np.round(np.append(lon, edge_lon), 7)


def table() -> tuple[Floats, Floats, Floats]:
    """Return (n,) latitude and longitude, degrees, and undulation, m, of the stored table."""
    lat, lon, metres = np.loadtxt(TABLE, delimiter=",", skiprows=1, unpack=True)
    return lat, lon, metres


def main() -> None:
    """Write the table."""
    lat, lon = places()
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("lat_deg", "lon_deg", "undulation_m"))
        for a, o, metres in zip(lat, lon, undulation(lat, lon)):
            writer.writerow((f"{a:.7f}", f"{o:.7f}", f"{metres:.4f}"))


if __name__ == "__main__":
    main()
