"""`make bench`: speed and memory, all from one run on one machine, against the required figures.

Speeds are compared with a bare pymavlink loop over the same log, so that they mean the same on any
machine; what is quoted should name the machine and the day all the same.
"""

from __future__ import annotations

import compileall
import gc
import multiprocessing
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import numpy as np
from click.testing import CliRunner
from pymavlink import mavutil
from rich.console import Console
from rich.table import Table

import mavframecheck
from benchmarks.corpus import FINDINGS_OR_NONE, arguments
from mavframecheck.cli.group import COLLECT_AFTER
from mavframecheck.sources import open_recording
from mavframecheck.wire import load_dialect, read_batches

MB = 1_000_000
SAMPLE = Path(__file__).parents[1] / "samples" / "clean_copter.tlog"
STAMP_BYTES = 8
ROUNDS = 5
PEAK_OF_CHILD = """
import resource, subprocess, sys
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL)
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
print(done.returncode, peak * (1 if sys.platform == "darwin" else 1024))
"""
"""In a process of its own: a child's peak begins at its parent's size, and this one is large."""


class Figure(NamedTuple):
    """A line of the result."""

    what: str
    measured: str
    required: str = ""
    met: bool = True


# The logs


def base_recording(corpus: Path) -> Path:
    """Return the largest real log, or a sample where there is none."""
    logs = (corpus / "real" / "tlog").glob("*.tlog")
    return max(logs, key=lambda path: path.stat().st_size, default=SAMPLE)


def records(path: Path) -> tuple[bytes, np.ndarray]:
    """Return the bytes of a log up to its last good frame, and where each good record begins."""
    with open_recording(path) as recording:
        batches = read_batches(recording.chunks(), load_dialect(), stamped=recording.stamped)
        frames = [batch.frames for batch in batches]
    starts = np.concatenate([part.offset[part.good] for part in frames]) - STAMP_BYTES
    last = [part for part in frames if len(part)][-1]
    return path.read_bytes()[: int(last.offset[-1] + last.size[-1])], starts


def write_repeated(base: Path, target: Path, size: int) -> None:
    """Write `base` over and over until `size` bytes, every copy stamped after the one before."""
    content, starts = records(base)
    octets = np.frombuffer(content, np.uint8).copy()
    where = starts[:, None] + np.arange(STAMP_BYTES)
    stamps = octets[where].view(">u8").ravel().astype(np.uint64)
    span = np.uint64(np.percentile(stamps, 99) - np.percentile(stamps, 1)) + np.uint64(MB)
    with target.open("wb") as file:
        for copy in range(-(-size // len(octets))):
            shifted = (stamps + np.uint64(copy) * span).astype(">u8")
            octets[where] = shifted[:, None].view(np.uint8)
            file.write(octets.tobytes())


def write_start(base: Path, target: Path, size: int) -> None:
    """Write the first `size` bytes of a log made of `base`, cut between records."""
    write_repeated(base, target, size)
    _, starts = records(target)
    target.write_bytes(target.read_bytes()[: int(starts[starts <= size][-1])])


# What is measured


def read_with_pymavlink(path: Path) -> int:
    """Return the messages that a bare `recv_match` loop reads."""
    link = mavutil.mavlink_connection(str(path))
    count = 0
    while (message := link.recv_match()) is not None:
        count += message.get_type() != "BAD_DATA"
    return count


def read_columns(path: Path) -> int:
    """Return the messages read into columns, checksums checked and every table decoded."""
    with open_recording(path) as recording:
        batches = read_batches(recording.chunks(), load_dialect(), stamped=recording.stamped)
        return sum(len(table) for batch in batches for table in batch.tables.values())


def check_with_every_rule(path: Path) -> None:
    """Run a complete `check` in this process, report included."""
    from mavframecheck.cli import main

    gc.set_threshold(COLLECT_AFTER)  # as the command does in a process of its own
    asked = ["check", str(path), "--preview", "--format", "json"]
    result = CliRunner().invoke(main, asked, catch_exceptions=False)
    if result.exit_code not in FINDINGS_OR_NONE:
        raise RuntimeError(f"check ended with {result.exit_code}: {result.output[-500:]}")


def seconds(work: Callable[[], object]) -> float:
    """Return how long `work` takes, s."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def command(path: Path) -> list[str]:
    """Return the command that checks a log in a process of its own."""
    return [sys.executable, "-m", "mavframecheck", "check", str(path)]


def run_check(path: Path) -> None:
    """Run `check` from process start to end."""
    done = subprocess.run(command(path), stdout=subprocess.DEVNULL, check=False)
    if done.returncode not in FINDINGS_OR_NONE:
        raise RuntimeError(f"check ended with {done.returncode}")


def peak_bytes(path: Path) -> int:
    """Return the peak memory of a `check`, bytes."""
    launch = [sys.executable, "-c", PEAK_OF_CHILD, *command(path)]
    done = subprocess.run(launch, capture_output=True, text=True, check=True)
    code, peak = map(int, done.stdout.split())
    if code not in FINDINGS_OR_NONE:
        raise RuntimeError(f"check ended with {code}: {done.stderr[-500:]}")
    return peak


# The figures


class Work(NamedTuple):
    """Something to do with a log, for its speed."""

    what: str
    run: Callable[[Path], object]
    times: int
    """How often in a round."""
    required: int = 0
    """So many times as fast as the first one it must be."""


WORKS = (
    Work("(a) bare pymavlink recv_match loop", read_with_pymavlink, 1),
    Work("(b) read + checksum + all columns", read_columns, 5, 40),
    Work("(c) check with every rule", check_with_every_rule, 5, 20),
)


def took(work: Work, path: Path) -> float:
    """Return how long a work takes, s: the median of its times in a round."""
    return statistics.median(seconds(lambda: work.run(path)) for _ in range(work.times))


def speeds(path: Path) -> list[Figure]:
    """Return (a), (b) and (c) on one log, long enough that starting up does not count.

    Each in a process of its own, so that none is slowed by what another one left in memory, and in turns,
    so that a machine that others slow down for a while does so to all of them: what counts is the median
    of the rounds.
    """
    count = read_columns(path)  # also warms the disk's cache for all of them
    context = multiprocessing.get_context("spawn")
    with ExitStack() as opened:
        pools = [opened.enter_context(context.Pool(1)) for _ in WORKS]
        rounds = [
            [pool.apply(took, (work, path)) for pool, work in zip(pools, WORKS, strict=True)]
            for _ in range(ROUNDS)
        ]
    return list(_compared(count, np.array(rounds)))


def _compared(count: int, rounds: np.ndarray) -> Iterator[Figure]:
    """Yield a line for each work, from (rounds, works) s."""
    rates, times = np.median(count / rounds, axis=0), np.median(rounds[:, :1] / rounds, axis=0)
    for work, rate, faster in zip(WORKS, rates.tolist(), times.tolist(), strict=True):
        said = f"{rate:12,.0f} messages/s"
        if not work.required:
            yield Figure(work.what, said)
            continue
        said, required = f"{said} = {faster:.1f} x (a)", f">= {work.required} x (a)"
        yield Figure(work.what, said, required, faster >= work.required)


def start_to_end(path: Path, times: int = 15) -> Figure:
    """Return (d): a whole process on a small log."""
    compileall.compile_dir(Path(mavframecheck.__file__).parent, quiet=1)  # as `pip install` does
    took = statistics.median(seconds(lambda: run_check(path)) for _ in range(times))
    what = f"(d) check of {path.stat().st_size / MB:.1f} MB, process start to end"
    return Figure(what, f"{took:12.2f} s (median of {times})", "<= 0.5 s", took <= 0.5)


def memory(small: Path, large: Path) -> list[Figure]:
    """Return the peak memory on a short and on a long log."""
    figures = []
    for path in (small, large):
        peak = peak_bytes(path) / MB
        what = f"peak memory of check, {path.stat().st_size / MB:,.0f} MB"
        figures.append(Figure(what, f"{peak:12.0f} MB", "<= 250 MB", peak <= 250))
    return figures


def show(figures: list[Figure], base: Path) -> None:
    """Print the result as a table."""
    table = Table("figure", "measured", "required", "", title=f"on {base.stem}")
    for figure in figures:
        verdict = ("met" if figure.met else "MISSED") if figure.required else ""
        table.add_row(figure.what, figure.measured, figure.required, verdict)
    Console(width=110).print(table)


def main() -> int:
    """Measure everything; 1 when a required figure is missed."""
    parser = arguments(__doc__ or "")
    parser.add_argument("--quick", action="store_true", help="without the log of 1 GB")
    options = parser.parse_args()
    base = base_recording(options.corpus)
    with tempfile.TemporaryDirectory() as folder:
        names = ("small", "short", "long", "huge")
        small, short, long, huge = (Path(folder, f"{name}.tlog") for name in names)
        write_start(base, small, MB)
        write_repeated(base, short, 10 * MB)
        write_repeated(base, long, 50 * MB)
        figures = [*speeds(long), start_to_end(small)]
        if not options.quick:
            write_repeated(base, huge, 1024 * MB)
            figures += memory(short, huge)
    show(figures, base)
    return int(not all(figure.met for figure in figures))


if __name__ == "__main__":
    sys.exit(main())
