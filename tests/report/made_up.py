"""A made-up flight with one finding of each kind, and one full of hostile text."""

from __future__ import annotations

from typing import Any

from mavframecheck.model import (
    Applies,
    ByteLocation,
    Damage,
    Detect,
    Example,
    Explain,
    FileReport,
    Finding,
    MissionLocation,
    Persist,
    Rule,
    RuleRun,
    Severity,
    SeverityWhen,
    Step,
    Vehicle,
)
from mavframecheck.report import Checked

START = 1_772_619_072.0  # 2026-03-04 10:11:12 UTC
HOSTILE = (
    "\x1b[31mred\x07\x9b2J\r\n\u202egnp.exe\u2066\u200b\ufeff\udcff\ud800</script>|`*::error::"
)


def finding(**changes: Any) -> Finding:
    """Return a finding that differs from degrees in a scaled field by `changes`."""
    fields: dict[str, Any] = {
        "code": "MFC302",
        "name": "degrees-in-scaled-field",
        "severity": Severity.ERROR,
        "confidence": "high",
        "file": "flight.tlog",
        "subject": "1/191 SET_POSITION_TARGET_GLOBAL_INT.lat_int",
        "sysid": 1,
        "compid": 191,
        "message_name": "SET_POSITION_TARGET_GLOBAL_INT",
        "field": "lat_int",
        "time_first": START + 83.44,
        "time_last": START + 130.0,
        "utc_first": "2026-03-04T10:12:35.440Z",
        "utc_last": "2026-03-04T10:13:22.000Z",
        "count": 45,
        "location": ByteLocation(123456, 63),
        "fingerprint": "9f2c",
        "evidence": {
            "expected": "473977418 (degrees times 1e7)",
            "observed": 47,
            "unit": "degE7",
            "away_km": 5240.1179,
        },
        "text": "SET_POSITION_TARGET_GLOBAL_INT: 47 is 4.7e-06 deg after scaling, 5240 km from the "
        "vehicle; it looks like plain degrees.",
        "fix": "Multiply latitude and longitude by 1e7 and round before sending.",
    }
    return Finding(**fields | changes)


def mask(**changes: Any) -> Finding:
    """Return a warning on the same stream."""
    fields: dict[str, Any] = {
        "code": "MFC107",
        "name": "unmasked-zero-yaw",
        "severity": Severity.WARNING,
        "confidence": "medium",
        "subject": "1/191 SET_POSITION_TARGET_GLOBAL_INT.yaw",
        "field": "yaw",
        "time_first": START + 61.0,
        "time_last": START + 61.0,
        "utc_first": "2026-03-04T10:12:13.000Z",
        "utc_last": "2026-03-04T10:12:13.000Z",
        "count": 1,
        "evidence": {"expected": "bit 1024 set, or the yaw meant", "observed": 0.0, "unit": "rad"},
        "text": "yaw is 0 and not ignored: the vehicle turns its nose to the north.",
        "fix": "Set the yaw ignore bit (1024) in type_mask, or send the yaw you mean.",
    }
    return finding(**fields | changes)


def odometry() -> Finding:
    """Return an error that leans on another stream and is known only by its bytes."""
    return finding(
        code="MFC411",
        name="east-north-up-where-north-east-down-is-meant",
        subject="1/197 ODOMETRY.x",
        compid=197,
        message_name="ODOMETRY",
        field="x",
        time_first=None,
        time_last=None,
        utc_first=None,
        utc_last=None,
        count=1800,
        location=ByteLocation(9_000_001, 245),
        related=("1/1 LOCAL_POSITION_NED", "1/1 GPS_RAW_INT"),
        evidence={
            "expected": "MAV_FRAME_LOCAL_FRD",
            "observed": "x holds East, y holds North, z is up",
            "frame": "ENU",
            "left_out": None,
            "unit": "m",
            "residual": float("nan"),
        },
        text="The position is East, North, Up, but the message says it is North, East, Down.",
        fix="Swap x and y and change the sign of z.",
    )


def stream_rule() -> Finding:
    """Return information about the file as a whole."""
    return finding(
        code="MFC003",
        name="lost-frames",
        severity=Severity.INFO,
        subject="",
        sysid=None,
        compid=None,
        message_name=None,
        field=None,
        count=312,
        location=None,
        evidence={"observed": 312, "unit": "frames"},
        text="312 of 50622 frames never arrived.",
        fix="Nothing to mend in the sender: look at the radio link.",
    )


def mission_item() -> Finding:
    """Return a finding in a mission file: a line, and no sender or time."""
    return finding(
        code="MFC204",
        name="absolute-altitude-in-relative-frame",
        severity=Severity.WARNING,
        file="field.waypoints",
        subject="MISSION_ITEM_INT.z",
        sysid=None,
        compid=None,
        message_name="MISSION_ITEM_INT",
        field="z",
        time_first=None,
        time_last=None,
        utc_first=None,
        utc_last=None,
        count=1,
        location=MissionLocation(line=5, column=71, item=3, command="MAV_CMD_NAV_WAYPOINT"),
        evidence={"expected": "below 300", "observed": 520.0, "unit": "m"},
    )


RUNS = (
    RuleRun(
        code="MFC001", status="ran", checked=50310, reason="5 rows not judged: no home position"
    ),
    RuleRun(code="MFC302", subject="1/191", status="ran", checked=45),
    RuleRun(code="MFC302", subject="255/190", status="not-applicable", reason="sends none"),
    RuleRun(code="MFC103", status="not-applicable", reason="no SET_POSITION_TARGET in this file"),
    RuleRun(
        code="MFC202",
        subject="1/1 GLOBAL_POSITION_INT",
        status="insufficient-data",
        reason="no home position was ever sent, so absolute and relative altitude look the same",
    ),
)
VEHICLES = (
    Vehicle(
        sysid=1,
        compid=1,
        role="autopilot",
        autopilot="arducopter",
        type="QUADROTOR",
        version="4.7.0",
        messages=48210,
    ),
    Vehicle(sysid=1, compid=191, role="companion", messages=2000),
    Vehicle(sysid=255, compid=190, role="gcs", messages=100),
)


def file(**changes: Any) -> FileReport:
    """Return a flight of twelve minutes that differs by `changes`."""
    fields: dict[str, Any] = {
        "path": "flight.tlog",
        "kind": "tlog",
        "messages": 50310,
        "unknown": 0,
        "bad_crc": 2,
        "skipped_bytes": 44,
        "duration_s": 751.2,
        "time_start": START,
        "vehicles": VEHICLES,
        "damage": (Damage(1200, 44, "no magic byte"),),
        "damage_total": 3,
        "notes": ("2 receive stamps are implausible and were not used",),
        "runs": RUNS,
    }
    return FileReport(**fields | changes)


def flight() -> Checked:
    """Return the flight and its findings, in no helpful order."""
    return Checked(file(), (mask(), stream_rule(), finding(), odometry()))


def clean() -> Checked:
    """Return a flight without findings."""
    return Checked(file(path="clean.tlog", bad_crc=0, damage=(), skipped_bytes=0, notes=()), ())


def hostile() -> Checked:
    """Return a report in which every text came from an attacker."""
    bad = finding(
        file=HOSTILE,
        subject=HOSTILE,
        message_name=HOSTILE,
        field=HOSTILE,
        name=HOSTILE,
        text=HOSTILE,
        fix=HOSTILE,
        related=(HOSTILE,),
        utc_first=HOSTILE,
        evidence={"expected": HOSTILE, "unit": HOSTILE, HOSTILE: HOSTILE, "worst": float("-inf")},
    )
    speaker = Vehicle(
        sysid=1, compid=1, role="autopilot", autopilot=HOSTILE, type=HOSTILE, version=HOSTILE
    )
    run = RuleRun(code=HOSTILE, subject=HOSTILE, status="insufficient-data", reason=HOSTILE)
    report = file(
        path=HOSTILE,
        kind=HOSTILE,
        vehicles=(speaker, Vehicle(sysid=2, compid=1, role=HOSTILE)),
        damage=(Damage(0, 1, HOSTILE),),
        notes=(HOSTILE,),
        runs=(run,),
    )
    return Checked(report, (bad,))


def rule(**changes: Any) -> Rule:
    """Return the rule behind `finding`."""
    fields: dict[str, Any] = {
        "code": "MFC302",
        "name": "degrees-in-scaled-field",
        "severity": Severity.ERROR,
        "confidence": "high",
        "status": "stable",
        "since": "0.1.0",
        "summary": "Latitude and longitude written in degrees into fields scaled by 1e7.",
        "applies": Applies(
            tag={"quantity": "latitude", "unit": "degE7"}, has=("lon",), sender=("!autopilot",)
        ),
        "let": {"away_km": "distance_km(si(lat), si(lon), vehicle.lat, vehicle.lon)"},
        "detect": Detect(
            when="known(vehicle.lat)",
            flag="abs(raw(lat)) <= 90 and away_km > near_km",
            persist=Persist(count=3, seconds=2.0),
        ),
        "params": {"near_km": 1.0, "tries": 3, "strict": True, "word": "north"},
        "severity_when": (
            SeverityWhen(condition="vehicle.autopilot == 'unknown'", severity=Severity.WARNING),
        ),
        "explain": Explain(
            text="{message}: {lat}",
            why="The vehicle flies to the Gulf of Guinea.\n\nIt starts at once.",
            fix="Multiply by 1e7 and round.",
            references=("https://mavlink.io/en/messages/common.html",),
        ),
        "example": (
            Example(
                expect="bad",
                note="near Zurich",
                context={"autopilot": "arducopter", "home": {"lat": 47.4, "lon": 8.5}},
                step=(
                    Step(
                        message="SET_POSITION_TARGET_GLOBAL_INT",
                        fields={"lat_int": 47, "lon_int": 8},
                        repeat=3,
                    ),
                ),
            ),
            Example(expect="good", raw="fd09", step=(Step(message="HEARTBEAT", sender="gcs"),) * 6),
        ),
    }
    return Rule(**fields | changes)


def rules() -> tuple[Rule, ...]:
    """Return a small pack."""
    return (
        rule(
            code="MFC107",
            name="unmasked-zero-yaw",
            severity=Severity.WARNING,
            status="preview",
            params={},
            summary="Yaw is zero and not ignored: the vehicle turns its nose to the north.",
        ),
        rule(),
    )
