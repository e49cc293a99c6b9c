"""Frames to columns: every message that pymavlink writes reads back as pymavlink reads it."""

from __future__ import annotations

import math
import random
import struct
from typing import Any, Literal

import fastcrc
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mavframecheck.wire import Table
from mavframecheck.wire.crc import WORD, crc16, crc16_of_ranges
from mavframecheck.wire.encode import encode_frame, encode_payload
from tests.strategies import (
    DIALECT,
    MESSAGES,
    attitude,
    blank,
    frame,
    link,
    packed,
    read,
    record,
    shape,
    zero,
)

LIMITS = {
    "char": (0, 255),
    "int8_t": (-(2**7), 2**7 - 1),
    "uint8_t": (0, 2**8 - 1),
    "int16_t": (-(2**15), 2**15 - 1),
    "uint16_t": (0, 2**16 - 1),
    "int32_t": (-(2**31), 2**31 - 1),
    "uint32_t": (0, 2**32 - 1),
    "int64_t": (-(2**63), 2**63 - 1),
    "uint64_t": (0, 2**64 - 1),
}
ODD_FLOATS = (math.nan, math.inf, -math.inf, -0.0, 1e-45, 3.4028234663852886e38, 1.5)


def plain(kind: str) -> str:
    """Return the C type without the mark of the version field."""
    return kind.removesuffix("_mavlink_version")


def values(kind: str, count: int) -> st.SearchStrategy[Any]:
    """Return any value that a field can have, in the form that pymavlink packs."""
    if kind == "char":
        return st.binary(max_size=max(count, 1))
    if kind in {"float", "double"}:
        element: st.SearchStrategy[Any] = st.floats(width=32 if kind == "float" else 64)
    else:
        element = st.integers(*LIMITS[plain(kind)])
    return st.lists(element, min_size=count, max_size=count) if count else element


def read_one(written: bytes, name: str) -> Table:
    """Return the only message in a recording of one frame."""
    batches = read([written], stamped=False).batches
    (table,) = (batch.tables[name] for batch in batches if name in batch.tables)
    assert len(table) == 1
    return table


def same(ours: Any, theirs: Any) -> bool:
    """Compare one value of a column with that of a message of pymavlink."""
    if isinstance(theirs, bytes):
        return bool(bytes(ours) == theirs.rstrip(b"\0"))
    return np.array_equal(ours, np.asarray(theirs, np.asarray(ours).dtype), equal_nan=_real(ours))


def _real(value: Any) -> bool:
    return np.asarray(value).dtype.kind == "f"


def assert_reads_like_pymavlink(written: bytes, name: str) -> Table:
    """Assert that each field of a frame is what `MAVLink.decode` says it is."""
    message = mavlink.MAVLink(None).decode(bytearray(written))
    assert message.get_type() == name
    table = read_one(written, name)
    newer = {f.name for f in table.layout.fields} - set(message.fieldnames)
    assert not any(table[f].any() or not table.layout.by_name[f].extension for f in newer)
    for field in message.fieldnames:
        theirs = getattr(message, f"_{field}_raw", getattr(message, field))
        assert same(table[field][0], theirs), (name, field, table[field][0], theirs)
    return table


@settings(max_examples=400)
@given(
    kind=st.sampled_from(sorted(MESSAGES.values(), key=lambda m: m.id)),
    version=st.sampled_from([1, 2]),
    signed=st.booleans(),
    data=st.data(),
)
def test_any_message_with_any_values(
    kind: Any, version: int, signed: bool, data: st.DataObject
) -> None:
    """NaN, infinity, extremes, texts with and without an end; signed, truncated, of both versions."""
    version = 2 if kind.id > 255 else version
    fields = {name: data.draw(values(*shape(kind, name)), label=name) for name in kind.fieldnames}
    written = packed(kind, fields, version=version, signed=signed)
    assert_reads_like_pymavlink(written, kind.msgname)


def odd_value(kind: str, count: int, dice: random.Random) -> Any:
    """Return an extreme."""
    if kind == "char":
        return dice.randbytes(dice.randint(0, count))
    few = range(count or 1)
    if kind in {"float", "double"}:
        found: list[Any] = [dice.choice(ODD_FLOATS) for _ in few]
    else:
        found = [dice.choice(LIMITS[plain(kind)]) for _ in few]
    return found if count else found[0]


@pytest.mark.parametrize("version", [1, 2])
def test_every_message_with_extremes(version: int) -> None:
    """None of the dialect is left to chance; MAVLink 1 has no ids above 255."""
    dice = random.Random(5)
    for kind in MESSAGES.values():
        if version == 1 and kind.id > 255:
            continue
        for _ in range(3):
            fields = {n: odd_value(*shape(kind, n), dice) for n in kind.fieldnames}
            assert_reads_like_pymavlink(packed(kind, fields, version=version), kind.msgname)


def test_every_message_of_zeros() -> None:
    """All but one byte of the payload is cut off; every field is zero again."""
    for kind in MESSAGES.values():
        written = packed(kind, blank(kind))
        assert written[1] == 1
        table = assert_reads_like_pymavlink(written, kind.msgname)
        assert not any(np.any(table[field] != zero_like(table[field])) for field in kind.fieldnames)


def zero_like(column: Any) -> Any:
    """Return the zero of a column."""
    return np.zeros((), column.dtype)


def test_many_messages_of_different_lengths_in_one_table() -> None:
    """Truncation cuts each row elsewhere; nothing of the next frame leaks in."""
    texts = [b"x" * n for n in range(51)]
    stream = b"".join(
        record(frame("STATUSTEXT", {"severity": 6, "text": text}, seq=n), n)
        for n, text in enumerate(texts)
    )
    (table,) = (b.tables["STATUSTEXT"] for b in read([stream], stamped=True).batches if len(b))
    assert table["text"].tolist() == texts
    assert table["id"].tolist() == [0] * len(texts)
    assert table.frames.seq.tolist() == list(range(51))


class TestPresent:
    """Absent is not zero, and zero is not absent (law 7)."""

    def test_a_base_field_that_was_cut_off_is_zero(self) -> None:
        """Frame 0 of a global setpoint is never on the wire."""
        written = frame("SET_POSITION_TARGET_GLOBAL_INT", {"lat_int": 5, "target_system": 0})
        table = read_one(written, "SET_POSITION_TARGET_GLOBAL_INT")
        assert table.frames.length[0] < table.layout.by_name["coordinate_frame"].offset
        assert table["coordinate_frame"].tolist() == [0]
        assert table.present("coordinate_frame").tolist() == [True]

    @pytest.mark.parametrize("version", [1, 2])
    def test_an_extension_field_is_unknown_where_it_was_not_received(self, version: int) -> None:
        written = frame("GPS_RAW_INT", {"lat": 5, "alt_ellipsoid": 70_000}, version=version)
        table = read_one(written, "GPS_RAW_INT")
        assert table.present("alt_ellipsoid").tolist() == [version == 2]
        assert table.present("lat").tolist() == [True]
        assert table.present("yaw").tolist() == [False]

    def test_an_extension_field_received_in_part_is_known(self) -> None:
        """Truncation cuts the zero high bytes of a value that was given."""
        table = read_one(frame("GPS_RAW_INT", {"alt_ellipsoid": 5}), "GPS_RAW_INT")
        field = table.layout.by_name["alt_ellipsoid"]
        assert table.frames.length[0] == field.offset + 1
        assert table.present("alt_ellipsoid").tolist() == [True]
        assert table["alt_ellipsoid"].tolist() == [5]

    @given(rows=st.lists(st.tuples(st.integers(0, 2**31 - 1), st.sampled_from([1, 2])), max_size=9))
    def test_each_row_speaks_for_itself(self, rows: list[tuple[int, int]]) -> None:
        stream = b"".join(
            frame("GPS_RAW_INT", {"alt_ellipsoid": value}, seq=k, version=version)
            for k, (value, version) in enumerate(rows)
        )
        tables = [b.tables["GPS_RAW_INT"] for b in read([stream], stamped=False).batches if len(b)]
        present = [p for table in tables for p in table.present("alt_ellipsoid").tolist()]
        assert present == [version == 2 and value > 0 for value, version in rows]


class TestTables:
    """Choosing rows of tables."""

    def table(self) -> Table:
        stream = b"".join(attitude(k) + frame("HEARTBEAT", {}, seq=k) for k in range(6))
        return next(b for b in read([stream], stamped=False).batches if len(b)).tables["ATTITUDE"]

    def test_rows_keep_their_frames(self) -> None:
        taken = self.table().take(np.array([1, 4]))
        assert taken.frames.seq.tolist() == [1, 4]
        assert taken["time_boot_ms"].tolist() == [100, 400]
        assert taken.compact().take(np.array([False, True])).frames.seq.tolist() == [4]

    def test_what_a_batch_has_not(self) -> None:
        (batch, *_) = read([attitude(0)], stamped=False).batches
        assert list(batch.tables) == ["ATTITUDE"]
        assert "HEARTBEAT" not in batch.tables
        with pytest.raises(KeyError):
            batch.tables["HEARTBEAT"]

    def test_restricted_to_some_rows(self) -> None:
        stream = b"".join(attitude(k) for k in range(4))
        batch = next(b for b in read([stream], stamped=False).batches if len(b))
        batch.restrict(np.array([True, False, False, True]))
        assert batch.tables["ATTITUDE"].frames.seq.tolist() == [0, 3]


class TestCrc:
    """Checksums against two other implementations."""

    @given(st.binary(max_size=400))
    def test_of_one_text(self, data: bytes) -> None:
        assert crc16(data) == mavlink.x25crc(data).crc == fastcrc.crc16.mcrf4xx(data)

    @given(
        data=st.binary(min_size=1, max_size=600),
        ranges=st.lists(st.tuples(st.integers(0, 599), st.integers(0, 264)), max_size=20),
        seeds=st.lists(st.integers(0, 255), min_size=20, max_size=20),
    )
    def test_of_ranges(self, data: bytes, ranges: list[tuple[int, int]], seeds: list[int]) -> None:
        """Anywhere in a buffer, its very beginning included."""
        padded = np.frombuffer(data + bytes(WORD), np.uint8)
        places = [(a % len(data), n) for a, n in ranges]
        places = [(a, min(n, len(data) - a)) for a, n in places]
        found = crc16_of_ranges(
            padded,
            np.array([a for a, _ in places], np.int64),
            np.array([n for _, n in places], np.int64),
            np.array(seeds[: len(places)], np.uint8),
        )
        expected = [
            mavlink.x25crc(data[a : a + n] + bytes((seed,))).crc
            for (a, n), seed in zip(places, seeds)
        ]
        assert found.tolist() == expected

    @pytest.mark.parametrize("start", range(3))
    def test_at_the_end_of_the_buffer(self, start: int) -> None:
        """What lies behind a range is read along with it, and does not count."""
        data = bytes(range(1, 100))
        lengths = range(90)
        found = crc16_of_ranges(
            np.frombuffer(data + b"\xa5" * WORD, np.uint8),
            np.full(len(lengths), start, np.int64),
            np.array(lengths, np.int64),
            np.full(len(lengths), 50, np.uint8),
        )
        expected = [fastcrc.crc16.mcrf4xx(data[start : start + n] + b"\x32") for n in lengths]
        assert found.tolist() == expected


class TestEncode:
    """Our own writer, for examples of rules."""

    @settings(max_examples=200)
    @given(
        kind=st.sampled_from(sorted(MESSAGES.values(), key=lambda m: m.id)),
        version=st.sampled_from([1, 2]),
        data=st.data(),
    )
    def test_writes_what_pymavlink_writes(
        self, kind: Any, version: Literal[1, 2], data: st.DataObject
    ) -> None:
        """Byte for byte, except that pymavlink sends extensions in MAVLink 1 too, which the standard forbids."""
        if kind.id > 255:
            version = 2
        fields = {name: data.draw(values(*shape(kind, name))) for name in kind.fieldnames}
        layout = DIALECT.layouts[kind.id]
        if version == 1:
            fields |= {
                f.name: zero(f.type, f.length)
                for f in layout.fields
                if f.extension and f.name in fields
            }
        payload = encode_payload(layout, fields)
        ours = encode_frame(layout, payload, sysid=3, compid=4, seq=300, version=version)
        theirs = packed(kind, fields, (3, 4), 300, version)
        if version == 2:
            assert ours == theirs
        else:
            size = layout.base_length
            assert ours[2 : 6 + size] == theirs[2 : 6 + size]
            assert_reads_like_pymavlink(ours, kind.msgname)

    def test_no_such_field(self) -> None:
        with pytest.raises(KeyError, match="ATTITUDE has no field called 'rol'"):
            encode_payload(DIALECT.by_name["ATTITUDE"], {"rol": 1.0})


class TestSupplement:
    """Messages that the release of pymavlink lacks, in the wire order that PX4 sends."""

    def test_link_node_status(self) -> None:
        """Packed by hand from the definition: 64, 32, 16, then 8 bits."""
        layout = DIALECT.layouts[8]
        assert layout.name == "LINK_NODE_STATUS"
        payload = struct.pack("<Q5I3H2B", 9**9, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10)
        written = encode_frame(layout, payload, sysid=1, compid=1, seq=0)
        table = read_one(written, "LINK_NODE_STATUS")
        assert table["timestamp"].tolist() == [9**9]
        assert [table[n].tolist() for n in ("tx_rate", "rx_rate")] == [[1], [2]]
        assert table["messages_lost"].tolist() == [5]
        assert table["rx_parse_err"].tolist() == [6]
        assert [table[n].tolist() for n in ("tx_buf", "rx_buf")] == [[9], [10]]

    def test_all_of_them_are_known(self) -> None:
        assert {8, 380, 410, 411, 436} <= set(DIALECT.layouts)
        assert not {8, 380, 410, 411, 436} & set(MESSAGES)


def test_link_of_the_tests_signs() -> None:
    """The tests above rest on signed frames being signed."""
    assert attitude(signed=True)[2] == 1
    assert len(attitude(signed=True)) == len(attitude()) + 13
    assert link(signed=True).signing.sign_outgoing
