"""Pages that show the tool at work show what it prints."""

from __future__ import annotations

import re

import pytest

from tools.pages.shown import PAGES, ROOT, renewed


@pytest.mark.parametrize("name", PAGES)
def test_output_is_real(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """`make generate` writes what the commands print today."""
    monkeypatch.chdir(ROOT)
    page = (ROOT / name).read_text("utf-8")
    assert renewed(page) == page, "run `make generate`"


def test_what_differs_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command is run and its output put in; `$?` is the exit code of the one before it."""
    monkeypatch.chdir(ROOT)
    page = "```text\n$ mavframecheck check nowhere.tlog\n$ echo $?\n0\n```\n"
    assert re.search(r"nowhere\.tlog: .*\n(.*\n)*\$ echo \$\?\n2\n```", renewed(page))
