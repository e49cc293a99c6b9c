"""Judging recordings in memory, whole or cut into chunks at chosen places."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterable, Iterator
from io import BytesIO
from typing import Any

import msgspec

from mavframecheck.engine import Pack, Settings, load_pack
from mavframecheck.engine.check import check_recording
from mavframecheck.engine.compiled import CompiledRule
from mavframecheck.engine.pack import compile_rule
from mavframecheck.model import FileReport, Finding, Rule, RuleRun
from mavframecheck.sources import Kind, Recording
from mavframecheck.wire import Chunk
from tests.strategies import DIALECT, chunks, cut

Result = tuple[FileReport, tuple[Finding, ...]]


class CutRecording(Recording):
    """A recording whose bytes come in other pieces than a file's would."""

    def __init__(self, data: bytes, pieces: Iterable[bytes], kind: Kind) -> None:
        super().__init__("made up", BytesIO(data), kind)
        self._pieces = list(pieces)

    def chunks(self) -> Iterator[list[Chunk]]:
        yield from chunks(self._pieces)


@functools.cache
def shipped() -> Pack:
    """Return the rules of the package."""
    return load_pack()


def judge(
    data: bytes,
    cuts: Iterable[int] = (),
    pack: Pack | None = None,
    *,
    kind: Kind = Kind.TLOG,
    **settings: Any,
) -> Result:
    """Judge bytes as a recording, cut at some places."""
    opened = CutRecording(data, cut(data, cuts), kind)
    chosen = Settings(**{"preview": True, **settings})
    return check_recording(opened, shipped() if pack is None else pack, chosen, DIALECT)


def run_of(result: Result, code: str) -> RuleRun:
    """Return how a rule ended."""
    return next(run for run in result[0].runs if run.code == code)


RULE = """
code = "MFC999"
name = "made-up"
severity = "error"
confidence = "high"
status = "stable"
since = "0.1.0"
summary = "Made up for a test."
[applies]
message = ["ATTITUDE"]
[detect]
flag = "raw(roll) > 1"
[explain]
text = "roll is {raw(roll):.1f}"
why = "Because."
fix = "Do not."
"""


def rule(**changes: Any) -> Rule:
    """Return a rule that flags ATTITUDE with a roll above 1 rad, with some of its tables changed."""
    content = tomllib.loads(RULE)
    for key, value in changes.items():
        old = content.get(key)
        content[key] = old | value if isinstance(old, dict) else value
    return msgspec.convert(content, Rule)


def compiled(**changes: Any) -> CompiledRule:
    """Return the same ready to run."""
    return compile_rule(rule(**changes), {}, "made_up.toml")


def pack_of(*rules: Rule) -> Pack:
    """Return a pack of some rules."""
    return Pack(rules, {each.code: f"{each.name}.toml" for each in rules})
