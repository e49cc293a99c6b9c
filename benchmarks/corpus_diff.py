"""`make corpus-diff`: which findings a change adds or removes on the recordings.

Save before the change, compare after it. Read every line: a rule is right when its lines are.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from benchmarks.corpus import Checked, check_all, check_arguments, is_absent

FOLDERS = ("sitl", "real/tlog", "real/raw", "real/pcap", "real/plan", "real/wpl")
NOT_RECORDINGS = (".toml", ".md", ".csv")


@dataclass(frozen=True, order=True)
class Line:
    """A finding, as far as a difference in it matters."""

    file: str
    code: str
    severity: str
    subject: str
    count: int
    text: str

    def __str__(self) -> str:
        """Return the finding on one line."""
        return f"{self.file}: {self.severity} {self.code} {self.subject} x{self.count}: {self.text}"


def lines_of(checked: Checked, corpus: Path) -> list[Line]:
    """Return the findings of a recording; a failed run is a line of its own."""
    file = checked.path.relative_to(corpus).as_posix()
    if checked.failure:
        return [Line(file, "failed", "error", "", 1, checked.failure)]
    kept = [field.name for field in fields(Line)][1:]
    return [Line(file, *(finding[key] for key in kept)) for finding in checked.findings]


def save(lines: list[Line], baseline: Path) -> None:
    """Write the findings, one JSON object a line."""
    baseline.parent.mkdir(parents=True, exist_ok=True)
    text = "".join(json.dumps(asdict(line)) + "\n" for line in lines)
    baseline.write_text(text, encoding="utf-8")
    print(f"{len(lines)} findings saved in {baseline}")


def load(baseline: Path) -> list[Line]:
    """Return the findings saved before."""
    return [Line(**json.loads(row)) for row in baseline.read_text("utf-8").splitlines()]


def show_difference(before: list[Line], after: list[Line]) -> None:
    """Print what went and what came, a code at a time, and the totals."""
    changes = [("-", line) for line in (Counter(before) - Counter(after)).elements()]
    changes += [("+", line) for line in (Counter(after) - Counter(before)).elements()]
    for sign, line in sorted(changes, key=lambda change: (change[1].code, change[1])):
        print(sign, line)
    totals = Counter((line.code, sign) for sign, line in changes)
    for code in sorted({code for code, _ in totals}):
        print(f"{code}: {totals[code, '+']} added, {totals[code, '-']} removed")
    print(f"{len(before)} findings before, {len(after)} after, {len(changes)} differences")


def main() -> int:
    """Save the findings of the whole corpus, or compare them with those saved."""
    parser = check_arguments(__doc__ or "")
    parser.add_argument("--baseline", type=Path, default=Path("build/corpus-baseline.jsonl"))
    parser.add_argument("--save", action="store_true", help="write the baseline")
    options = parser.parse_args()
    if is_absent(options.corpus):
        return 0
    if not options.save and not options.baseline.is_file():
        print(f"No baseline at {options.baseline}: run with --save on the state to compare with.")
        return 2
    folders = [options.corpus / folder for folder in FOLDERS]
    paths = sorted(p for f in folders if f.is_dir() for p in f.iterdir() if p.is_file())
    recordings = [path for path in paths if path.suffix not in NOT_RECORDINGS]
    results = check_all(recordings, options)
    lines = [line for checked in results for line in lines_of(checked, options.corpus)]
    if options.save:
        save(lines, options.baseline)
    else:
        show_difference(load(options.baseline), lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
