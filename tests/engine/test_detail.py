"""What reports draw: gathered in the pass that judges, the same wherever batches are cut."""

from __future__ import annotations

import functools
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavframecheck.engine import Settings
from mavframecheck.engine.check import check_file, draw_file, draw_recording
from mavframecheck.model import ByteLocation
from mavframecheck.model.trace import Detail, Trace, key_of
from mavframecheck.sources import Kind
from samples.make import HERE
from tests.engine.judged import CutRecording, pack_of, rule, shipped
from tests.engine.test_cuts import traffic
from tests.strategies import DIALECT, cut, frame

SAMPLES = sorted(HERE.glob("*.tlog"))
TLOG_START_US = 1_772_445_600_000_000


def drawn(data: bytes, cuts: tuple[int, ...] = ()) -> Detail:
    """Return what is drawn of bytes that arrive in pieces."""
    recording = CutRecording(data, cut(data, cuts), Kind.TLOG)
    return draw_recording(recording, shipped(), Settings(preview=True), DIALECT)[2]


@functools.cache
def whole(sample: Path) -> str:
    """Return what is drawn of a sample, as text: NaN is equal to itself there."""
    return repr(drawn(sample.read_bytes()))


@pytest.mark.parametrize("sample", SAMPLES[::6], ids=lambda path: path.name)
@settings(max_examples=3, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(cuts=st.lists(st.integers(0, 100_000), min_size=1, max_size=6))
def test_samples_are_drawn_the_same(sample: Path, cuts: list[int]) -> None:
    assert repr(drawn(sample.read_bytes(), tuple(cuts))) == whole(sample)


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=traffic(), cuts=st.lists(st.integers(0, 3000), min_size=1, max_size=12))
def test_any_traffic_is_drawn_the_same(data: bytes, cuts: list[int]) -> None:
    """Roles that change, clocks that leap, context that comes late."""
    assert repr(drawn(data, tuple(cuts))) == repr(drawn(data))


@pytest.mark.parametrize("sample", SAMPLES[::4], ids=lambda path: path.name)
def test_drawing_changes_no_finding(sample: Path) -> None:
    plain = check_file(str(sample), shipped(), Settings())
    report, findings, detail = draw_file(str(sample), shipped(), Settings())
    assert (report, findings) == plain
    assert detail is not None
    assert set(detail.proofs) == {key_of(finding) for finding in findings}


def trace(traces: tuple[Trace, ...], label: str) -> Trace:
    """Return the trace with a label."""
    return next(each for each in traces if each.label == label)


def test_a_flight_as_its_sample_was_made() -> None:
    """Bands, heights under each reference, track, targets and home of a sample whose making is known."""
    sample = str(HERE / "degrees_in_scaled_field.tlog")
    _, (finding,), detail = draw_file(sample, shipped(), Settings())
    assert detail is not None
    flight = detail.flight
    assert {band.label for band in flight.bands} == {"armed", "disarmed", "GUIDED", "LAND"}
    by_role = {each.role: max(each.y) for each in flight.heights}
    assert by_role["home"] == 12.0
    assert by_role["origin"] == 12.0
    assert by_role["ellipsoid"] - by_role["msl"] == pytest.approx(47.6, abs=0.2)
    assert trace(flight.tracks, "1/1 GLOBAL_POSITION_INT").role == "vehicle"
    assert min(trace(flight.tracks, "1/191 SET_POSITION_TARGET_GLOBAL_INT").y) == 47e-7
    assert {point.kind for point in flight.points} == {"home", "origin", "launch"}
    (proof,) = detail.proofs.values()
    assert [figure.kind for figure in proof.figures] == ["plan"]
    assert proof.frame is not None
    location = finding.location
    data = Path(sample).read_bytes()
    assert isinstance(location, ByteLocation)
    assert proof.frame.data == data[location.offset : location.offset + location.length]
    values = {value.name: (value.raw, value.says) for value in proof.frame.values}
    assert values["lat_int"] == ("47", "4.7e-06 deg")
    assert "GLOBAL_RELATIVE_ALT" in values["coordinate_frame"][1]


def test_a_rule_draws_what_it_judged() -> None:
    """Each stream its own lines; what the rule does not judge is not drawn."""
    drawing = rule(
        proof=[{"title": "roll", "unit": "rad", "lines": {"said": "raw(roll)", "most": "1"}}]
    )
    records = []
    for k in range(40):
        for sender in ((1, 1), (2, 1)):
            one = frame("ATTITUDE", {"roll": 0.1 * k + sender[0] * 10}, sender, k)
            records.append((TLOG_START_US + k * 100_000).to_bytes(8, "big") + one)
    recording = CutRecording(b"".join(records), [b"".join(records)], Kind.TLOG)
    _, findings, detail = draw_recording(recording, pack_of(drawing), Settings(), DIALECT)
    assert [finding.sysid for finding in findings] == [1, 2]
    for finding in findings:
        said, most = detail.proofs[key_of(finding)].figures[0].traces
        assert max(said.y) == pytest.approx(3.9 + 10 * (finding.sysid or 0), abs=1e-5)
        assert set(most.y) == {1.0}
        assert len(said.t) == 40


def test_a_plain_check_knows_nothing_of_drawing() -> None:
    """Start-up and memory of `check` are those of judging alone."""
    code = (
        "import sys; from mavframecheck.cli import main\n"
        f"try: main(['check', {str(SAMPLES[0])!r}])\n"
        "except SystemExit: pass\n"
        "drawing = ('model.trace', 'engine.detail', 'vehicle.flight', 'vehicle.thinning', 'report.html')\n"
        "found = {f'mavframecheck.{each}' for each in drawing} & set(sys.modules)\n"
        "sys.exit(' '.join(found | {'jinja2'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "\n")
