"""`make accuracy`: what `check` finds on labelled recordings, against what it should find.

A label gives the `kind` of a recording (clean, faulty, undecidable), codes of which one must be
reported (`expect`), and codes that may be (`allow`). Any other error or warning is a false alarm.
"""

from __future__ import annotations

import sys
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.corpus import Checked, check_all, check_arguments, is_absent

RULES = Path(__file__).parents[1] / "rules"
SUFFIXES = (".tlog", ".raw", ".pcap", ".pcapng")
BAD = ("missed", "false alarm", "failed")
"""Verdicts that fail the run."""


class Verdict(NamedTuple):
    """How one recording ended."""

    name: str
    word: str
    """found, missed, not built yet, quiet, false alarm, failed"""
    codes: tuple[str, ...]
    """Codes that earned the word."""
    beside: tuple[str, ...] = ()
    """On a faulty recording: other errors and warnings, to be explained or mended."""
    remark: str = ""


def built_codes(preview: bool) -> set[str]:
    """Return the codes of the rule files that a run uses."""
    rules = [tomllib.loads(path.read_text("utf-8")) for path in RULES.rglob("MFC*.toml")]
    return {rule["code"] for rule in rules if preview or rule["status"] == "stable"}


def judge(checked: Checked, label: dict[str, Any], built: set[str]) -> Verdict:
    """Return how one recording ended."""
    name, expect = checked.path.stem, set(label.get("expect", ()))
    if checked.failure:
        return Verdict(name, "failed", (), remark=checked.failure)
    codes = {finding["code"] for finding in checked.findings}
    loud = {f["code"] for f in checked.findings if f["severity"] in ("error", "warning")}
    beside = tuple(sorted(loud - expect - set(label.get("allow", ()))))
    if label["kind"] != "faulty":
        return Verdict(name, "false alarm" if beside else "quiet", beside)
    if codes & expect:
        return Verdict(name, "found", tuple(sorted(codes & expect)), beside)
    word = "missed" if expect & built else "not built yet"
    return Verdict(name, word, tuple(sorted(expect)), beside)


def show(verdict: Verdict) -> None:
    """Print one recording on one line."""
    beside = f"  also {' '.join(verdict.beside)}" if verdict.beside else ""
    said = " ".join(verdict.codes) + beside + verdict.remark
    print(f"{verdict.word:14}{verdict.name:56}{said}".rstrip())


def summarise(verdicts: list[Verdict]) -> None:
    """Print the totals."""
    totals = Counter(verdict.word for verdict in verdicts)
    beside = Counter(code for verdict in verdicts for code in verdict.beside)
    print(f"\n{len(verdicts)} recordings: " + ", ".join(f"{n} {w}" for w, n in totals.items()))
    if beside:
        said = ", ".join(f"{code} on {n}" for code, n in sorted(beside.items()))
        print(f"Beside the fault, on faulty recordings (explain or mend): {said}")


def main() -> int:
    """Judge every labelled recording; 1 when one is missed, alarmed falsely or failed."""
    options = check_arguments(__doc__ or "").parse_args()
    folder = options.corpus / "sitl"
    if is_absent(folder):
        return 0
    labels = tomllib.loads((folder / "labels.toml").read_text("utf-8"))
    paths = sorted(p for p in folder.iterdir() if p.stem in labels and p.suffix in SUFFIXES)
    built = built_codes(options.preview)
    verdicts = []
    for checked in check_all(paths, options):
        verdicts.append(judge(checked, labels[checked.path.stem], built))
        show(verdicts[-1])
    summarise(verdicts)
    return int(any(verdict.word in BAD for verdict in verdicts))


if __name__ == "__main__":
    sys.exit(main())
