"""From structs to what JSON can hold: no NaN, no infinity, no half characters."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from mavframecheck.report.escape import utf8


def plain(value: object) -> Any:
    """Return structs as dicts, lists and scalars that are valid JSON in any reader.

    A number that JSON lacks is ``null``, except in evidence, where "NaN" may be the very point:
    there it is text.
    """
    return _mend(msgspec.to_builtins(value), in_evidence=False)


def _mend(value: Any, *, in_evidence: bool) -> Any:
    match value:
        case str():
            return utf8(value)
        case float() if not math.isfinite(value):
            return _word(value) if in_evidence else None
        case dict():
            return {
                utf8(key): _mend(item, in_evidence=in_evidence or key == "evidence")
                for key, item in value.items()
            }
        case list() | tuple():
            return [_mend(item, in_evidence=in_evidence) for item in value]
    return value


def _word(value: float) -> str:
    """Return the name of a number that JSON has no number for."""
    if math.isnan(value):
        return "NaN"
    return "Infinity" if value > 0 else "-Infinity"
