"""What pages written by hand show of the tool: `$ mavframecheck ...` and what it prints.

``python -m tools.pages.shown`` runs the commands again and writes what they print today; a test
fails when a page shows anything else. Commands run where the checkout is.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from click.testing import CliRunner

from mavframecheck.cli import main

ROOT = Path(__file__).parents[2]
PAGES = (
    "README.md",
    "docs/index.md",
    "docs/getting-started.md",
    "docs/ci.md",
    "docs/ground-station.md",
)
_BLOCK = re.compile(r"^```(?:text|console)?\n(\$ mavframecheck .*?)^```", re.MULTILINE | re.DOTALL)
_ENVIRONMENT = {"COLUMNS": "80", "GITHUB_ACTIONS": None, "NO_COLOR": "1"}


def renewed(page: str) -> str:
    """Return the text of a page with what its commands print today."""
    return _BLOCK.sub(lambda m: m[0].replace(m[1], "\n".join(_session(m[1])) + "\n"), page)


def _session(block: str) -> Iterator[str]:
    """Yield each command of a block and what it prints; `$ echo $?` prints its exit code."""
    code = 0
    for command in re.findall(r"^\$ (.*)$", block, re.MULTILINE):
        yield f"$ {command}"
        if command == "echo $?":
            yield str(code)
            continue
        result = CliRunner(env=_ENVIRONMENT).invoke(main, command.split()[1:])
        code = result.exit_code
        yield from result.output.rstrip("\n").splitlines()


if __name__ == "__main__":
    os.chdir(ROOT)
    for name in PAGES:
        file = ROOT / name
        file.write_text(renewed(file.read_text("utf-8")), "utf-8", newline="\n")
