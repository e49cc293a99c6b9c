"""How distortions of streams fared, as a table: each on a line, then what went wrong."""

from __future__ import annotations

from collections import Counter, defaultdict

from benchmarks.injection.motion import WORDS, Motions, Outcome
from benchmarks.injection.plan import Distortion

REQUIRED_RECALL = 0.99
"""Of the cases with enough motion, together and each by itself."""
_BAD = ("words", "missed", "passed", "alarm")
_SHOWN = 12
"""Cases of a distortion that are listed."""


def show_motion(distortions: list[Distortion], found: Motions, *, everything: bool) -> bool:
    """Print the table and the totals; return whether all is as it must be."""
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in found.outcomes:
        outcomes[outcome.distortion].append(outcome)
    print(f"\n{'distortion':42}{'recall':>8}" + "".join(f"{word:>8}" for word in WORDS))
    good = [_show(d.name, outcomes[d.name], everything=everything) for d in distortions]
    total = _show("all", found.outcomes, everything=False, cases=False)
    for alarm in found.alarms:
        print(f"ALARM {alarm}")
    print(f"{len(found.alarms)} alarms on {found.originals} originals")
    return all(good) and total and not found.alarms


def _show(name: str, outcomes: list[Outcome], *, everything: bool, cases: bool = True) -> bool:
    words = Counter(outcome.word for outcome in outcomes)
    share = recall(words)
    said = "-" if share is None else f"{share:.1%}"
    print(f"{name:42.41}{said:>8}" + "".join(f"{words[word] or '-':>8}" for word in WORDS))
    listed = [o for o in outcomes if cases and (everything or o.word in _BAD)]
    for outcome in listed if everything else listed[:_SHOWN]:
        print(f"    {outcome.word}: {outcome.case}, {outcome.where}")
        if outcome.text:
            print(f"        {outcome.text}")
    good = share is None or share >= REQUIRED_RECALL
    return good and not words["passed"] and not words["alarm"]


def recall(words: Counter[str]) -> float | None:
    """Return the share with the right code and the right words, None where nothing had to be found."""
    due = words["found"] + words["words"] + words["missed"]
    return words["found"] / due if due else None
