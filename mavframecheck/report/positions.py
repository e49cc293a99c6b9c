"""Positions as records, one for each position of a message: CSV, JSON lines or Parquet.

`COLUMNS` is the record; every format has all of them, what is not known is empty or null. Records come in
the order of the frames, so they are the same wherever batches end.
"""

from __future__ import annotations

import csv
import io
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import import_module
from typing import Any, NamedTuple, TypeAlias

import msgspec
import numpy as np
import numpy.typing as npt

from mavframecheck.engine.positions import Extract
from mavframecheck.report.escape import utf8
from mavframecheck.semantics.positions import (
    NO_TIME,
    BodyVector,
    EcefPosition,
    GeodeticPosition,
    LocalPosition,
    ProjectedPosition,
)

Values: TypeAlias = npt.NDArray[Any]
_DEGREES, _METRES = 9, 4
"""Decimals: 0.1 mm."""


class Column(NamedTuple):
    """One column of records: `values` (n,) or (n, k), and where they are `known`, (n,)."""

    values: Values
    known: npt.NDArray[np.bool_]

    def plain(self) -> list[Any]:
        """Return Python values, None where nothing is known."""
        values: list[Any] = self.values.tolist()
        if self.values.ndim > 1:
            values = [[None if math.isnan(each) else each for each in row] for row in values]
        if self.known.all():
            return values
        return [v if k else None for v, k in zip(values, self.known.tolist(), strict=True)]


Read: TypeAlias = Callable[[Extract], Any]
"""Returns a column of an extract, one value for all of its rows, or None."""


class Field(NamedTuple):
    """A column of the record."""

    name: str
    kind: str
    """``text``, ``int``, ``float``, ``bool``, ``floats`` (a list)."""
    read: Read


def _of(*kinds: type, name: str) -> Read:
    """Return a reader of an attribute of positions of some types."""
    return lambda e: getattr(e.position, name) if isinstance(e.position, kinds) else None


def _part(place: int, *kinds: type) -> Read:
    """Return a reader of one of x, y, z."""
    xyz = _of(*kinds, name="xyz")
    return lambda e: None if xyz(e) is None else np.round(xyz(e)[:, place], _METRES)


def _degrees(name: str) -> Read:
    degrees = _of(GeodeticPosition, name=name)
    return lambda e: None if degrees(e) is None else np.round(degrees(e), _DEGREES)


def _reference(extract: Extract) -> Any:
    reference = _of(GeodeticPosition, ProjectedPosition, name="height_reference")(extract)
    return str(reference) if reference else None


def _said(name: str) -> Read:
    """Return a reader of what is said beside the numbers."""
    return lambda e: getattr(e.measured, name)


def _accuracy(name: str) -> Read:
    metres = _said(name)
    return lambda e: None if metres(e) is None else np.round(metres(e), _METRES)


def _origin_id(extract: Extract) -> Any:
    position = extract.position
    origin = position.origin if isinstance(position, LocalPosition) else None
    return None if origin is None else origin.origin_id


def _height(extract: Extract) -> Any:
    position = extract.position
    if isinstance(position, GeodeticPosition):
        return np.round(position.height_m, _METRES)
    return _part(2, ProjectedPosition)(extract)


def _covariance(extract: Extract) -> Any:
    matrices = extract.measured.covariance_m2
    return None if matrices is None else matrices.reshape(-1, 9)


def _covariance_frame(extract: Extract) -> Any:
    matrices = _covariance(extract)
    if matrices is None:
        return None
    known = np.isfinite(matrices).any(axis=1).tolist()
    return [extract.measured.covariance_frame if each else None for each in known]


_CARTESIAN = (EcefPosition, LocalPosition, BodyVector)
_EARTH = (GeodeticPosition, EcefPosition, ProjectedPosition)


def _axes(extract: Extract) -> Any:
    ecef = isinstance(extract.position, EcefPosition)
    return "ECEF" if ecef else _of(LocalPosition, BodyVector, name="axes")(extract)


FIELDS: tuple[Field, ...] = (
    Field("time_utc_ns", "int", _said("utc_ns")),
    Field("timestamp_ns", "int", _said("time_ns")),
    Field("clock", "text", lambda e: str(e.measured.clock) or None),
    Field("received_utc_ns", "int", _said("received_ns")),
    Field("source", "text", lambda e: e.measured.source),
    Field("sysid", "int", lambda e: e.sysid),
    Field("compid", "int", lambda e: e.compid),
    Field("message", "text", lambda e: e.message),
    Field("subject", "text", lambda e: e.subject or None),
    Field("instance", "int", lambda e: e.instance),
    Field("element", "int", lambda e: e.element),
    Field("representation", "text", lambda e: getattr(e.position, "representation", None)),
    Field("datum", "text", _of(*_EARTH, name="datum")),
    Field("latitude_deg", "float", _degrees("lat_deg")),
    Field("longitude_deg", "float", _degrees("lon_deg")),
    Field("height_m", "float", _height),
    Field("height_reference", "text", _reference),
    Field("frame", "text", lambda e: e.frame),
    Field("origin_id", "text", _origin_id),
    Field("axes", "text", _axes),
    Field("x_m", "float", _part(0, *_CARTESIAN)),
    Field("y_m", "float", _part(1, *_CARTESIAN)),
    Field("z_m", "float", _part(2, *_CARTESIAN)),
    Field("zone", "int", _of(ProjectedPosition, name="zone")),
    Field("hemisphere", "text", _of(ProjectedPosition, name="hemisphere")),
    Field("easting_m", "float", _part(0, ProjectedPosition)),
    Field("northing_m", "float", _part(1, ProjectedPosition)),
    Field("point_of_reference", "text", lambda e: str(e.measured.point) or None),
    Field("covariance_frame", "text", _covariance_frame),
    Field("covariance_m2", "floats", _covariance),
    Field("horizontal_accuracy_m", "float", _accuracy("horizontal_accuracy_m")),
    Field("vertical_accuracy_m", "float", _accuracy("vertical_accuracy_m")),
    Field("valid", "bool", lambda e: e.problem == ""),
    Field("problem", "text", lambda e: [text or None for text in e.problem]),
    Field("offset", "int", lambda e: e.offset),
)
COLUMNS = ("file", *(field.name for field in FIELDS))
"""Names of the columns, in order."""


class Records(NamedTuple):
    """Some records, by column."""

    columns: dict[str, Column]
    size: int

    @classmethod
    def of(cls, file: str, extracts: Sequence[Extract]) -> Records:
        """Put the extracts of a batch in the order of their frames."""
        extracts = [each for each in extracts if len(each)]
        size = sum(map(len, extracts))
        if not size:
            return cls({}, 0)
        order = np.argsort(np.concatenate([each.number for each in extracts]), kind="stable")
        name = Column(np.full(size, utf8(file), object), np.ones(size, np.bool_))
        columns = {"file": name}
        for field in FIELDS:
            parts = [_column(field, each) for each in extracts]
            values = np.concatenate([part.values for part in parts])[order]
            known = np.concatenate([part.known for part in parts])[order]
            columns[field.name] = Column(values, known)
        return cls(columns, size)


_DTYPES = {"text": object, "int": np.int64, "float": np.float64, "bool": np.bool_}


def _column(field: Field, extract: Extract) -> Column:
    """Return one column of an extract, with what its rows do not say marked as such."""
    value, size = field.read(extract), len(extract)
    if field.kind == "floats":
        flat = np.full((size, 9), np.nan) if value is None else value
        return Column(flat, np.isfinite(flat).any(axis=1))
    dtype = _DTYPES[field.kind]
    if value is None:
        return Column(np.zeros(size, dtype), np.zeros(size, np.bool_))
    values: Values = np.broadcast_to(np.asarray(value, dtype), (size,))
    if field.kind == "float":
        return Column(values + 0.0, np.isfinite(values))  # + 0.0: no negative zero
    if field.kind == "int":
        return Column(values, values != NO_TIME)
    known = np.array([each is not None for each in values]) if field.kind == "text" else None
    return Column(values, np.ones(size, np.bool_) if known is None else known)


class Writer(ABC):
    """Turns records into bytes of one format, piece by piece."""

    def head(self) -> bytes:
        """Return what comes before the first record."""
        return b""

    @abstractmethod
    def body(self, records: Records) -> bytes:
        """Return some records."""

    def foot(self) -> bytes:
        """Return what comes behind the last record."""
        return b""


class Csv(Writer):
    """RFC 4180 with line feeds: a header line, one line a record; covariances are nine numbers with spaces."""

    def head(self) -> bytes:
        """Return the names of the columns."""
        return f"{','.join(COLUMNS)}\n".encode()

    def body(self, records: Records) -> bytes:
        """Return a line for each record."""
        columns = [self._cells(name, records.columns[name]) for name in COLUMNS]
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(zip(*columns, strict=True))
        return text.getvalue().encode()

    def _cells(self, name: str, column: Column) -> list[Any]:
        plain = column.plain()
        if name == "covariance_m2":
            return [row and " ".join("nan" if v is None else str(v) for v in row) for row in plain]
        if name == "valid":
            return ["true" if each else "false" for each in plain]
        return plain


class JsonLines(Writer):
    """One JSON object a line with every key; no NaN."""

    def body(self, records: Records) -> bytes:
        """Return a line for each record."""
        columns = [records.columns[name].plain() for name in COLUMNS]
        rows = [dict(zip(COLUMNS, row)) for row in zip(*columns, strict=True)]
        return msgspec.json.Encoder().encode_lines(rows)


class Parquet(Writer):
    """Apache Parquet with typed, nullable columns; a row group for each batch."""

    def __init__(self) -> None:
        self._arrow = _arrow("pyarrow")
        self._schema = self._arrow.schema([(name, self._type(name)) for name in COLUMNS])
        self._sink = _Sink()
        self._writer = _arrow("pyarrow.parquet").ParquetWriter(self._sink, self._schema)

    def _type(self, name: str) -> Any:
        kinds = {field.name: field.kind for field in FIELDS}
        types = {
            "text": self._arrow.string(),
            "int": self._arrow.int64(),
            "float": self._arrow.float64(),
            "bool": self._arrow.bool_(),
            "floats": self._arrow.list_(self._arrow.float64()),
        }
        return types[kinds.get(name, "text")]

    def body(self, records: Records) -> bytes:
        """Return a row group."""
        arrays = [self._array(name, records.columns[name]) for name in COLUMNS]
        self._writer.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))
        return self._sink.taken()

    def _array(self, name: str, column: Column) -> Any:
        if column.values.ndim > 1:
            return self._arrow.array(column.plain(), self._type(name))
        return self._arrow.array(column.values, self._type(name), mask=~column.known)

    def foot(self) -> bytes:
        """Return the end, which tells readers where everything is."""
        self._writer.close()
        return self._sink.taken()


def _arrow(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        raise ModuleNotFoundError(
            "Parquet needs the package pyarrow: pip install 'mavframecheck[parquet]'",
            name="pyarrow",
        ) from error


class _Sink(io.RawIOBase):
    """A file that only grows, and hands over what was written."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def writable(self) -> bool:
        """Say so: pyarrow asks."""
        return True

    def write(self, piece: Any) -> int:
        """Keep a piece."""
        self._pieces.append(bytes(piece))
        self._size += len(self._pieces[-1])
        return len(self._pieces[-1])

    def tell(self) -> int:
        """Return how much was written in all."""
        return self._size

    def taken(self) -> bytes:
        """Return what was written since it was last asked for."""
        pieces, self._pieces = self._pieces, []
        return b"".join(pieces)


FORMATS: dict[str, type[Writer]] = {"csv": Csv, "jsonl": JsonLines, "parquet": Parquet}
"""Name of each format."""


def render(batches: Iterable[Records], form: str) -> Iterator[bytes]:
    """Yield records in the format called `form`."""
    writer = FORMATS[form]()
    yield writer.head()
    for records in batches:
        if records.size:
            yield writer.body(records)
    yield writer.foot()
