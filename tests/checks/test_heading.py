"""MFC309: a heading is judged by its unit only once the vehicle has turned."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from mavframecheck.engine import Pack, Settings, check_recording
from mavframecheck.engine.pack import read_rule
from mavframecheck.model import FileReport, Finding
from mavframecheck.sources import Recording
from mavframecheck.wire import load_dialect
from mavframecheck.wire.encode import encode_frame, encode_payload, stamped

RULE = Path(__file__).parents[2] / "rules" / "units" / "MFC309-heading-scale.toml"


def judged(
    scale: float, turn_deg: float, rows: int = 200
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge a vehicle that turns by `turn_deg`, its `hdg` being its yaw in degrees times `scale`."""
    dialect = load_dialect()
    data = bytearray()
    for k in range(rows):
        yaw = 20 + turn_deg * k / rows
        for name, fields in (
            ("HEARTBEAT", {"type": 2, "autopilot": 3}),
            ("ATTITUDE", {"yaw": np.arctan2(np.sin(np.radians(yaw)), np.cos(np.radians(yaw)))}),
            ("GLOBAL_POSITION_INT", {"lat": 1, "hdg": int(yaw % 360 * scale)}),
        ):
            layout = dialect.by_name[name]
            payload = encode_payload(layout, fields)
            frame = encode_frame(layout, payload, sysid=1, compid=1, seq=k)
            data += stamped(frame, 1_700_000_000_000_000 + k * 100_000)
    rule, source = read_rule(RULE)
    recording = Recording("turn.tlog", BytesIO(bytes(data)), None)
    return check_recording(recording, Pack((rule,), {rule.code: source}), Settings(), dialect)


def test_centidegrees_are_right() -> None:
    report, findings = judged(100, 300)
    assert findings == ()
    assert report.runs[0].status == "ran"


def test_whole_degrees_are_one_finding() -> None:
    _, findings = judged(1, 300)
    (finding,) = findings
    assert finding.field == "hdg"
    assert finding.evidence["reading"] == "whole degrees in a field of centidegrees"


@pytest.mark.parametrize("scale", [1, 100])
def test_without_a_turn_nothing_can_be_told(scale: float) -> None:
    report, findings = judged(scale, 20)
    assert findings == ()
    assert report.runs[0].status == "insufficient-data"
