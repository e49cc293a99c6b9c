"""`--version`: the program, and the data by which it judges."""

from __future__ import annotations

import hashlib
import importlib.resources
from collections.abc import Iterator

from mavframecheck import __version__


def versions() -> Iterator[str]:
    """Yield a line for the program, the dialect, the catalogue and the rules.

    Data has no version number of its own: a digest tells whether two installations judge alike.
    """
    from mavframecheck.engine import load_pack
    from mavframecheck.semantics import catalogue
    from mavframecheck.wire import DEFAULT_DIALECT, load_dialect

    rules = load_pack().rules
    preview = sum(rule.status == "preview" for rule in rules)
    messages = len(load_dialect(DEFAULT_DIALECT).layouts)
    yield f"mavframecheck {__version__}"
    yield f"dialect    {DEFAULT_DIALECT}, {messages} messages ({_digest('wire')})"
    yield f"catalogue  {len(catalogue.all_tags())} fields ({_digest('semantics')})"
    yield f"rules      {len(rules)}, {preview} of them in preview ({_digest('engine')})"


def _digest(floor: str) -> str:
    """Return the beginning of the SHA-256 of the data of a floor, line ends apart."""
    digest = hashlib.sha256()
    folder = importlib.resources.files(f"mavframecheck.{floor}").joinpath("data")
    for file in sorted(folder.iterdir(), key=lambda each: each.name):
        digest.update(file.name.encode() + b"\0" + file.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:12]
