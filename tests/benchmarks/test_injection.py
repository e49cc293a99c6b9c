"""The bench that writes mistakes into recordings: what it writes is MAVLink, and says what it should."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink import mavutil

from benchmarks.injection import judge
from benchmarks.injection.__main__ import show
from benchmarks.injection.log import Change, Log, put
from benchmarks.injection.make import with_mistake, with_streams
from benchmarks.injection.places import Place, moved
from benchmarks.injection.plan import Mistake, Plan, Stream, read_plan
from benchmarks.injection.words import Scope, evaluate
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.geo.geoid import undulation
from mavframecheck.wire import load_dialect

SAMPLE = Path(__file__).parents[2] / "samples" / "clean_copter.tlog"
CUSCO = Place(-13.53195, -71.96746, 3330.0)
REPOSITION = Stream(
    message="COMMAND_INT",
    sender="gcs",
    every_s=10.0,
    when="vehicle.up > 3",
    fields={
        "command": "MAV_CMD_DO_REPOSITION",
        "frame": "MAV_FRAME_GLOBAL_RELATIVE_ALT",
        "x": "lat",
        "y": "lon",
        "z": "vehicle.up",
    },
)
DEGREES = Mistake(
    name="plain degrees",
    codes=("MFC302",),
    message="COMMAND_INT",
    set={"x": "trunc(x * 1e-7)", "y": "trunc(y * 1e-7)"},
)


@pytest.fixture
def log() -> Log:
    """Return a small clean flight, with commands in it."""
    plain = Log(SAMPLE.read_bytes(), load_dialect())
    return Log(with_streams(plain, [REPOSITION]), plain.dialect)


def decoded(data: bytes, folder: Path) -> list[Any]:
    """Return what pymavlink reads of a tlog; anything that it cannot read fails."""
    path = folder / "written.tlog"
    path.write_bytes(data)
    link = mavutil.mavlink_connection(str(path))
    messages = []
    while (message := link.recv_match()) is not None:
        assert message.get_type() != "BAD_DATA"
        messages.append(message)
    link.close()
    return messages


def header(message: Any) -> tuple[Any, ...]:
    """Return what must not change when a payload does."""
    ids = (message.get_srcSystem(), message.get_srcComponent(), message.get_seq())
    return (message.get_type(), *ids, message._timestamp)


def test_a_changed_payload_keeps_its_framing_and_stamp(log: Log, tmp_path: Path) -> None:
    table = log.tables["VFR_HUD"]
    columns = table.columns.copy()
    put(columns, "alt", table["alt"] + 1000)

    before = decoded(log.written({}), tmp_path)
    changed = log.written({"VFR_HUD": Change(np.arange(len(table)), columns)})
    after = decoded(changed, tmp_path)

    assert [header(m) for m in after] == [header(m) for m in before]
    for old, new in zip(before, after, strict=True):
        if new.get_type() == "VFR_HUD":
            assert new.alt == pytest.approx(old.alt + 1000)
        else:
            assert str(new.to_dict()) == str(old.to_dict())


def test_every_frame_of_a_moved_recording_with_a_mistake_is_mavlink(
    log: Log, tmp_path: Path
) -> None:
    there = Log(moved(log, CUSCO), log.dialect)
    made = with_mistake(there, DEGREES, "True")

    assert made is not None
    messages = decoded(made.data, tmp_path)
    commands = [m for m in messages if m.get_type() == "COMMAND_INT"]
    assert len(messages) == len(log.frames)
    assert made.rows == len(commands) > 0
    assert {(m.x, m.y) for m in commands} == {(-13, -71)}


def test_a_moved_flight_is_the_same_flight_elsewhere(log: Log) -> None:
    there = Log(moved(log, CUSCO), log.dialect)
    here, new = log.tables["GLOBAL_POSITION_INT"], there.tables["GLOBAL_POSITION_INT"]

    def from_home(one: Log) -> Any:
        home, at = one.tables["HOME_POSITION"], one.tables["GLOBAL_POSITION_INT"]
        lat, lon = home["latitude"][0] * 1e-7, home["longitude"][0] * 1e-7
        return distance_m(at["lat"] * 1e-7, at["lon"] * 1e-7, lat, lon)

    assert there.tables["HOME_POSITION"]["altitude"][0] == 3_330_000
    assert (new["relative_alt"] == here["relative_alt"]).all()
    assert (new["alt"] - here["alt"] == 3_330_000 - 488_000).all()
    assert from_home(there) == pytest.approx(from_home(log), rel=0.01, abs=0.05)
    gnss = there.tables["GPS_RAW_INT"]
    separation = float(undulation(CUSCO.lat, CUSCO.lon))
    assert gnss["alt_ellipsoid"] - gnss["alt"] == pytest.approx(separation * 1e3, abs=100)


def test_what_is_not_known_is_not_moved(log: Log) -> None:
    table = log.tables["GLOBAL_POSITION_INT"]
    columns = table.columns[:1].copy()
    for name in ("lat", "lon", "alt", "relative_alt"):
        columns[name] = 0
    unset = Log(log.written({table.name: Change(np.array([0]), columns)}), log.dialect)

    first = Log(moved(unset, CUSCO), log.dialect).tables[table.name].columns[0]

    assert (first["lat"], first["lon"], first["alt"]) == (0, 0, 0)


def test_numbers_are_put_as_their_type_holds_them() -> None:
    columns = np.zeros(2, np.dtype([("a", "i2"), ("b", "f4", (2,))]))
    put(columns, "a", [40000.0, -1.6])
    put(columns, "b", [1.5, np.nan])

    assert columns["a"].tolist() == [32767, -2]
    assert columns["b"][0].tolist() == [1.5, 1.5]
    assert np.isnan(columns["b"][1]).all()


def test_expressions_see_fields_context_and_constants(log: Log) -> None:
    table = log.tables["COMMAND_INT"]
    scope = Scope(log, table)

    assert evaluate("command == MAV_CMD_DO_REPOSITION", scope, len(table)).all()
    assert evaluate("abs(home.alt - 488) < 1", scope, len(table)).all()
    assert evaluate("copter & ~px4", scope, len(table)).all()
    assert np.diff(evaluate("t", scope, len(table))).min() > 0
    with pytest.raises(ValueError, match="no_such_name"):
        evaluate("no_such_name", scope, len(table))


def test_a_mistake_is_found_where_it_was_written_and_only_there(log: Log) -> None:
    before = judge.findings_in(log.written({}), DEGREES.codes)
    (found,) = judge._outcomes(log, "sample", DEGREES, before)

    assert not before
    assert found.word == "found"
    assert found.hits == found.rows
    harmless = Mistake(name="none", codes=("MFC302",), message="COMMAND_INT", decides="z > 1e6")
    (silent,) = judge._outcomes(log, "sample", harmless, before)
    assert silent.word == "silent"


def test_a_mistake_that_no_rule_sees_is_missed(log: Log) -> None:
    unseen = Mistake(
        name="unseen", codes=("MFC302",), message="COMMAND_INT", set={"param3": "param3 + 1"}
    )
    (missed,) = judge._outcomes(log, "sample", unseen, [])

    assert missed.word == "missed"


OUTCOMES: dict[str, judge.Outcome] = {
    "found": judge.Outcome("plain degrees", "sample", "found", 5, 5),
    "missed": judge.Outcome("plain degrees", "sample", "missed", 0, 5),
    "silent": judge.Outcome("plain degrees", "sample", "silent", 0, 5),
    "wrong": judge.Outcome("plain degrees", "sample", "wrong", 1, 5),
}


@pytest.mark.parametrize(
    ("words", "alarms", "good"),
    [
        (["found", "silent"], [], True),
        (["silent"], [], True),
        (["found"] * 98 + ["missed"] * 2, [], False),
        (["found"] * 99 + ["missed"], [], True),
        (["found", "wrong"], [], False),
        (["found"], ["sample: error MFC302"], False),
    ],
)
def test_a_short_recall_a_wrong_finding_or_an_alarm_fails(
    plan: Plan, words: list[str], alarms: list[str], good: bool
) -> None:
    verdicts = judge.Verdicts([OUTCOMES[word] for word in words], alarms, 1)

    assert show(plan, [DEGREES], verdicts, everything=False) is good


@pytest.fixture(scope="module")
def plan() -> Plan:
    return read_plan()


def test_names_are_unique_and_places_exist(plan: Plan) -> None:
    names = Counter(mistake.name for mistake in plan.mistake)
    assert not [name for name, times in names.items() if times > 1]
    assert {place for source in plan.recording for place in source.places} <= set(plan.place)


def test_every_field_that_is_set_exists(plan: Plan) -> None:
    layouts = load_dialect().by_name
    streams = (*plan.stream, *(m.stream for m in plan.mistake if m.stream is not None))
    sets = [(m.message, m.set) for m in plan.mistake] + [(s.message, s.fields) for s in streams]
    for message, fields in sets:
        assert set(fields) <= set(layouts[message].by_name), message


def test_places_cover_heights_and_hemispheres(plan: Plan) -> None:
    places = plan.place.values()
    assert {(p.lat > 0, p.lon > 0) for p in places} == {
        (north, east) for north in (True, False) for east in (True, False)
    }
    for low, high in ((0, 50), (400, 700), (1900, 3500)):
        assert {p.lat > 0 for p in places if low <= p.alt <= high} == {True, False}
