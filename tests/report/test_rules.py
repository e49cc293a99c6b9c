"""A rule explains itself from its file."""

import json

from mavframecheck.model import Applies
from mavframecheck.report import Context
from mavframecheck.report.rules import (
    explanation,
    explanation_json,
    listing,
    listing_json,
)
from tests.report import made_up

PIPED = Context("0.1.0")


def explained(**changes: object) -> str:
    """Return the explanation of a rule that differs by `changes`."""
    return "\n".join(explanation(made_up.rule(**changes), PIPED))


def test_listing_fits_and_names_every_rule() -> None:
    """Two lines a rule."""
    lines = list(listing(made_up.rules(), PIPED))
    assert max(map(len, lines)) <= 80
    assert lines[1] == "MFC107  warning   unmasked-zero-yaw        preview"
    assert lines[2].strip().startswith("Yaw is zero and not ignored")
    assert lines[-1].startswith("2 rules;")


def test_listing_json() -> None:
    """Machines get the parameters too."""
    first, second = json.loads(listing_json(made_up.rules()))
    assert (first["code"], first["status"]) == ("MFC107", "preview")
    assert second["params"] == {"near_km": 1.0, "tries": 3, "strict": True, "word": "north"}


def test_explanation_says_all_that_the_file_says() -> None:
    """Everything a user may ask is in the terminal."""
    text = explained()
    for words in (
        "MFC302 degrees-in-scaled-field\nerror, high confidence, stable, since 0.1.0",
        "every field of quantity latitude and unit degE7",
        "sent by anything but autopilot",
        "away_km = distance_km(",
        "judged where known(vehicle.lat)",
        "wrong where abs(raw(lat)) <= 90 and away_km > near_km",
        "for at least 3 hits and 2 s",
        "warning where vehicle.autopilot == 'unknown'",
        "Gulf of Guinea.\n\n  It starts at once.",
        "--set MFC302.near_km=1.0",
        "--set MFC302.strict=true",
        "bad: near Zurich; with autopilot=arducopter, home.lat=47.4, home.lon=8.5;",
        "lat_int=47, lon_int=8, 3\n    times, every 0.1 s",
        "and 2 more messages; bytes fd09",
        "https://mavlink.io/en/messages/common.html",
    ):
        assert words in text
    assert max(map(len, text.splitlines())) <= 80


def test_empty_sections_are_left_out() -> None:
    """No title without lines."""
    text = explained(params={}, example=(), applies=Applies(message=("ATTITUDE", "ODOMETRY")))
    assert "Parameters" not in text
    assert "Examples" not in text
    assert "in ATTITUDE or ODOMETRY" in text


def test_explanation_json_uses_the_keys_of_the_file() -> None:
    """JSON of a rule reads like its TOML."""
    rule = json.loads(explanation_json(made_up.rule()))
    assert rule["applies"]["from"] == ["!autopilot"]
    assert rule["severity_when"][0]["if"] == "vehicle.autopilot == 'unknown'"


def test_hostile_rule_file_cannot_write_to_the_terminal() -> None:
    """Rule files of others are hostile input too."""
    hostile = made_up.HOSTILE
    rule = made_up.rule(
        code=hostile, name=hostile, since=hostile, summary=hostile, params={hostile: hostile}
    )
    lines = [*explanation(rule, PIPED), *listing([rule], PIPED)]
    assert all(line.isprintable() for line in lines)
