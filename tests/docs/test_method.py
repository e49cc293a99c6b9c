"""The picture of a fit is what its script draws."""

from __future__ import annotations

import re

from tools.plot_fit import SAMPLE, TARGET, picture


def test_the_picture_is_current() -> None:
    """Generated, not drawn: the same numbers to a tenth of a pixel on every machine."""
    written, drawn = TARGET.read_text(encoding="utf-8"), picture(SAMPLE)
    words = re.compile(r"-?\d+\.\d+")
    assert words.sub("#", written) == words.sub("#", drawn)
    pairs = zip(words.findall(written), words.findall(drawn), strict=True)
    assert all(abs(float(a) - float(b)) <= 0.11 for a, b in pairs)
