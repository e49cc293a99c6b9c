"""Every rule has its page in `docs/rules`, and the pages say what the rule files and the tool say."""

from __future__ import annotations

import math
import re

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from tools.pages.rules import FOLDER, pages

WRITTEN = pages()
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
HOW = "run `make generate`"


def test_no_page_is_missing_or_left_over() -> None:
    """One page a rule, and the index."""
    assert {file.name for file in FOLDER.iterdir()} == set(WRITTEN), HOW


@pytest.mark.parametrize("name", sorted(WRITTEN))
def test_page_is_current(name: str) -> None:
    """A page says what would be written today; the last digits of fits differ between machines."""
    kept, fresh = (FOLDER / name).read_text("utf-8"), WRITTEN[name]
    assert NUMBER.sub("#", kept).split() == NUMBER.sub("#", fresh).split(), HOW
    for one, other in zip(NUMBER.findall(kept), NUMBER.findall(fresh)):
        close = math.isclose(float(one), float(other), rel_tol=1e-4, abs_tol=1e-6)
        assert close, f"{one} is now {other}: {HOW}"


@pytest.mark.parametrize("name", sorted(set(WRITTEN) - {"index.md"}))
def test_page_has_all_parts(name: str) -> None:
    """Why, mending, a message as bytes, what the tool prints for it, what is looked for, references."""
    parts = re.findall(r"^## (.+)$", WRITTEN[name], re.MULTILINE)
    wanted = ["Why it matters", "How to mend it", "Example", "What it looks for", "References"]
    assert [part for part in parts if part in wanted] == wanted
    of_a_mission = "example.plan" in WRITTEN[name]
    assert of_a_mission or re.search(
        r"^(header|bytes)( +[0-9a-f]{2})+", WRITTEN[name], re.MULTILINE
    )
    code = name.removesuffix(".md")
    assert f"$ mavframecheck check --select {code}" in WRITTEN[name]
    assert re.search(rf"^  (error|warning|info) {code} ", WRITTEN[name], re.MULTILINE)


NAMED = [name for name, page in sorted(WRITTEN.items()) if "the first that the finding is" in page]
"""Pages whose bytes are a good frame of a known message."""


@pytest.mark.parametrize("name", NAMED)
def test_bytes_are_the_message_of_the_table(name: str) -> None:
    """The bytes on a page, decoded by pymavlink, are the message and the numbers of the table above them."""
    page = WRITTEN[name].split("the first that the finding is about", 1)
    called = re.findall(r"`(\w+)`", page[0])[-1]
    table = dict(re.findall(r"^\| `(\w+)` \| ([^|]*?) \|", page[1], re.MULTILINE))
    octets = re.findall(
        r"^(?:header|payload|checksum| ) +((?:[0-9a-f]{2} ?)+)$", page[1], re.MULTILINE
    )
    message = ardupilotmega.MAVLink(None).decode(bytearray.fromhex("".join(octets)))
    assert message.get_type() == called
    for field, shown in table.items():
        if re.fullmatch(r"-?[\d.e+-]+", shown) and hasattr(message, field):
            assert float(shown) == pytest.approx(getattr(message, field), rel=1e-6), field
