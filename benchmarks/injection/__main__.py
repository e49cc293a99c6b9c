"""`make injection`: mistakes written into the bytes of clean recordings, and which of them the rules find.

`benchmarks/expected.toml` says what is written where, which codes answer it, and where the method can decide.
Recordings are also flown elsewhere: near sea level, at 500 m and at 2 000 m, in all hemispheres. Every recording
is judged first as it is, with clean streams added: an error or warning there is a false alarm.

The second part, `--only motion`, distorts whole streams of poses and velocities. Half of the recordings are for
tuning the judge (`--tuning` shows them); the figures are those of the others.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import repeat
from pathlib import Path
from typing import TypeVar

from benchmarks.corpus import arguments, is_absent
from benchmarks.injection.files import judge_files
from benchmarks.injection.judge import FAMILIES, Outcome, Verdicts, judge_variant, known_rules
from benchmarks.injection.motion import Motions, is_reported, judge_recording, recordings
from benchmarks.injection.motion_table import show_motion
from benchmarks.injection.plan import FileMistake, Mistake, Plan, read_plan

Some = TypeVar("Some", Mistake, FileMistake)

REQUIRED_RECALL = 0.99
"""Of the cases of each mistake in which the method can decide."""


def options() -> argparse.Namespace:
    """Return the command line."""
    parser = arguments(__doc__ or "")
    parser.add_argument(
        "--only",
        nargs="*",
        default=[],
        help="codes, or beginnings of codes; motion: the second part",
    )
    parser.add_argument("--tuning", action="store_true", help="motion: the recordings for tuning")
    parser.add_argument("--full", action="store_true", help="motion: every case (an hour and more)")
    parser.add_argument("--recording", nargs="*", default=[], help="beginnings of names")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    parser.add_argument("--files", action="store_true", help="mission files alone")
    parser.add_argument("--all", action="store_true", help="print every case")
    return parser.parse_args()


def chosen(mistakes: Iterable[Some], only: list[str]) -> list[Some]:
    """Return the mistakes that a code on the command line answers, all without one."""
    starts = tuple(only) or ("",)
    return [m for m in mistakes if any(code.startswith(starts) for code in m.codes)]


def variants(plan: Plan, names: list[str]) -> Iterator[tuple[str, str]]:
    """Yield (recording, place): an empty place is the one where it was made."""
    for source in plan.recording:
        if source.name.startswith(tuple(names) or ""):
            yield from ((source.name, place) for place in (("",) * source.here + source.places))


def show_mistake(
    mistake: Mistake | FileMistake, outcomes: list[Outcome], *, everything: bool
) -> None:
    """Print how one mistake fared, and where it was missed or wrongly found."""
    words = counted(outcomes)
    rows = sum(outcome.rows for outcome in outcomes if outcome.word == "found")
    hits = sum(min(outcome.hits, outcome.rows) for outcome in outcomes if outcome.word == "found")
    share = f"{hits / rows:6.0%}" if rows else "     -"
    counts = "".join(f"{words[word]:>9}" for word in ("found", "missed", "silent", "wrong"))
    print(f"{'/'.join(code[3:] for code in mistake.codes):16}{mistake.name:58.57}{counts}{share}")
    for outcome in outcomes:
        if everything or outcome.word in ("missed", "wrong"):
            print(f"    {outcome.word}: {outcome.variant}, {outcome.hits}/{outcome.rows} rows")
            if outcome.text:
                print(f"      {outcome.text}")


def show(
    plan: Plan, mistakes: Sequence[Mistake | FileMistake], verdicts: Verdicts, *, everything: bool
) -> bool:
    """Print the table and the totals; return whether all is as it must be."""
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in verdicts.outcomes:
        outcomes[outcome.mistake].append(outcome)
    print(f"{'codes':16}{'mistake':58}    found   missed   silent    wrong  rows")
    for mistake in sorted(mistakes, key=lambda m: m.codes):
        show_mistake(mistake, outcomes[mistake.name], everything=everything)
    totals = counted(verdicts.outcomes)
    decided = totals["found"] + totals["missed"]
    print(
        f"\n{len(verdicts.outcomes)} cases: {decided} decided, {totals['found']} found, recall "
        f"{recall(totals):.2%}; {totals['silent']} silent where nothing decides, {totals['wrong']} not"
    )
    for alarm in verdicts.alarms:
        print(f"ALARM {alarm}")
    print(f"{len(verdicts.alarms)} alarms on {verdicts.originals} originals")
    show_gaps(plan, mistakes, outcomes)
    each = [recall(counted(some)) for some in outcomes.values()]
    return min(each, default=1.0) >= REQUIRED_RECALL and not verdicts.alarms and not totals["wrong"]


def counted(outcomes: list[Outcome]) -> Counter[str]:
    """Return how many outcomes have each word."""
    words: Counter[str] = Counter()
    words.update(outcome.word for outcome in outcomes)
    return words


def recall(words: Counter[str]) -> float:
    """Return the share found of what can be decided, 1 where nothing can."""
    decided = words["found"] + words["missed"]
    return words["found"] / decided if decided else 1.0


def show_gaps(
    plan: Plan, mistakes: Sequence[Mistake | FileMistake], outcomes: dict[str, list[Outcome]]
) -> None:
    """Print what was not measured: rules to come, rules without a mistake, mistakes without a case."""
    built = {rule.code for rule, _ in known_rules()}
    every: list[Mistake | FileMistake] = [*plan.mistake, *plan.file_mistake]
    answered = {code for mistake in every for code in mistake.codes}
    bare = {c for c in built - answered if c.startswith(FAMILIES)} - set(plan.unmeasured)
    print(f"No rule yet: {' '.join(sorted(answered - built)) or 'none'}")
    print(f"Rules without a mistake here: {' '.join(sorted(bare)) or 'none'}")
    empty = [m.name for m in mistakes if not outcomes[m.name] and set(m.codes) & built]
    print(f"Mistakes without a case: {'; '.join(empty) or 'none'}")


def measure_files(plan: Plan, asked: argparse.Namespace) -> bool:
    """Write every mistake into mission files; return whether all is as it must be."""
    mistakes = chosen(plan.file_mistake, asked.only)
    return show(plan, mistakes, judge_files(plan, mistakes), everything=asked.all)


def measure_mistakes(plan: Plan, folder: Path, asked: argparse.Namespace) -> bool:
    """Run every mistake on every variant; return whether all is as it must be."""
    mistakes = chosen(plan.mistake, asked.only)
    codes = tuple(asked.only) or FAMILIES
    jobs = list(variants(plan, asked.recording))
    verdicts = Verdicts()
    with ProcessPoolExecutor(asked.jobs) as pool:
        for one in pool.map(judge_variant, repeat(folder), jobs, repeat(mistakes), repeat(codes)):
            verdicts.add(one)
    return show(plan, mistakes, verdicts, everything=asked.all)


def measure_motion(plan: Plan, folder: Path, asked: argparse.Namespace) -> bool:
    """Distort the streams of one half of the recordings; return whether all is as it must be."""
    names = recordings(folder, tuple(asked.recording) or ("",))
    names = [name for name in names if is_reported(name) != asked.tuning]
    distortions = list(plan.motion.distortion)
    found = Motions()
    with ProcessPoolExecutor(asked.jobs) as pool:
        for one in pool.map(partial(judge_recording, folder, full=asked.full), names):
            found.add(one)
    half = "for tuning" if asked.tuning else "that were not used for tuning"
    print(f"\nMotion: {len(names)} recordings {half}")
    return show_motion(distortions, found, everything=asked.all)


def main() -> int:
    """Run what was asked for; 1 when a recall is short, or where there should be silence."""
    asked = options()
    folder: Path = asked.corpus / "sitl"
    plan = read_plan()
    good = True
    if asked.only != ["motion"]:
        good = measure_files(plan, asked)
    if asked.files or is_absent(folder):
        return int(not good)
    if asked.only != ["motion"]:
        good &= measure_mistakes(plan, folder, asked)
    if asked.only in ([], ["motion"]):
        good &= measure_motion(plan, folder, asked)
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
