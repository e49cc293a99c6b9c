"""The notation of sentinels in the tables: `NaN=unknown; 65535=unknown; 36000->north`."""

from __future__ import annotations

import re
from functools import cache
from math import nan
from typing import Literal

from mavframecheck.semantics.tags import Sentinel

_LIMITS: dict[str, int] = {
    "INT8_MAX": 2**7 - 1,
    "INT16_MAX": 2**15 - 1,
    "INT32_MAX": 2**31 - 1,
    "INT32_MIN": -(2**31),
    "UINT8_MAX": 2**8 - 1,
    "UINT16_MAX": 2**16 - 1,
    "UINT32_MAX": 2**32 - 1,
}
_SCOPES: dict[str, Literal["element", "first", "all"]] = {
    "": "element",
    "[0]": "first",
    "[*]": "all",
}
_FORM = re.compile(
    r"(?P<below><?)(?P<code>[^\[=<>]+?)(?P<scope>\[[0*]\])?(?P<sign>->|=)(?P<meaning>.+)"
)


@cache
def parse_sentinels(text: str) -> tuple[Sentinel, ...]:
    """Parse a cell; the forms are explained in `docs/conventions.md`."""
    return tuple(_sentinel(part.strip()) for part in text.split(";") if part.strip())


def _sentinel(text: str) -> Sentinel:
    match = _FORM.fullmatch(text)
    if match is None:
        raise ValueError(f"not a sentinel: {text!r}")
    code = match["code"]
    is_nan = code == "NaN"
    return Sentinel(
        kind="nan" if is_nan else "below" if match["below"] else "value",
        value=nan if is_nan else float(_LIMITS.get(code, code)),
        meaning=match["meaning"].strip(),
        scope=_SCOPES[match["scope"] or ""],
        known=match["sign"] == "->",
    )
