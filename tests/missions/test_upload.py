"""A mission file as the batch that sending it would be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mavframecheck.missions import Transactions, read_mission
from mavframecheck.missions import planned as planned_module
from mavframecheck.missions.items import items_of
from mavframecheck.missions.text import MissionError
from mavframecheck.missions.upload import UNSET, Upload
from mavframecheck.sources import MISSIONS, open_recording
from tests.missions.made import HOME, item, plan, uploaded, written

FENCE = {"polygons": [{"inclusion": True, "polygon": [[47.3, 8.5], [47.4, 8.5], [47.4, 8.6]]}]}


def upload(folder: Path, content: Any, family: str | None = None, name: str = "m.plan") -> Upload:
    with open_recording(written(folder, content, name), kinds=MISSIONS) as file:
        return uploaded(read_mission(file), family)


def test_items_are_rows_of_mission_item_int(tmp_path: Path) -> None:
    sent = upload(tmp_path, plan(item(22), item(16, 1, lat=12.34567, lon=-3), item(lat=None)))
    table = sent.batch.tables["MISSION_ITEM_INT"]

    assert table["seq"].tolist() == [0, 1, 2]
    assert table["x"].tolist() == [473978000, 123457, UNSET]
    assert table["y"].tolist() == [85457000, -30000, 85457000]
    assert np.isnan(table["param4"]).all()
    assert table["file_x_decimals"].tolist()[:2] == [4, 5]
    assert sent.batch.tables["HEARTBEAT"]["autopilot"].tolist() == [12]
    assert (sent.batch.tables["HOME_POSITION"]["altitude"] * 1e-3).tolist() == [HOME[2]]


def test_numbers_that_fit_no_message_stay_what_they_are(tmp_path: Path) -> None:
    sent = upload(tmp_path, plan(item(lat=473977420, lon=1e300, alt=1e200)))
    table = sent.batch.tables["MISSION_ITEM_INT"]
    assert table["x"][0] == 4_739_774_200_000_000
    assert table["y"][0] == 2**62
    assert table["z"][0] == 1e200


def test_ardupilot_gets_home_as_item_0(tmp_path: Path) -> None:
    made = plan(item(22), item(), firmwareType=3)
    sent = upload(tmp_path, made)
    table = sent.batch.tables["MISSION_ITEM_INT"]

    assert table["seq"].tolist() == [0, 1, 2]
    assert table["z"].tolist() == [HOME[2], 30, 30]
    assert sent.batch.tables["MISSION_COUNT"]["count"].tolist() == [3]
    assert upload(tmp_path, made, "px4").batch.tables["MISSION_ITEM_INT"]["seq"].tolist() == [0, 1]


@pytest.mark.parametrize(
    ("family", "autopilot", "vehicle"),
    [(None, 12, 2), ("px4", 12, 2), ("arducopter", 3, 2), ("arduplane", 3, 1), ("ardusub", 3, 12)],
)
def test_autopilot_overrules_the_file(
    tmp_path: Path, family: str | None, autopilot: int, vehicle: int
) -> None:
    sent = upload(tmp_path, plan(item()), family)
    assert sent.told == (autopilot, vehicle)
    assert sent.batch.tables["HEARTBEAT"]["type"].tolist() == [vehicle]


def test_fence_and_mission_are_transactions_of_their_own(tmp_path: Path) -> None:
    sent = upload(tmp_path, plan(item(22), item()) | {"geoFence": FENCE})
    transactions = Transactions()
    missions = [*transactions.update(sent.batch), *transactions.finish()]

    assert [(m.mission_type, m.count, m.complete) for m in missions] == [(0, 2, True), (1, 3, True)]
    assert missions[1].items.said["file_x_decimals"].tolist() == [1, 1, 1]
    assert items_of(sent.batch.tables["MISSION_ITEM_INT"]).x.tolist()[:2] == [47.3978, 47.3978]


def test_places_are_those_of_the_field_else_of_the_item(tmp_path: Path) -> None:
    content = (
        "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.1\t488\t1\n1 0 3 16 0 0 0 0 47.2 8.2 20 1\n"
    )
    sent = upload(tmp_path, content, name="m.waypoints")
    last = len(sent.batch) - 1

    assert vars_of(sent.locate(last, "z")) == (3, 27, 1, "NAV_WAYPOINT")
    assert vars_of(sent.locate(last)) == (3, 1, 1, "NAV_WAYPOINT")
    assert vars_of(sent.locate(0)) == (None, None, None, None)


def vars_of(place: Any) -> tuple[Any, ...]:
    return place.line, place.column, place.item, place.command


def test_more_items_than_can_be_sent_are_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planned_module, "MOST_ITEMS", 3)
    row = "1 0 3 16 0 0 0 0 47.2 8.2 20 1\n"
    with pytest.raises(MissionError, match="line 5, column 1: more than 3 items"):
        upload(tmp_path, "QGC WPL 110\n" + row * 4, name="m.waypoints")
