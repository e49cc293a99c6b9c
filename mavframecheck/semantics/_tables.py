"""Reading the authored CSV tables of `data/`."""

from __future__ import annotations

import csv
from pathlib import Path

_DATA = Path(__file__).parent / "data"


def read(name: str) -> list[dict[str, str]]:
    """Return the rows of `data/<name>.csv` by column name, cells as text."""
    with (_DATA / f"{name}.csv").open(newline="", encoding="utf-8") as lines:
        reader = csv.reader(lines)
        header = next(reader)
        return [dict(zip(header, row, strict=True)) for row in reader]
