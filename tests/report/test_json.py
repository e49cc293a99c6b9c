"""Machines get valid JSON in the documented shape, whatever was in the log."""

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from mavframecheck.report import Checked, Context, jsonl
from mavframecheck.report import json as json_format
from mavframecheck.report.json import document
from mavframecheck.report.schema import PATH, schema
from tests.report import made_up

CONTEXT = Context("0.1.0")
DOCS = Path(__file__).parents[2] / "docs" / "output.md"
ALL = (made_up.flight(), made_up.clean(), made_up.hostile(), Checked(made_up.file(), ()))


def strict(text: bytes) -> Any:
    """Parse as the strictest reader would: UTF-8, no NaN, no Infinity."""

    def refuse(token: str) -> None:
        pytest.fail(f"{token} is not JSON")

    return json.loads(text.decode("utf-8"), parse_constant=refuse)


def written() -> Any:
    """Return the JSON report on every made-up file."""
    mission = Checked(made_up.file(path="m.plan"), (made_up.mission_item(),))
    return strict(b"".join(json_format.render((*ALL, mission), CONTEXT)))


def test_report_follows_the_schema() -> None:
    """A real report passes the schema that is shipped."""
    report = written()
    jsonschema.validate(report, json.loads(PATH.read_bytes()))
    assert report["version"] == "0.1.0"
    assert [len(report[key]) for key in ("files", "findings")] == [5, 6]


def test_schema_rejects_what_is_not_a_report() -> None:
    """The schema asks for every key."""
    report = written()
    del report["findings"][0]["fingerprint"]
    with pytest.raises(jsonschema.ValidationError, match="fingerprint"):
        jsonschema.validate(report, schema())


def test_schema_file_is_fresh() -> None:
    """`make generate` writes it again."""
    assert PATH.read_bytes() == document(schema())


def test_schema_describes_everything() -> None:
    """No key is left to guesswork."""
    for name, part in schema()["$defs"].items():
        assert part["description"], name
        for key, value in part.get("properties", {}).items():
            assert value["description"], f"{name}.{key}"


def test_documentation_names_every_key() -> None:
    """docs/output.md knows every key of the schema."""
    named = set(re.findall(r"`(\w+)`", DOCS.read_text(encoding="utf-8")))
    keys = {key for part in schema()["$defs"].values() for key in part.get("properties", {})}
    assert keys <= named


def test_locations_are_told_apart_by_their_keys() -> None:
    """Bytes in a recording, line and item in a mission."""
    locations = [finding["location"] for finding in written()["findings"]]
    assert {"offset": 123456, "length": 63} in locations
    assert locations[-1] == {
        "line": 5,
        "column": 71,
        "item": 3,
        "command": "MAV_CMD_NAV_WAYPOINT",
    }


def test_numbers_without_a_json_form() -> None:
    """NaN is null, and a word where it is evidence."""
    nan = float("nan")
    finding = made_up.finding(time_first=nan, evidence={"observed": nan, "worst": -float("inf")})
    (found,) = strict(b"".join(json_format.render([Checked(made_up.file(), (finding,))], CONTEXT)))[
        "findings"
    ]
    assert found["time_first"] is None
    assert found["evidence"] == {"observed": "NaN", "worst": "-Infinity"}


def test_file_name_that_is_no_utf8_is_readable() -> None:
    """The byte that is no UTF-8 is shown as an escape."""
    report = made_up.file(path="flight\udcff.tlog")
    (file,) = strict(b"".join(json_format.render([Checked(report, ())], CONTEXT)))["files"]
    assert file["path"] == r"flight\xff.tlog"


def test_jsonl_is_the_same_in_lines() -> None:
    """Findings first, then their file, each in the shape of the document."""
    lines = [strict(line) for line in jsonl.render(ALL, CONTEXT)]
    assert [line.pop("type") for line in lines][:5] == ["finding"] * 4 + ["file"]
    assert lines[4]["path"] == "flight.tlog"
    definitions = schema()["$defs"]
    for line in lines:
        name = "Finding" if "fingerprint" in line else "FileReport"
        jsonschema.validate(line, {"$ref": f"#/$defs/{name}", "$defs": definitions})


def test_jsonl_writes_a_file_before_reading_the_next() -> None:
    """A line is out as soon as it is known."""

    def one_then_fail() -> Any:
        yield made_up.flight()
        pytest.fail("asked for the next file too early")

    lines = jsonl.render(one_then_fail(), CONTEXT)
    assert len([next(lines) for _ in range(5)]) == 5
