"""Rule files for tests of checks: the rules by code, and places at which a recording is cut."""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec
import numpy as np

from mavframecheck.engine import Pack
from mavframecheck.model import Rule

RULES = Path(__file__).parents[2] / "rules"


def rule_named(code: str) -> Rule:
    """Return the shipped rule of a code."""
    file = next(RULES.glob(f"*/{code}-*.toml"))
    return msgspec.convert(tomllib.loads(file.read_text("utf-8")), Rule)


def pack_of_files(*codes: str) -> Pack:
    """Return a pack of some shipped rules."""
    return Pack(tuple(rule_named(code) for code in codes), {code: f"{code}.toml" for code in codes})


def chopped(data: bytes, pieces: int = 12) -> list[int]:
    """Return places, not between records, at which to cut a recording."""
    places: list[int] = np.random.default_rng(len(data)).integers(1, len(data), pieces).tolist()
    return places
