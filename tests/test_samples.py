"""The samples are what their script writes, and `check` says of each what its README says."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from samples.make import HERE, SAMPLES, Sample, readme

by_name = pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: sample.name)


@by_name
def test_sample_is_what_the_script_writes(sample: Sample) -> None:
    """A sample that differs from its script shows something else than the script says."""
    assert (HERE / sample.name).read_bytes() == sample.content()


def test_readme_lists_every_sample() -> None:
    """The page beside the samples is generated with them, and no sample is left over."""
    made = {".tlog", ".raw", ".pcap", ".plan", ".waypoints"}
    recordings = {path.name for path in HERE.iterdir() if path.suffix in made}

    assert (HERE / "README.md").read_text(encoding="utf-8") == readme()
    assert recordings == {sample.name for sample in SAMPLES}


@pytest.fixture(scope="module")
def codes_found() -> dict[str, set[str]]:
    """Return the codes that one run of `check` over the directory finds, by file name."""
    command = [sys.executable, "-m", "mavframecheck", "check", str(HERE), "--format", "json"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 1, run.stderr
    found: dict[str, set[str]] = {sample.name: set() for sample in SAMPLES}
    for finding in json.loads(run.stdout)["findings"]:
        found[Path(finding["file"]).name].add(finding["code"])
    return found


@by_name
def test_check_finds_the_fault_and_nothing_else(
    sample: Sample, codes_found: dict[str, set[str]]
) -> None:
    """Each sample shows its own codes; a clean one shows none, not even for information."""
    assert codes_found[sample.name] == set(sample.codes)
