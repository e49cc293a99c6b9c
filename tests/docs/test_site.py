"""The site as it is put together: every link leads somewhere, every page can be found."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mavframecheck.semantics import catalogue
from tools.pages.site import ROOT, write

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder that the generator would be given."""
    target = tmp_path_factory.mktemp("site")
    write(target)
    return target


def nav() -> list[str]:
    """Return every page that the navigation names."""
    config = tomllib.loads((ROOT / "zensical.toml").read_text("utf-8"))
    return list(_places(config["project"]["nav"]))


def _places(entries: list[dict[str, Any]]) -> Iterator[str]:
    for entry in entries:
        for place in entry.values():
            yield from [place] if isinstance(place, str) else _places(place)


def test_links(site: Path) -> None:
    """Pages and pictures that a page links to are there."""
    broken = [
        f"{page.relative_to(site)}: {target}"
        for page in site.rglob("*.md")
        for target in LINK.findall(FENCED.sub("", page.read_text("utf-8")))
        if "://" not in target and not (page.parent / target).is_file()
    ]
    assert not broken


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_in_the_checkout(name: str) -> None:
    """So are the files that the pages at the top of the checkout link to."""
    targets = LINK.findall((ROOT / name).read_text("utf-8"))
    assert not [t for t in targets if "://" not in t and not (ROOT / t).exists()]


def test_navigation(site: Path) -> None:
    """The navigation names no page that is not there, and no page of docs/ is left out of it."""
    places = nav()
    assert not [place for place in places if not (site / place).is_file()]
    left_out = {file.name for file in (ROOT / "docs").glob("*.md")} - set(places)
    assert not left_out, "add it to `nav` in zensical.toml"


def test_every_message_has_a_page(site: Path) -> None:
    """Each message of the catalogue, with a row for each of its fields that is no command's own."""
    for message in catalogue.messages():
        page = (site / "catalogue" / f"{message}.md").read_text("utf-8")
        shown = set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE))
        assert shown == {tag.field for tag in catalogue.tags(message)}, message
