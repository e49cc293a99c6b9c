"""Checks of the byte stream: quiet on a good recording, loud on a bad one, calm without data, one finding."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from pathlib import Path

import pytest

from mavframecheck.engine import Pack
from mavframecheck.model import Evidence, Finding, RuleRun, Severity
from mavframecheck.sources import Kind
from samples.make import HERE
from tests.engine.judged import judge, run_of, shipped
from tests.strategies import START_US, attitude, broken, frame, record, unknown

CODES = ("MFC001", "MFC002", "MFC003", "MFC004", "MFC005")
PACK = Pack(
    tuple(shipped().by_code[code] for code in CODES),
    {code: f"{code}.toml" for code in CODES},
)
CLEAN = ["clean_copter.tlog", "clean_px4.tlog", "clean_odometry.tlog", "clean_link.raw"]


def found(data: bytes, code: str, *, kind: Kind = Kind.TLOG) -> Finding | None:
    """Return the finding of one rule, None for none; there must never be two of one subject."""
    findings = [f for f in judge(data, pack=PACK, kind=kind)[1] if f.code == code]
    assert len({f.subject for f in findings}) == len(findings)
    return findings[0] if findings else None


def certain(data: bytes, code: str) -> Finding:
    """Return the one finding of a rule."""
    (finding,) = (f for f in judge(data, pack=PACK)[1] if f.code == code)
    return finding


def verdict(data: bytes, code: str) -> RuleRun:
    """Return how a rule ended."""
    return run_of(judge(data, pack=PACK), code)


def records(frames: Iterable[bytes]) -> bytes:
    """Return frames as a recording, 0.1 s apart."""
    return b"".join(record(one, k) for k, one in enumerate(frames))


def steady(count: int) -> list[bytes]:
    """Return frames of one sender whose counter steps by one."""
    return [attitude(k % 256) for k in range(count)]


@pytest.mark.parametrize("name", CLEAN)
@pytest.mark.parametrize("code", CODES)
def test_quiet_on_a_good_recording(name: str, code: str) -> None:
    kind = Kind.RAW if name.endswith("raw") else Kind.TLOG
    data = (HERE / name).read_bytes()
    assert found(data, code, kind=kind) is None
    run = run_of(judge(data, pack=PACK, kind=kind), code)
    assert (run.status, run.checked > 100) == ("ran", True)


@pytest.mark.parametrize("code", CODES)
def test_calm_without_data(code: str) -> None:
    """A recording without a frame is no pass."""
    assert found(b"", code) is None
    assert verdict(b"", code).status == "not-applicable"


class TestChecksums:
    """MFC001: 10 frames, of which some fail."""

    def test_counts(self) -> None:
        """Two of ten known frames fail."""
        frames = steady(10)
        frames[3], frames[6] = broken(frames[3]), broken(frames[6])
        finding = certain(records(frames), "MFC001")
        assert finding.count == 2
        assert "20.00%" in finding.text
        assert "ATTITUDE" in finding.text
        assert "never" not in finding.text
        assert (finding.severity, finding.sysid) == (Severity.WARNING, None)
        assert finding.time_first == pytest.approx(START_US * 1e-6 + 0.3)
        assert finding.time_last == pytest.approx(START_US * 1e-6 + 0.6)
        assert finding.location is not None
        assert finding.location.offset == len(records(frames[:3])) + 8  # type: ignore[union-attr]
        assert verdict(records(frames), "MFC001").checked == 10

    @pytest.mark.parametrize(("failures", "hint"), [(4, False), (5, True)])
    def test_a_message_that_never_holds(self, failures: int, hint: bool) -> None:
        """Five failures and no success point to another definition of the message."""
        bad = [broken(frame("HEARTBEAT", {"type": k}, seq=k)) for k in range(failures)]
        frames = [one for pair in zip(bad, steady(failures)) for one in pair]
        finding = certain(records([*frames, attitude(9)]), "MFC001")
        assert ("HEARTBEAT never has a good checksum" in finding.text) is hint

    def test_one_success_before_is_enough(self) -> None:
        """However far before the first failure."""
        good = frame("HEARTBEAT", {"type": 2})
        bad = [broken(frame("HEARTBEAT", {"type": k}, seq=k)) for k in range(6)]
        data = records([good, *steady(300), *bad, attitude(1)])
        for cuts in ([], [100], [len(data) - 300]):
            (finding,) = (f for f in judge(data, cuts, PACK)[1] if f.code == "MFC001")
            assert "never" not in finding.text


class TestStrayBytes:
    """MFC002: bytes between frames."""

    def test_counts(self) -> None:
        """Two ranges of 10 and 7 bytes."""
        good = [record(one, k) for k, one in enumerate(steady(6))]
        data = b"".join([*good[:2], b"0123456789", *good[2:4], b"abcdefg", *good[4:]])
        finding = certain(data, "MFC002")
        assert finding.count == 2
        assert finding.text.startswith("17 bytes in 2 places")
        assert finding.severity is Severity.WARNING
        assert finding.location is not None
        assert (finding.location.offset, finding.location.length) == (len(b"".join(good[:2])), 10)  # type: ignore[union-attr]
        assert finding.time_first == pytest.approx(START_US * 1e-6 + 0.1)
        assert finding.time_last == pytest.approx(START_US * 1e-6 + 0.3)

    @pytest.mark.parametrize("cut", [1, 5, 20, 40])
    def test_a_torn_tail_alone_is_only_mentioned(self, cut: int) -> None:
        """What a recorder leaves that was switched off."""
        assert certain(records(steady(5))[:-cut], "MFC002").severity is Severity.INFO

    def test_a_torn_tail_and_more(self) -> None:
        data = b"rubbish" + records(steady(5))[:-4]
        assert certain(data, "MFC002").severity is Severity.WARNING

    def test_rubbish_behind_the_last_frame_is_no_torn_tail(self) -> None:
        assert certain(records(steady(5)) + b"x" * 50, "MFC002").severity is Severity.WARNING

    def test_nothing_but_rubbish(self) -> None:
        finding = certain(b"no frame at all in these bytes", "MFC002")
        assert (finding.count, finding.time_first) == (1, None)


class TestLostFrames:
    """MFC003: gaps in the sequence counter."""

    def test_counts(self) -> None:
        """The counter runs 0..99; 20 of them are missing in two holes."""
        frames = steady(100)
        data = records([*frames[:10], *frames[22:50], *frames[58:]])
        finding = certain(data, "MFC003")
        assert finding.evidence["share"] == "0.2000"
        assert finding.text.startswith("20 frames of this sender are missing (20.0%); 80 were")
        assert (finding.subject, finding.count) == ("1/1", 2)
        assert finding.severity is Severity.INFO

    @pytest.mark.parametrize(("lost", "speaks"), [(9, False), (10, True)])
    def test_how_many(self, lost: int, speaks: bool) -> None:
        frames = steady(200)
        data = records([*frames[:50], *frames[50 + lost :]])
        assert (found(data, "MFC003") is not None) is speaks

    def test_a_small_share(self) -> None:
        """Ten of 1 500 are less than one in a hundred."""
        frames = steady(1500)
        assert found(records([*frames[:50], *frames[60:]]), "MFC003") is None

    def test_the_counter_wraps(self) -> None:
        assert found(records(steady(600)), "MFC003") is None

    def test_senders_have_counters_of_their_own(self) -> None:
        one = [frame("HEARTBEAT", {}, (1, 1), k) for k in range(60)]
        two = [frame("HEARTBEAT", {}, (1, 2), 100 + k) for k in range(60)]
        both = [f for pair in zip(one, two) for f in pair]
        assert found(records(both), "MFC003") is None
        findings = [
            f.subject
            for f in judge(
                records([f for pair in zip(one, two[:20] + two[40:]) for f in pair]), pack=PACK
            )[1]
            if f.code == "MFC003"
        ]
        assert findings == ["1/2"]

    def test_several_counters_in_one_stream(self) -> None:
        """Two links merged: nothing can be said of losses, and that is said."""
        frames = [attitude(k) for pair in zip(range(100), range(120, 220)) for k in pair]
        assert found(records(frames), "MFC003") is None
        run = verdict(records(frames), "MFC003")
        assert run.status == "insufficient-data"
        assert "several links" in run.reason

    def test_frames_with_unknown_ids_take_part(self) -> None:
        """Their sender counts them too."""
        frames = [
            unknown(k) if k % 3 == 1 else frame("HEARTBEAT", {}, (42, 190), k) for k in range(90)
        ]
        assert found(records(frames), "MFC003") is None

    def test_more_senders_than_are_followed(self) -> None:
        """The first 256, in the order in which they speak, whatever the cuts."""
        frames = [
            frame("HEARTBEAT", {}, (255 - k // 256, k % 256), 20 * turn)
            for turn in range(11)
            for k in range(300)
        ]
        data = records(frames)
        at_once = judge(data, pack=PACK)
        assert judge(data, range(500, len(data), 5000), PACK) == at_once
        subjects = [f.subject for f in at_once[1] if f.code == "MFC003"]
        assert len(subjects) == 256
        assert "255/0" in subjects


class TestUnknownIds:
    """MFC004: ids that the dialect lacks."""

    def test_counts(self) -> None:
        other = bytearray(unknown(7))
        other[7:10] = struct.pack("<I", 61_234)[:3]
        frames = [
            attitude(0),
            unknown(1),
            attitude(1),
            unknown(2),
            attitude(2),
            bytes(other),
            attitude(3),
        ]
        finding = certain(records(frames), "MFC004")
        assert finding.count == 3
        assert "60001 (2), 61234 (1)" in finding.text
        assert "ardupilotmega" in finding.text
        assert finding.severity is Severity.INFO


class TestDuplicates:
    """MFC005: the same frame twice."""

    @staticmethod
    def twice(frames: list[bytes], apart: int) -> bytes:
        """Return every frame again, `apart` frames later."""
        merged: list[bytes] = []
        for k in range(len(frames) + apart):
            merged += frames[k : k + 1]
            merged += frames[k - apart : k - apart + 1] if k >= apart else []
        return records(merged)

    def different(self, count: int) -> list[bytes]:
        """Return frames that all differ."""
        return [frame("ATTITUDE", {"time_boot_ms": k}, seq=k) for k in range(count)]

    def test_counts(self) -> None:
        """100 frames, all of them twice: 100 of 200 came again."""
        finding = certain(self.twice(self.different(100), 3), "MFC005")
        assert (finding.count, finding.subject) == (100, "1/*")
        assert finding.evidence["share"] == "0.5000"
        assert finding.severity is Severity.INFO

    @pytest.mark.parametrize(("copies", "speaks"), [(19, False), (20, True)])
    def test_how_many(self, copies: int, speaks: bool) -> None:
        frames = self.different(100)
        merged = [f for k, one in enumerate(frames) for f in ([one, one] if k < copies else [one])]
        assert (found(records(merged), "MFC005") is not None) is speaks

    @pytest.mark.parametrize(("apart", "speaks"), [(190, True), (450, False)])
    def test_how_far_apart(self, apart: int, speaks: bool) -> None:
        """The second copy must come within 400 frames; the counter alone repeats every 256."""
        assert (found(self.twice(self.different(600), apart), "MFC005") is not None) is speaks

    def test_the_same_content_under_another_number_is_no_copy(self) -> None:
        frames = [frame("HEARTBEAT", {"type": 2}, seq=k) for k in range(200)]
        assert found(records(frames), "MFC005") is None


def test_a_damaged_sample_has_each_finding_once() -> None:
    """One mistake, one finding: not one per byte range or frame."""
    data = (HERE / "damaged_link.tlog").read_bytes()
    findings = judge(data, pack=PACK)[1]
    subjects = [(f.code, f.subject) for f in findings]
    assert len(subjects) == len(set(subjects))
    assert {f.code for f in findings} == {"MFC001", "MFC002", "MFC003", "MFC004"}


def test_evidence_says_what_was_expected() -> None:
    data = (HERE / "damaged_link.tlog").read_bytes()
    for finding in judge(data, pack=PACK)[1]:
        evidence: Evidence = finding.evidence
        assert evidence["expected"]
        assert evidence["observed"]


def test_samples_are_there() -> None:
    """The tests above rest on them."""
    assert all((Path(HERE) / name).is_file() for name in CLEAN)
