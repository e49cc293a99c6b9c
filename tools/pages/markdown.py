"""Plain text and tables as Markdown that reads alike in a checkout and on the site."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_SPECIAL = re.compile(r"[\\`*\[\]|]|(?<!\w)_|_(?!\w)|<")


def text(plain: str) -> str:
    """Return `plain` on one line with nothing in it that Markdown would read as markup."""
    return _SPECIAL.sub(lambda m: "&lt;" if m[0] == "<" else f"\\{m[0]}", " ".join(plain.split()))


def paragraphs(plain: str) -> str:
    """Return paragraphs (parted by empty lines) as text."""
    return "\n\n".join(text(part) for part in plain.strip().split("\n\n"))


def code(plain: object) -> str:
    """Return a short piece of code."""
    return f"`{plain}`"


def fence(lines: str, language: str = "text") -> str:
    """Return `lines` as a block that is shown as it is."""
    return f"```{language}\n{lines.rstrip()}\n```"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells that are Markdown already; empty without rows."""
    lines = [_row(row) for row in rows]
    return "\n".join([_row(head), _row(["---"] * len(head)), *lines]) if lines else ""


def without_empty(
    head: Sequence[str], rows: Iterable[Sequence[str]]
) -> tuple[list[str], list[list[str]]]:
    """Return head and rows without the columns in which no row has anything."""
    listed = list(rows)
    kept = [k for k in range(len(head)) if any(row[k] for row in listed)]
    return [head[k] for k in kept], [[row[k] for k in kept] for row in listed]


def _row(cells: Sequence[str]) -> str:
    return "|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|"


def page(parts: Iterable[str]) -> str:
    """Return the parts that are not empty, an empty line between two."""
    return "\n\n".join(part for part in parts if part) + "\n"
