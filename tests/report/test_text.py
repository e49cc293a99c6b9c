"""What an operator reads."""

from pathlib import Path

import click
import pytest

from mavframecheck.model import Damage, Vehicle
from mavframecheck.report import Checked, Context
from mavframecheck.report.text import render
from tests.report import made_up

PIPED = Context("0.1.0")
DOCS = Path(__file__).parents[2] / "docs" / "output.md"
GOLDEN = Path(__file__).with_name("flight.txt")


def shown(*results: Checked, context: Context = PIPED) -> str:
    """Return the whole text of a report."""
    return "".join(render(results, context))


def last_line(*results: Checked, context: Context = PIPED) -> str:
    """Return the line that says how much was judged."""
    return shown(*results, context=context).splitlines()[-1]


def test_flight_reads_as_agreed() -> None:
    """`tests/report/flight.txt` is what was agreed on: look at it when this fails."""
    assert shown(made_up.flight()) == GOLDEN.read_text(encoding="utf-8")


def test_documentation_shows_real_output() -> None:
    """The sample in docs/output.md is a part of the golden file."""
    sample = DOCS.read_text(encoding="utf-8").split("```\n")[1]
    assert sample in GOLDEN.read_text(encoding="utf-8")


@pytest.mark.parametrize("verbose", [False, True])
def test_everything_but_the_last_line_fits_in_80_columns(verbose: bool) -> None:
    """A pipe and a narrow terminal can read it."""
    *body, _last = shown(made_up.flight(), context=PIPED._replace(verbose=verbose)).splitlines()
    assert max(map(len, body)) <= 80


def test_last_line_is_wrapped_only_where_a_person_watches() -> None:
    """`tail -1` gets all of it."""
    watched = PIPED._replace(terminal=True)
    assert max(map(len, shown(made_up.flight(), context=watched).splitlines())) <= 80
    assert last_line(made_up.flight()) == (
        "2 rules ran, 1 not applicable, 1 insufficient (see --verbose), 50310 frames, "
        "2 bad checksums, 44 bytes skipped, ArduCopter 4.7.0"
    )


def test_colours_only_when_asked_for() -> None:
    """Colours add nothing but colour."""
    plain = shown(made_up.flight())
    coloured = shown(made_up.flight(), context=PIPED._replace(colour=True))
    assert "\x1b" not in plain
    assert click.style("error MFC302", fg="red", bold=True) in coloured
    assert click.unstyle(coloured) == plain


def test_hostile_log_cannot_write_to_the_terminal() -> None:
    """Every text in the report is an attack, and every line is harmless."""
    context = PIPED._replace(verbose=True)
    text = shown(made_up.hostile(), made_up.hostile(), context=context)
    assert all(line.isprintable() for line in text.split("\n"))
    text.encode()


def test_a_long_label_does_not_squeeze_its_value() -> None:
    """A key of 200 characters has its own lines."""
    finding = made_up.finding(evidence={"k" * 200: "word " * 20})
    assert len(shown(Checked(made_up.file(), (finding,))).splitlines()) < 40


def test_clean_flight_still_says_how_much_was_judged() -> None:
    """Silence must not read as a pass."""
    text = shown(made_up.clean())
    assert "no findings" in text
    assert last_line(made_up.clean()).startswith("2 rules ran, 1 not applicable, 1 insufficient")


def test_verbose_gives_reasons_and_damage() -> None:
    """--verbose says what was not judged, why, and where the file is damaged."""
    text = shown(made_up.flight(), context=PIPED._replace(verbose=True))
    assert "bytes 1200 to 1243 (44): no magic byte" in text
    assert "and 2 more ranges" in text
    assert "MFC001 ran: 5 rows not judged: no home position\n" in text
    assert "MFC202 insufficient data for 1/1 GLOBAL_POSITION_INT: no home position" in text
    assert "--verbose" not in text


def test_only_ground_stations_is_no_vehicle() -> None:
    """A log of ground stations only is no clean flight."""
    station = Vehicle(sysid=255, compid=190, role="gcs")
    alone = Checked(made_up.file(vehicles=(station,)), ())
    assert last_line(alone).endswith("no vehicle in this log")
    nobody = Checked(made_up.file(vehicles=()), ())
    assert last_line(nobody).endswith("unknown autopilot")


def test_undecodable_file_is_said() -> None:
    """A file without frames says so in its head."""
    empty = made_up.file(messages=0, unknown=3, duration_s=None, time_start=None, runs=())
    text = shown(Checked(empty, ()))
    assert "nothing could be decoded, 3 frames of unknown messages" in text
    assert "0 rules ran" in text


def test_several_files_are_summed_up() -> None:
    """The last line is about all files."""
    text = shown(made_up.flight(), made_up.clean())
    assert "\n\nclean.tlog\n" in text
    assert "2 files: 2 errors, 1 warning, 1 info" in text
    assert "2 rules ran, 1 not applicable, 1 insufficient" in text.splitlines()[-1]
    assert "100620 frames" in text.splitlines()[-1]
    assert shown() == "nothing was judged\n"


def test_mission_item_has_a_line_and_no_time() -> None:
    """A mission is pointed at by line and item."""
    text = shown(Checked(made_up.file(), (made_up.mission_item(),)))
    assert "\n    once, line 5, column 71, item 3, MAV_CMD_NAV_WAYPOINT\n" in text


def test_many_senders_are_cut_short() -> None:
    """A hostile log has hundreds of senders."""
    crowd = tuple(Vehicle(sysid=n, compid=1, role="autopilot") for n in range(1, 200))
    damage = tuple(Damage(n, 1, "garbage") for n in range(20))
    text = shown(Checked(made_up.file(vehicles=crowd, damage=damage), ()))
    assert "and 187 more senders (--verbose)" in text
    assert len(text.splitlines()) < 30


def test_streams_are_in_order() -> None:
    """The stream with the worst finding first, then by number: 2 comes before 10."""
    findings = [
        made_up.mask(sysid=10, message_name="A"),
        made_up.mask(sysid=2, message_name="A"),
        made_up.mask(sysid=2, message_name="B"),
        made_up.finding(sysid=30, message_name="C"),
    ]
    lines = shown(Checked(made_up.file(), tuple(findings))).splitlines()
    heads = [line for line in lines if line.endswith((" A", " B", " C"))]
    assert heads == ["30/191 C", "2/191 A", "2/191 B", "10/191 A"]
