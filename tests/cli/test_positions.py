"""`inspect --positions` on the command line: formats, conversions, refusals, exit codes."""

from __future__ import annotations

import csv
import functools
import io
import json
import operator
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from click.testing import CliRunner, Result

from mavframecheck.cli import main
from mavframecheck.positions import AltRef, LocalPosition, Origin, Target, read
from mavframecheck.report.positions import COLUMNS
from samples.make import HERE

SAMPLE = str(HERE / "clean_odometry.tlog")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["inspect", *arguments], catch_exceptions=False)


def as_csv(*arguments: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(run("--positions", SAMPLE, *arguments).stdout)))


def as_jsonl(*arguments: str) -> list[dict[str, Any]]:
    result = run("--positions", "--format", "jsonl", SAMPLE, *arguments)
    assert result.exit_code == 0
    return [json.loads(line) for line in result.stdout.splitlines()]


def text(value: Any) -> str:
    """Return a value as CSV has it."""
    if isinstance(value, list):
        return " ".join(text(each) or "nan" for each in value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)


def test_every_format_tells_the_same(tmp_path: Path) -> None:
    records = as_jsonl()
    path = tmp_path / "positions.parquet"
    written = run("--positions", "--format", "parquet", SAMPLE, "--output", str(path))

    assert written.exit_code == 0
    assert pyarrow.parquet.read_table(path).to_pylist() == records
    assert [list(row.values()) for row in as_csv()] == [
        [text(value) for value in record.values()] for record in records
    ]
    assert list(records[0]) == list(COLUMNS)


def test_the_record_of_the_article() -> None:
    """Representation, datum, height and its reference, point, time and clock, covariance, source."""
    records = as_jsonl("--message", "GPS_RAW_INT", "--message", "ODOMETRY")
    fix = next(r for r in records if r["source"] == "1/1 GPS_RAW_INT")
    given = {name: value for name, value in fix.items() if value not in (None, [])}
    assert given == given | {
        "representation": "geodetic",
        "datum": "WGS84",
        "height_reference": "msl",
        "point_of_reference": "antenna",
        "clock": "boot",
        "horizontal_accuracy_m": 0.4,
        "valid": True,
    }
    assert {"latitude_deg", "longitude_deg", "height_m", "timestamp_ns", "time_utc_ns"} <= set(
        given
    )
    pose = next(r for r in records if r["source"] == "1/191 ODOMETRY")
    assert (pose["representation"], pose["frame"], pose["axes"]) == (
        "cartesian",
        "local_frd",
        "FRD",
    )
    assert pose["covariance_frame"] == "own"
    assert pose["covariance_m2"] == pytest.approx([0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01])


@pytest.mark.parametrize(
    ("options", "filled"),
    [
        (("--as", "ecef"), {"x_m", "y_m", "z_m", "datum"}),
        (("--as", "ned"), {"x_m", "y_m", "z_m", "frame", "origin_id"}),
        (("--as", "enu", "--origin", "47.4,8.5,450,msl"), {"x_m", "y_m", "z_m", "origin_id"}),
        (("--as", "utm"), {"easting_m", "northing_m", "zone", "hemisphere", "height_reference"}),
        (("--as", "utm", "--zone", "32n"), {"easting_m", "northing_m", "zone"}),
        (("--as", "geodetic", "--height", "msl"), {"latitude_deg", "longitude_deg", "height_m"}),
    ],
)
def test_all_records_in_one_representation(options: tuple[str, ...], filled: set[str]) -> None:
    records = [r for r in as_jsonl(*options) if r["valid"]]
    assert len({(r["representation"], r["axes"], r["zone"]) for r in records}) == 1
    assert len(records) > 200
    for name in filled:
        assert all(r[name] is not None for r in records)
    for r in as_jsonl(*options):
        assert r["valid"] == (r["problem"] is None)


def test_the_library_gives_what_the_command_writes() -> None:
    origin = Origin("given", 47.4, 8.5, 450.0, AltRef.MSL)
    found = [
        extract.position.xyz.round(4).tolist()
        for extract in read(SAMPLE, ["LOCAL_POSITION_NED"], Target("enu", origin=origin))
        if isinstance(extract.position, LocalPosition)
    ]
    written = as_jsonl(
        "--message", "LOCAL_POSITION_NED", "--as", "enu", "--origin", "47.4,8.5,450,msl"
    )
    assert functools.reduce(operator.iadd, found, []) == [
        [r["x_m"], r["y_m"], r["z_m"]] for r in written
    ]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--as", "ned"), "go with --positions"),
        (
            ("--positions", "--clocks"),
            "choose one of --positions, --origins, --clocks, --sender, --missions, --contract",
        ),
        (("--format", "csv"), "--format csv goes with --positions"),
        (("--positions", "--format", "text"), "positions are written as csv, jsonl, parquet"),
        (("--positions", "--origin", "1,2,3,msl"), "--origin is for --as ned and --as enu"),
        (("--positions", "--as", "ned", "--origin", "1,2,3"), "LAT,LON,HEIGHT,REF, for example"),
        (("--positions", "--as", "ned", "--origin", "91,2,3,msl"), "is no place on the Earth"),
        (("--positions", "--as", "ned", "--origin", "nan,2,3,msl"), "is no place on the Earth"),
        (("--positions", "--zone", "34N"), "--zone is for --as utm"),
        (("--positions", "--as", "utm", "--zone", "61N"), "is not a zone 1 to 60 with N or S"),
        (("--positions", "--as", "ecef", "--height", "msl"), "--as ecef has no heights"),
    ],
)
def test_what_does_not_go_together(options: tuple[str, ...], words: str) -> None:
    result = run(SAMPLE, *options)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.replace("│", " ").split())


def test_exit_codes(tmp_path: Path) -> None:
    (tmp_path / "nothing.tlog").write_bytes(b"")
    assert run("--positions", str(tmp_path / "nothing.tlog")).exit_code == 3
    assert run("--positions", str(tmp_path / "missing.tlog")).exit_code == 2
    assert run("--positions", SAMPLE, "--output", str(tmp_path / "no" / "x.csv")).exit_code == 2


@pytest.mark.parametrize(
    ("package", "options"),
    [("pyarrow", ("--format", "parquet", "--output", "x.parquet")), ("pyproj", ("--as", "utm"))],
)
def test_without_an_extra(package: str, options: tuple[str, ...], tmp_path: Path) -> None:
    """Who lacks a package is told how to get it; what needs none works without."""
    program = (
        f"import sys; sys.modules[{package!r}] = None\n"
        "from mavframecheck.cli import main\n"
        "main(['inspect', '--positions', *sys.argv[1:]])"
    )

    def call(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", program, SAMPLE, *arguments]
        return subprocess.run(command, check=False, capture_output=True, text=True, cwd=tmp_path)

    refused = call(*options)
    assert refused.returncode == 2
    assert "pip install 'mavframecheck[" in refused.stderr.replace("\n", " ")
    assert call().returncode == 0
