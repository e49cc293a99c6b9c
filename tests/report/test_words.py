"""Numbers and times read as people write them."""

import pytest

from mavframecheck.model import Vehicle
from mavframecheck.report.words import component, duration, elapsed, plural, scalar, utc


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [
        (0.0, "0:00.0"),
        (59.96, "1:00.0"),
        (83.44, "1:23.4"),
        (3600.0, "1:00:00.0"),
        (-1.0, "-0:01.0"),
        (-0.01, "0:00.0"),
    ],
)
def test_elapsed(seconds: float, expected: str) -> None:
    """Time since the start rounds before it is split into minutes."""
    assert elapsed(seconds) == expected


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [(45.2, "45.2 s"), (751.2, "12 min 31 s"), (3720.0, "1 h 02 min"), (59.99, "1 min 00 s")],
)
def test_duration(seconds: float, expected: str) -> None:
    """A duration is as exact as its length asks for."""
    assert duration(seconds) == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (47.3977418, "47.397742"),
        (473977418, "473977418"),
        (float("nan"), "NaN"),
        (True, "yes"),
        (None, "unknown"),
        ("a\nb\x1b", r"a b\x1b"),
    ],
)
def test_scalar(value: object, expected: str) -> None:
    """Degrees keep a tenth of a metre, and NaN keeps its name."""
    assert scalar(value) == expected


def test_impossible_time_is_said() -> None:
    """A stamp outside of the calendar does not end the report."""
    assert utc(1_772_619_072.0) == "2026-03-04 10:11:12 UTC"
    assert utc(1e13) == utc(float("nan")) == "an impossible time"


@pytest.mark.parametrize(
    ("vehicle", "expected"),
    [
        (
            Vehicle(sysid=1, compid=1, role="autopilot", autopilot="px4", type="FIXED_WING"),
            "PX4 of unknown version, fixed wing",
        ),
        (Vehicle(sysid=1, compid=1, role="autopilot"), "unknown autopilot"),
        (Vehicle(sysid=255, compid=190, role="gcs"), "ground station"),
        (Vehicle(sysid=1, compid=100, role="camera"), "camera"),
    ],
)
def test_component(vehicle: Vehicle, expected: str) -> None:
    """A component is what it said it is, and no more."""
    assert component(vehicle) == expected


def test_plural() -> None:
    """One frame, no frames."""
    assert (plural(1, "frame"), plural(0, "frame")) == ("1 frame", "0 frames")
