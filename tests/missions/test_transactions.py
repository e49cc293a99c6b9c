"""Transfers of missions: several vehicles, retries, lost frames, parts, removals."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavframecheck.missions import Ledger, Mission, Transactions
from mavframecheck.wire import read_batches
from tests.missions.transfers import (
    ACCEPTED,
    ERROR,
    LAT,
    OTHER,
    OUT_OF_TURN,
    STATION,
    VEHICLE,
    Transfers,
    waypoints,
)
from tests.strategies import DIALECT, chunks, cut


def found(recording: Transfers, cuts: Iterable[int] = ()) -> list[Mission]:
    """Return the transfers in a recording."""
    transactions = Transactions()
    missions: list[Mission] = []
    pieces = chunks(cut(recording.data, cuts))
    for batch in read_batches(pieces, DIALECT, stamped=True):
        missions += transactions.update(batch)
    return [*missions, *transactions.finish()]


def held(recording: Transfers) -> dict[tuple[int, int], tuple[str, int, list[int]]]:
    """Return how what vehicles hold is known, how many items, and the numbers of those seen."""
    ledger = Ledger(lambda sender: sender & 0xFF == 1).enter(found(recording))
    return {k: (h.known, h.count, h.items.seq.tolist()) for k, h in ledger.held.items()}


def test_an_upload() -> None:
    (mission,) = found(Transfers().upload(waypoints(3)))
    assert (mission.sender, mission.target, mission.count) == (255 * 256 + 190, 1, 3)
    assert mission.complete
    assert mission.accepted
    assert mission.items.x == pytest.approx([LAT * 1e-7 + k * 1e-3 for k in range(3)])
    assert mission.items.frames.sysid.tolist() == [255] * 3


def test_an_item_that_is_sent_again_counts_once() -> None:
    three = waypoints(3)
    (mission,) = found(Transfers().count(3).items([*three[:2], three[1], three[2]]).acknowledge())
    assert mission.items.seq.tolist() == [0, 1, 2]
    assert mission.again == ()


def test_an_item_that_is_sent_again_as_another_is_known() -> None:
    three = waypoints(3)
    other = {**three[1], "z": 99.0}
    (mission,) = found(Transfers().count(3).items([*three[:2], other, three[2]]).acknowledge())
    assert mission.items.z.tolist() == [20, 99, 20]
    assert mission.again == (1,)


def test_an_upload_that_begins_anew_is_another_one() -> None:
    """The count is sent again after some items: the list may have changed in between."""
    two = waypoints(2, z=50.0)
    first, second = found(Transfers().count(2).items(waypoints(1)).upload(two))
    assert (len(first.items), first.answer) == (1, None)
    assert second.items.z.tolist() == [50, 50]
    assert second.again == ()


def test_a_count_that_nobody_answered_is_no_mission() -> None:
    (mission,) = found(Transfers().count(2).count(2).count(2).items(waypoints(2)).acknowledge())
    assert mission.complete


def test_what_is_heard_over_two_links_is_heard_once() -> None:
    recording = Transfers().count(2).again().items(waypoints(1)).again(2).again()
    recording.items(waypoints(2)[1:]).again().acknowledge().again().again(3)
    (mission,) = found(recording)
    assert mission.items.seq.tolist() == [0, 1]
    assert mission.accepted


def test_an_item_out_of_turn_does_not_end_it() -> None:
    recording = Transfers().count(2).items(waypoints(2)[1:]).acknowledge(OUT_OF_TURN)
    (mission,) = found(recording.items(waypoints(2)).acknowledge())
    assert mission.complete
    assert mission.accepted


def test_two_vehicles_and_two_kinds_at_once() -> None:
    recording = Transfers().count(1).count(1, OTHER).count(1, kind=1)
    recording.items(waypoints(1, z=1.0)).items(waypoints(1, z=2.0), OTHER)
    recording.items(waypoints(1, z=3.0), kind=1)
    recording.acknowledge(kind=1).acknowledge(ERROR, OTHER).acknowledge()
    missions = {(m.target, m.mission_type): (m.items.z[0], m.answer) for m in found(recording)}
    assert missions == {(1, 0): (1, ACCEPTED), (2, 0): (2, ERROR), (1, 1): (3, ACCEPTED)}


def test_lost_frames() -> None:
    recording = Transfers().upload(waypoints(4))
    del recording.frames[2]
    (mission,) = found(recording)
    assert not mission.complete
    assert mission.items.seq.tolist() == [0, 2, 3]


def test_a_lost_beginning() -> None:
    recording = Transfers().upload(waypoints(3))
    del recording.frames[0]
    (mission,) = found(recording)
    assert mission.count is None
    assert not mission.complete
    assert mission.items.seq.tolist() == [0, 1, 2]


def test_a_target_of_guided_flight_is_no_mission() -> None:
    assert not found(Transfers().items(waypoints(1, current=2)))


def test_a_part() -> None:
    to = {"target_system": 1, "target_component": 1}
    recording = Transfers().alive().upload(waypoints(4))
    recording.say("MISSION_WRITE_PARTIAL_LIST", STATION, start_index=1, end_index=2, **to)
    recording.items(waypoints(3, z=80.0)[1:]).acknowledge()
    whole, part = found(recording)
    assert (part.partial, part.first, part.count, part.complete) == (True, 1, 2, True)
    ledger = Ledger(lambda sender: sender == 257).enter([part, whole])
    assert ledger.held[1, 0].items.z.tolist() == [20, 80, 80, 20]


def test_what_a_vehicle_holds() -> None:
    to = {"target_system": 1, "target_component": 1}
    recording = Transfers().upload(waypoints(3))
    assert held(recording) == {(1, 0): ("uploaded", 3, [0, 1, 2])}
    recording.count(2).items(waypoints(1)).acknowledge(ERROR)
    assert held(recording) == {(1, 0): ("not known", 0, [])}
    recording.download(waypoints(3))
    assert held(recording) == {(1, 0): ("read back", 3, [0, 1, 2])}
    recording.say("MISSION_CLEAR_ALL", STATION, mission_type=255, **to)
    back = {"target_system": 255, "target_component": 190, "mission_type": 255}
    recording.say("MISSION_ACK", VEHICLE, type=ACCEPTED, **back)
    assert held(recording) == {(1, 0): ("cleared", 0, [])}


def test_a_readback_is_beside_what_was_sent() -> None:
    recording = Transfers().upload(waypoints(2)).download(waypoints(2)).download(waypoints(1))
    readbacks = Ledger(lambda sender: sender == 257).enter(found(recording)).readbacks
    assert [pair.before.known for pair in readbacks] == ["uploaded", "read back"]
    assert [len(pair.mission.items) for pair in readbacks] == [2, 1]


def test_many_open_at_once_are_bounded() -> None:
    """Whoever opens transfers without end loses the oldest; nothing grows."""
    recording = Transfers()
    for system in range(1, 101):
        recording.count(2, (system, 1)).items(waypoints(1), (system, 1))
    assert sorted(mission.target for mission in found(recording)) == list(range(1, 101))


@settings(max_examples=30, deadline=None)
@given(cuts=st.lists(st.integers(0, 1200), max_size=10))
def test_cuts(cuts: list[int]) -> None:
    recording = Transfers().count(3).items(waypoints(2)).upload(waypoints(3, z=5.0))
    recording.upload(waypoints(2), kind=1).download(waypoints(3))

    def shown(missions: list[Mission]) -> list[tuple[object, ...]]:
        values = [(m.sender, m.mission_type, m.count, m.answer, m.ended) for m in missions]
        return [(*v, np.array(m.items.z).tolist()) for v, m in zip(values, missions, strict=True)]

    assert shown(found(recording, cuts)) == shown(found(recording))
