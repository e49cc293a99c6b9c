"""Try rule files before they join the pack: their examples, then recordings.

    python -m tools.try_rules rules/frames/MFC101-*.toml
    python -m tools.try_rules rules/frames/*.toml --on ../shared/corpus/sitl --labels
    python -m tools.try_rules my_rules/*.toml --on flight.tlog --all

Examples must do what they say. On recordings every error and warning is printed (with `--all` information
too); with `--labels` what the labelled recordings expect and allow is compared.
"""

from __future__ import annotations

import argparse
import tomllib
from collections import Counter
from pathlib import Path

from mavframecheck.engine import Pack, Settings, check_file
from mavframecheck.engine.examples import run_example
from mavframecheck.engine.pack import read_rule
from mavframecheck.model import Finding, Rule
from mavframecheck.sources import expand


def try_examples(rule: Rule, source: str) -> int:
    """Run the examples of a rule; print and count those that do not do what they say."""
    wrong = 0
    for number, example in enumerate(rule.example, start=1):
        _, findings = run_example(rule, example, source)
        if bool(findings) != (example.expect == "bad"):
            wrong += 1
            print(f"{rule.code} example {number} ({example.expect}): {len(findings)} findings")
    return wrong


def show(finding: Finding, mark: str) -> None:
    """Print a finding on one line."""
    name = Path(finding.file).name
    print(f"{mark:9} {name} {finding.code} {finding.severity} {finding.subject} x{finding.count}")
    print(f"          {finding.text}")


def try_recordings(
    pack: Pack, paths: list[str], labels: dict[str, dict[str, list[str]]], *, everything: bool
) -> None:
    """Judge recordings; print findings, and how they agree with the labels."""
    codes = {rule.code for rule in pack.rules}
    totals: Counter[str] = Counter()
    for path in expand(paths).recordings:
        _, findings = check_file(str(path), pack, Settings(preview=True))
        label = labels.get(Path(str(path)).stem, {})
        expected = codes & set(label.get("expect", []))
        tolerated = expected | set(label.get("allow", []))
        for finding in findings:
            alarm = finding.severity != "info" and finding.code not in tolerated
            totals["alarms" if alarm else "others"] += 1
            if alarm or everything:
                show(finding, "ALARM" if alarm else "")
        if expected:
            found = expected & {finding.code for finding in findings}
            totals["found" if found else "missed"] += 1
            print(f"{'found' if found else 'MISSED':9} {path} {' '.join(sorted(expected))}")
    print(", ".join(f"{count} {what}" for what, count in sorted(totals.items())) or "nothing found")


def main() -> None:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("rules", nargs="+", type=Path, help="rule files")
    parser.add_argument("--on", nargs="*", default=[], help="recordings or directories")
    parser.add_argument(
        "--labels", action="store_true", help="compare with labels.toml beside the recordings"
    )
    parser.add_argument("--all", action="store_true", help="print information too")
    arguments = parser.parse_args()
    read = [read_rule(file) for file in arguments.rules]
    wrong = sum(try_examples(rule, source) for rule, source in read)
    print(f"{len(read)} rules, {wrong} examples wrong")
    labels: dict[str, dict[str, list[str]]] = {}
    for folder in arguments.on if arguments.labels else []:
        labels |= tomllib.loads((Path(folder) / "labels.toml").read_text("utf-8"))
    pack = Pack(tuple(rule for rule, _ in read), {rule.code: source for rule, source in read})
    if arguments.on:
        try_recordings(pack, arguments.on, labels, everything=arguments.all)


if __name__ == "__main__":
    main()
