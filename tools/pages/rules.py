"""The page of each rule and the index of all, written from the rule files into `docs/rules/`.

``python -m tools.pages.rules`` writes them again; a test fails when one is missing or stale.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

from mavframecheck.checks import load_check
from mavframecheck.engine import Pack
from mavframecheck.engine.pack import load_pack, source_folder
from mavframecheck.model import Rule, setting
from tools.pages.examples import Judged, judged, shown
from tools.pages.markdown import code, fence, page, paragraphs, table, text

FOLDER = Path(__file__).parents[2] / "docs" / "rules"
"""Where the pages are kept in a checkout."""

FAMILIES = {
    "stream": ("The stream", "Bytes and frames: what is damaged, lost, doubled or unknown."),
    "frames": (
        "Frames and masks",
        "What a frame or a type mask says, and what the autopilot makes of it.",
    ),
    "altitude": (
        "Altitude",
        "What a height is measured from: sea, ellipsoid, home, terrain, pressure.",
    ),
    "units": (
        "Units and scales",
        "Numbers in another unit, scale, order or precision than their field.",
    ),
    "axes": ("Axes and rotations", "Signs, axes and rotations, judged by how the vehicle moves."),
    "external": (
        "External estimates",
        "Vision, odometry and motion capture: covariances, resets, frames.",
    ),
    "sentinels": (
        "Unknown values",
        "NaN, zeros and tokens for unset that mean something else; injected GPS.",
    ),
    "origin": (
        "Origin and home",
        "Local origins and homes that move, differ or are taken for each other.",
    ),
    "time": ("Time", "Stamps: units, epochs, order, delay."),
    "missions": ("Missions", "Plans, fences and uploads: legs, order, heights, frames."),
}
"""Folder of a family -> its title and what it is about, in the order of the codes."""

_UNITS = {
    "ms_per_min": "ms/min",
    "radps": "rad/s",
    "mps": "m/s",
    "deg": "deg",
    "rad": "rad",
    "km": "km",
    "m": "m",
    "s": "s",
    "seconds": "s",
    "share": "0 to 1",
}
"""Last part of a parameter's name -> unit."""
_LOOKS_FOR = re.compile(r"\[\[?(applies|let|detect|severity_when)\]")
"""Head of a table of a rule file that says what is judged and what is wrong."""


def pages() -> dict[str, str]:
    """Return every page by its file name in `docs/rules`."""
    pack = load_pack()
    written = {f"{rule.code}.md": _rule(rule, _source(rule, pack)) for rule in pack.rules}
    return written | {"index.md": _index(pack)}


def _source(rule: Rule, pack: Pack) -> str:
    return (source_folder() / pack.sources[rule.code]).read_text("utf-8")


def family(rule: Rule, pack: Pack) -> str:
    """Return the folder of a rule's file."""
    return Path(pack.sources[rule.code]).parent.name


# ---- the index ----


def _index(pack: Pack) -> str:
    return page(_index_parts(pack))


def _index_parts(pack: Pack) -> Iterator[str]:
    """Yield the families, each with its rules."""
    yield "# Rules"
    preview = sum(rule.status == "preview" for rule in pack.rules)
    yield (
        f"{len(pack.rules)} rules ship with mavframecheck. `mavframecheck rule CODE` explains one in the "
        "terminal. Each page shows an example: the message with its fields and bytes, and what the tool "
        "prints for it."
    )
    if preview:
        yield (
            f"Of these {preview} are still being fitted (preview): they run only with `--preview`, or "
            "when `--select` names their code."
        )
    folders = dict.fromkeys(family(rule, pack) for rule in pack.rules)
    for folder in folders:
        title, about = FAMILIES.get(folder, (folder.capitalize(), ""))
        rules = [rule for rule in pack.rules if family(rule, pack) == folder]
        yield f"## {title}"
        yield f"{about} Codes {rules[0].family}."
        yield table(("code", "name", "severity", "what is wrong"), map(_listed, rules))


def _listed(rule: Rule) -> tuple[str, ...]:
    preview = " (preview)" if rule.status == "preview" else ""
    return (
        f"[{rule.code}]({rule.code}.md)",
        text(rule.name),
        f"{rule.severity}{preview}",
        text(rule.summary),
    )


# ---- one rule ----


def _rule(rule: Rule, source: str) -> str:
    return page(_rule_parts(rule, source))


def _rule_parts(rule: Rule, source: str) -> Iterator[str]:
    found = judged(rule)
    yield f"# {rule.code} {text(rule.name)}"
    yield (
        f"**{rule.severity}**, {rule.confidence} confidence, {rule.status}, since {rule.since} "
        "([all rules](index.md))"
    )
    yield text(rule.summary)
    yield "## Why it matters"
    yield paragraphs(rule.explain.why)
    yield "## How to mend it"
    yield _fix(rule, found)
    yield "## Example"
    yield from shown(rule, found)
    yield from _left_alone(rule)
    yield "## What it looks for"
    yield from _check(rule)
    yield fence(_excerpt(source), "toml")
    yield from _parameters(rule, source)
    yield "## References"
    yield "\n".join(f"- {text(each)}" for each in rule.explain.references)


def _fix(rule: Rule, found: Judged) -> str:
    """Return the remedy; one that holds numbers of the finding as it reads for the example."""
    if "{" not in rule.explain.fix:
        return paragraphs(rule.explain.fix)
    return f"For the example below: {paragraphs(found.checked.findings[0].fix)}"


def _left_alone(rule: Rule) -> Iterator[str]:
    """Yield the traffic that looks alike and is right, as far as the examples say it in words."""
    notes = [each.note for each in rule.example if each.expect == "good" and each.note]
    if notes:
        yield "## What it leaves alone"
        yield "\n".join(f"- {text(note)}" for note in notes)


def _check(rule: Rule) -> Iterator[str]:
    """Yield what the Python check says of itself; expressions speak for themselves."""
    if rule.detect.check:
        said = inspect.getdoc(load_check(rule.detect.check)) or ""
        yield f"The check {code(rule.detect.check)}: {paragraphs(said)}"


def _excerpt(source: str) -> str:
    """Return the tables of a rule file that say what is judged and what is wrong."""
    tables = re.split(r"^(?=\[)", source, flags=re.MULTILINE)
    return "\n\n".join(each.strip() for each in tables if _LOOKS_FOR.match(each))


def _parameters(rule: Rule, source: str) -> Iterator[str]:
    """Yield a table of the thresholds with their units, and how one is changed."""
    if not rule.params:
        return
    yield "## Parameters"
    rows = [
        (code(name), code(setting(value)), _unit(name), text(_remark(name, source)))
        for name, value in rule.params.items()
    ]
    yield table(("name", "default", "unit", "why"), rows)
    name, value = next(iter(rule.params.items()))
    yield f"Change one with {code(f'--set {rule.code}.{name}={setting(value)}')}."


def _unit(name: str) -> str:
    """Return the unit that a parameter carries in its name, empty for a bare number."""
    return next((unit for end, unit in _UNITS.items() if name.endswith(f"_{end}")), "")


def _remark(name: str, source: str) -> str:
    """Return the comment beside a parameter in the rule file, the unit not said twice."""
    line = re.search(rf"^{name}\s*=\s*(?:\"[^\"]*\"|[^#\n\"]*)(?:#(.*))?$", source, re.MULTILINE)
    remark = (line[1] or "").strip() if line else ""
    unit = re.escape(_unit(name))
    return re.sub(rf"^{unit}(?:$|[:,]?\s+)", "", remark) if unit else remark


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    written = pages()
    for stale in {file.name for file in FOLDER.glob("*.md")} - set(written):
        (FOLDER / stale).unlink()
    for name, content in written.items():
        (FOLDER / name).write_text(content, "utf-8", newline="\n")
