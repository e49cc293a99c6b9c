"""TIMESYNC: who asks, who answers."""

from __future__ import annotations

from mavframecheck.vehicle.clocks import ClockBook
from mavframecheck.wire import read_batches
from mavframecheck.wire.encode import encode_frame, encode_payload, stamped
from tests.strategies import DIALECT, chunks, cut

VEHICLE, COMPANION = (1, 1), (1, 191)
LAYOUT = DIALECT.by_name["TIMESYNC"]


def said(sender: tuple[int, int], tc1: int, ts1: int) -> bytes:
    payload = encode_payload(LAYOUT, {"tc1": tc1, "ts1": ts1})
    frame = encode_frame(LAYOUT, payload, sysid=sender[0], compid=sender[1], seq=0)
    return stamped(frame, 1_750_000_000_000_000)


def book_of(data: bytes, cuts: tuple[int, ...] = ()) -> ClockBook:
    book = ClockBook()
    for batch in read_batches(chunks(cut(data, cuts)), DIALECT, stamped=True):
        book.update(batch)
    return book


EXCHANGE = b"".join(
    (
        said(VEHICLE, 0, 5_000_000_001),
        said(COMPANION, 7_000_500_000, 5_000_000_001),
        said(VEHICLE, 0, 6_000_000_001),
        said(COMPANION, 8_000_200_000, 6_000_000_001),
        said(COMPANION, 0, 8_100_000_000),
        said(VEHICLE, 6_100_300_000, 8_100_000_000),
        said(COMPANION, 9_000_000_000, 4_444),
    )
)


def test_both_directions() -> None:
    exchanges = book_of(EXCHANGE).exchanges
    assert exchanges.asked == {257: 2, 447: 1}
    answered = exchanges.pairs[257, 447]
    assert (answered.answers, answered.ahead_ns) == (2, 2_000_199_999)
    assert exchanges.pairs[447, 257].ahead_ns == -1_999_700_000
    assert exchanges.strange == {447: 1}


def test_cut_anywhere() -> None:
    whole = book_of(EXCHANGE).exchanges
    for place in range(0, len(EXCHANGE), 7):
        exchanges = book_of(EXCHANGE, (place,)).exchanges
        assert (exchanges.asked, exchanges.pairs) == (whole.asked, whole.pairs)
