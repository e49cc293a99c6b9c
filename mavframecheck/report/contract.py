"""Contracts as people edit them (TOML), and how a link differs from one."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence

from mavframecheck.model.contract import Deviation, Terms
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import Page
from mavframecheck.report.words import plural

_HEAD = """\
# What this system is supposed to send, as seen in {source}
# 'mavframecheck watch LINK --expect FILE' says what is missing or different. Delete what does not matter:
# a stream, or a key of one.
contract = 1
rate_within = 2.0  # a rate may be this many times higher or lower
"""


def toml(streams: Iterable[Terms], source: str) -> Iterator[str]:
    """Yield the contract of `streams`, which were seen in `source`, as TOML."""
    yield _HEAD.format(source=sentence(source))
    for each in streams:
        yield f"\n[[stream]]\nsender = {_text(each.sender)}\nmessage = {_text(each.message)}\n"
        if each.rate_hz is not None:
            yield f"rate_hz = {each.rate_hz:.3g}\n"
        for key in ("frames", "heights", "clocks"):
            names = getattr(each, key)
            if names:
                yield f"{key} = [{', '.join(map(_text, names))}]\n"


def _text(value: str) -> str:
    """Return a TOML string: those of JSON are, as long as nothing is beyond 16 bits."""
    return json.dumps(value)


def contract_lines(differ: Sequence[Deviation], page: Page) -> Iterator[str]:
    """Yield what is not as agreed."""
    yield ""
    if not differ:
        yield page.bold("as agreed: every stream of the contract is there")
        return
    yield page.bold(f"{plural(len(differ), 'difference')} from the contract")
    for each in differ:
        yield from page.wrap(each.text, "  ", "    ")
