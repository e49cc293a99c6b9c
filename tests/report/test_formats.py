"""Hostile text in a log is harmless in every format, and every format takes every file."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from xml.etree import ElementTree as ET

import pytest

from mavframecheck.model import Suppressed
from mavframecheck.report import FORMATS, Checked, Context, Remark, load
from tests.report import made_up

HOSTILE_RULE = made_up.rule(
    code=made_up.HOSTILE, name=made_up.HOSTILE, summary=made_up.HOSTILE, since=made_up.HOSTILE
)
REMARKS = (Remark(made_up.HOSTILE, made_up.HOSTILE), Remark(made_up.HOSTILE))
INVISIBLE = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
COMMAND = re.compile(r"^\s*::|##\w*\[", re.MULTILINE)
"""What the runners of GitHub and Azure obey, wherever it comes from."""
MACHINE = ("github",)
"""Formats whose own lines are such commands."""


def written(form: str, results: Sequence[Checked], context: Context) -> str:
    """Return what a format writes; bytes must be UTF-8."""
    pieces = load(form)(results, context)
    return "".join(x.decode() if isinstance(x, bytes) else x for x in pieces)


def hostile() -> Checked:
    """Return a file all of whose text is an attack, with a suppressed finding too."""
    checked = made_up.hostile()
    aside = Suppressed(finding=checked.findings[0], by="baseline", reason=made_up.HOSTILE)
    return checked._replace(suppressed=(aside,))


@pytest.mark.parametrize("verbose", [False, True])
@pytest.mark.parametrize("form", FORMATS)
def test_hostile_text_is_harmless(form: str, verbose: bool) -> None:
    """No control or invisible character, no command to a CI runner, no markup of its own."""
    context = Context("0.1.0", rules=(HOSTILE_RULE,), verbose=verbose, remarks=REMARKS)
    text = written(form, (hostile(), hostile(), made_up.flight()), context)
    assert not {c for c in text if c != "\n" and unicodedata.category(c) in INVISIBLE}
    if form not in MACHINE:
        assert not COMMAND.search(text)
    if form == "junit":
        tags = {element.tag for element in ET.fromstring(text).iter()}
        assert tags <= {
            *("testsuites", "testsuite", "testcase", "failure", "error", "skipped"),
            "system-out",
        }


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_takes_nothing_and_everything(form: str) -> None:
    """No file at all, a clean one, a mission, one without frames."""
    mission = Checked(made_up.file(path="m.plan"), (made_up.mission_item(),))
    empty = Checked(made_up.file(messages=0, runs=()), ())
    context = Context("0.1.0", rules=made_up.rules())
    assert written(form, (made_up.clean(), mission, empty), context)
    assert form == "jsonl" or written(form, (), context)
