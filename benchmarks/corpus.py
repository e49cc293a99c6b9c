"""The recordings to judge the software on, and `check` run over many of them."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

Finding = dict[str, Any]
FINDINGS_OR_NONE = (0, 1)
"""Exit codes of a `check` that did its work."""


class Checked(NamedTuple):
    """What `check` said of a recording; `failure` when it did not do its work."""

    path: Path
    findings: list[Finding]
    failure: str = ""


def arguments(description: str) -> argparse.ArgumentParser:
    """Return the option that every tool here has."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--corpus", type=Path, default=Path("../shared/corpus"))
    return parser


def check_arguments(description: str) -> argparse.ArgumentParser:
    """Return the options of the tools that run `check_all`."""
    parser = arguments(description)
    parser.add_argument("--preview", action="store_true", help="with preview rules")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    return parser


def is_absent(folder: Path) -> bool:
    """Return whether a folder of recordings is missing, and say so."""
    if folder.is_dir():
        return False
    print(f"No recordings at {folder}: nothing to compare. Point --corpus at them.")
    return True


def check(path: Path, *options: str) -> Checked:
    """Run `check` on a recording in a process of its own."""
    command = [sys.executable, "-m", "mavframecheck", "check", str(path), "--format", "json"]
    run = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    if run.returncode not in FINDINGS_OR_NONE:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        return Checked(path, [], f"exit {run.returncode}: {last}")
    return Checked(path, json.loads(run.stdout)["findings"])


def check_all(paths: Iterable[Path], options: argparse.Namespace) -> Iterator[Checked]:
    """Run `check` on every recording, some at once, and yield the results in order."""
    chosen = ("--preview",) if options.preview else ()
    with ThreadPoolExecutor(options.jobs) as pool:
        yield from pool.map(lambda path: check(path, *chosen), paths)
