"""The bench that writes mistakes into mission files: what it writes is a mission, clean before."""

from __future__ import annotations

import json

import pytest

from benchmarks.injection import files
from benchmarks.injection.plan import FileMistake, Plan, read_plan

RAISED = FileMistake(
    name="raised",
    codes=("MFC202",),
    set={"z": "z + home.alt"},
    where="(command == MAV_CMD_NAV_WAYPOINT) & (frame == 3)",
    decides="home.alt >= 250",
    blind="home.alt < 30",
)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return read_plan()


@pytest.mark.parametrize("mission", files.MISSIONS, ids=lambda mission: mission.name)
def test_missions_are_clean_where_they_are_written(plan: Plan, mission: files.Mission) -> None:
    for place in ("munich", "apia"):
        clean = files.made(mission, plan.place[place])
        assert not [f for f in files.findings_in(clean, ("MFC",)) if f.severity != "info"]


def test_a_mistake_is_written_where_it_applies(plan: Plan) -> None:
    clean = files.made(files.MISSIONS[0], plan.place["munich"])
    bad = files.with_mistake(clean, RAISED, RAISED.decides)
    assert bad is not None
    before, after = (json.loads(files.written(each)) for each in (clean, bad))
    old, new = before["mission"]["items"], after["mission"]["items"]
    raised = [n["params"][6] - o["params"][6] for o, n in zip(old, new, strict=True)]
    assert raised == [0, 519, 519, 519, 0, 519, 0]
    assert [item["Altitude"] for item in new] == [item["params"][6] for item in new]


def test_it_is_found_where_it_can_be_and_only_there(plan: Plan) -> None:
    def words(place: str) -> list[str]:
        clean = files.made(files.MISSIONS[2], plan.place[place])
        return [each.word for each in files._outcomes(clean, place, RAISED, [])]

    assert words("munich") == ["found"]
    assert words("rio") == ["silent"]
    assert words("cordoba") == ["found"]


def test_names_are_unique_and_columns_exist(plan: Plan) -> None:
    names = [mistake.name for mistake in plan.file_mistake]
    assert len(set(names)) == len(names)
    columns = set(files.made(files.MISSIONS[0], plan.place["rio"]).columns)
    for mistake in plan.file_mistake:
        assert set(mistake.set) <= columns, mistake.name
