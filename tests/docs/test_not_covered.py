"""`docs/not-covered.md` lists what no rule covers: a rule that is there is not listed as missing."""

from __future__ import annotations

import re
from pathlib import Path

from mavframecheck.engine.pack import load_pack

PAGE = (Path(__file__).parents[2] / "docs" / "not-covered.md").read_text("utf-8")


def test_no_rule_that_is_there() -> None:
    """A code in a table is reserved; once its rule is built, the row goes."""
    reserved = set(re.findall(r"\| (MFC\d{3}) \|", PAGE))
    built = reserved & set(load_pack().by_code)
    assert not built, "take their rows out of docs/not-covered.md"


def test_every_row_is_complete() -> None:
    """A mistake, and why it is not covered (or the reserved code)."""
    rows = [line.split("|")[1:-1] for line in PAGE.splitlines() if line.startswith("| ")]
    assert all(len(row) == 3 and row[0].strip() and row[1].strip() for row in rows)
