"""SARIF that services take: valid by the OASIS schema, and what GitHub asks for beyond it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from mavframecheck.engine import Settings, check_file, load_pack
from mavframecheck.model import Suppressed
from mavframecheck.report import Checked, Context, Remark
from mavframecheck.report.sarif import FINGERPRINT, render
from tests.report import made_up

SCHEMA = json.loads((Path(__file__).parent / "schemas" / "sarif-2.1.0.json").read_bytes())
SAMPLES = Path(__file__).parents[2] / "samples"
CONTEXT = Context("0.1.0", rules=made_up.rules())
MISSION = Checked(made_up.file(path="m.plan"), (made_up.mission_item(),))
ASIDE = Suppressed(finding=made_up.finding(), by="configuration", reason="known since May")


def written(*results: Checked, context: Context = CONTEXT) -> Any:
    """Return the only run of a log that follows the schema."""
    log = json.loads(b"".join(render(results, context)))
    jsonschema.validate(log, SCHEMA, format_checker=jsonschema.Draft202012Validator.FORMAT_CHECKER)
    (run,) = log["runs"]
    return run


def test_schema_refuses_what_is_wrong() -> None:
    """It is the schema, not an empty one."""
    log = json.loads(b"".join(render((made_up.flight(),), CONTEXT)))
    log["runs"][0]["results"][0]["level"] = "bad"
    with pytest.raises(jsonschema.ValidationError, match="'bad' is not one of"):
        jsonschema.validate(log, SCHEMA)


def test_every_made_up_report_is_valid() -> None:
    """Hostile text, missions, verbose, unreadable files: all follow the schema."""
    remarks = (Remark("cannot be read", "gone\udcff.tlog"), Remark("unused suppression"))
    context = CONTEXT._replace(verbose=True, remarks=remarks)
    aside = made_up.clean()._replace(suppressed=(ASIDE,))
    run = written(made_up.flight(), made_up.hostile(), MISSION, aside, context=context)
    (invocation,) = run["invocations"]
    assert invocation["executionSuccessful"] is False
    assert len(invocation["toolConfigurationNotifications"]) == 1
    place = invocation["toolExecutionNotifications"][0]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "gone%FF.tlog"


def test_shipped_rules_and_a_real_recording_are_valid() -> None:
    """All that the rule files say passes too, and every finding points at its rule."""
    pack = load_pack()
    checked = Checked(*check_file(str(SAMPLES / "damaged_link.tlog"), pack, Settings()))
    run = written(checked, context=CONTEXT._replace(rules=pack.rules, verbose=True))
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == [rule.code for rule in pack.rules]
    assert all(rule["help"]["markdown"] for rule in rules)
    assert all(rules[each["ruleIndex"]]["id"] == each["ruleId"] for each in run["results"])


def test_a_finding_says_where_it_is() -> None:
    """Bytes, and the line that GitHub asks for; a mission has real lines."""
    run = written(made_up.flight(), MISSION)
    regions = [each["locations"][0]["physicalLocation"]["region"] for each in run["results"]]
    assert {"startLine": 1, "byteOffset": 123456, "byteLength": 63} in regions
    assert regions[-1] == {"startLine": 5, "startColumn": 71}
    assert all(region["startLine"] >= 1 for region in regions)


def test_results_point_at_their_rule() -> None:
    """Index and id agree; the rule has help in Markdown."""
    run = written(made_up.flight())
    rules = run["tool"]["driver"]["rules"]
    for result in run["results"]:
        if "ruleIndex" in result:
            assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
    markdown = rules[1]["help"]["markdown"]
    assert "The vehicle flies to the Gulf of Guinea." in markdown
    assert "<https://mavlink.io/en/messages/common.html>" in markdown


def test_fingerprints_do_not_depend_on_order_or_names() -> None:
    """The same mistake in another recording, read in another order, is the same alert."""

    def prints(*results: Checked) -> list[str]:
        return sorted(x["partialFingerprints"][FINGERPRINT] for x in written(*results)["results"])

    first, second = made_up.flight(), Checked(made_up.file(path="b.tlog"), (made_up.mask(),))
    renamed = Checked(made_up.file(path="c.tlog"), (made_up.mask(file="c.tlog"),))
    assert prints(first, second) == prints(second, first) == prints(renamed, first)


def test_what_is_no_finding_is_a_result_only_on_request() -> None:
    """GitHub takes a result of any kind for an alert."""
    aside = made_up.flight()._replace(suppressed=(ASIDE,))
    quiet = written(aside)["results"]
    assert {each.get("kind", "fail") for each in quiet} == {"fail"}
    assert not any("suppressions" in each for each in quiet)
    loud = written(aside, context=CONTEXT._replace(verbose=True))["results"]
    kinds = {each["ruleId"]: each for each in loud if "kind" in each}
    assert kinds["MFC103"]["kind"] == "notApplicable"
    assert kinds["MFC202"]["kind"] == "open"
    assert "no home position" in kinds["MFC202"]["message"]["text"]
    (suppressed,) = [each for each in loud if "suppressions" in each]
    assert suppressed["suppressions"][0]["justification"] == "known since May"
    assert all(each["locations"] for each in loud)


@pytest.mark.parametrize(
    ("path", "uri"),
    [
        ("logs/a b.tlog", "logs/a%20b.tlog"),
        ("./logs/a.tlog", "logs/a.tlog"),
        ("flight\udcff.tlog", "flight%FF.tlog"),
        ("a\nb#c?.tlog", "a%0Ab%23c%3F.tlog"),
        (str(Path.cwd() / "logs" / "a.tlog"), "logs/a.tlog"),
        ("/elsewhere/a.tlog", "file:///elsewhere/a.tlog"),
    ],
)
def test_uris_are_relative_where_they_can_be(path: str, uri: str) -> None:
    """Services match them with the files of a checkout."""
    found = made_up.finding(file=path)
    run = written(Checked(made_up.file(path=path), (found,)))
    place = run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place["uri"] == uri
    assert run["artifacts"][0]["location"]["uri"] == uri
