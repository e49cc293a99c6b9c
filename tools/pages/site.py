"""Everything the site shows, put together in `build/docs`: what the generator is given.

It has more pages than `docs/`: the catalogue, and files that lie elsewhere in the checkout.
``python -m tools.pages.site`` writes it; `make docs` then runs the generator.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from tools.pages import catalogue

ROOT = Path(__file__).parents[2]
TARGET = ROOT / "build" / "docs"
ELSEWHERE = {
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "samples/README.md": "samples.md",
}
"""File in the checkout -> page of the site."""


def write(target: Path) -> None:
    """Write all pages below `target`, anew."""
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(ROOT / "docs", target)
    for file in target.glob("*.md"):
        _put(file, _inside(file.read_text("utf-8")))
    for source, place in ELSEWHERE.items():
        _put(target / place, (ROOT / source).read_text("utf-8").replace("](docs/", "]("))
    for place, content in catalogue.pages().items():
        _put(target / place, content)


def _inside(markdown: str) -> str:
    """Turn links to files elsewhere in the checkout into links to their pages."""
    for source, place in ELSEWHERE.items():
        markdown = markdown.replace(f"](../{source}", f"]({place}")
    return markdown


def _put(file: Path, content: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(content, "utf-8", newline="\n")


if __name__ == "__main__":
    write(TARGET)
