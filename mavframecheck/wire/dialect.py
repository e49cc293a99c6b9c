"""Message layouts: which id has which name, fields, offsets and checksum seed.

A `Dialect` comes from one of three places: the generated file in the wheel (the default dialect, so that
nothing of pymavlink is imported or parsed), the XML that pymavlink ships (`--dialect NAME`), or a user's
own XML. Source of the rules for wire order and checksum seed: MAVLink developer guide, "Serialization".
"""

from __future__ import annotations

import difflib
import functools
import importlib.resources
import importlib.util
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

DEFAULT_DIALECT = "ardupilotmega"

NUMPY_CODES = {
    "char": "S1",
    "int8_t": "i1",
    "uint8_t": "u1",
    "uint8_t_mavlink_version": "u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
}


class DialectError(Exception):
    """A dialect that cannot be had; the text tells the user what to do."""


class Field(msgspec.Struct, frozen=True, array_like=True):
    """One field of a message on the wire."""

    name: str
    type: str
    """C type of the definition, e.g. ``int32_t``."""
    length: int
    """Elements of an array; 0 for a scalar."""
    offset: int
    """Bytes from the start of the payload."""
    extension: bool
    unit: str = ""
    """`units` of the XML, e.g. ``degE7``."""

    @property
    def format(self) -> str | tuple[str, tuple[int]]:
        """Return the numpy format of the field; text is one byte string."""
        if self.type == "char":
            return f"S{max(self.length, 1)}"
        code = NUMPY_CODES[self.type]
        return (code, (self.length,)) if self.length else code


class Layout(msgspec.Struct, frozen=True, array_like=True, dict=True):
    """One message on the wire."""

    msgid: int
    name: str
    crc_extra: int
    base_length: int
    """Payload bytes without extension fields."""
    length: int
    """Payload bytes with them."""
    fields: tuple[Field, ...]
    """In wire order."""

    @functools.cached_property
    def dtype(self) -> np.dtype[np.void]:
        """Structured type of the zero-extended payload."""
        return np.dtype(
            {
                "names": [f.name for f in self.fields],
                "formats": [f.format for f in self.fields],
                "offsets": [f.offset for f in self.fields],
                "itemsize": self.length,
            }
        )

    @functools.cached_property
    def by_name(self) -> dict[str, Field]:
        """Fields by name."""
        return {f.name: f for f in self.fields}


class Dialect:
    """All layouts of a dialect, and the dense tables that framing looks ids up in."""

    def __init__(self, name: str, layouts: tuple[Layout, ...]) -> None:
        """Index `layouts` by id and by name."""
        self.name = name
        self.layouts = {layout.msgid: layout for layout in layouts}
        self.by_name = {layout.name: layout for layout in layouts}
        size = max(self.layouts, default=0) + 2
        self.crc_extra: npt.NDArray[np.int16] = np.full(size, -1, np.int16)
        for layout in layouts:
            self.crc_extra[layout.msgid] = layout.crc_extra

    def seeds(self, msgids: npt.NDArray[np.int32]) -> npt.NDArray[np.int16]:
        """Return the checksum seed of each id, -1 where the dialect does not know it."""
        return self.crc_extra[np.minimum(msgids, self.crc_extra.size - 1)]


def load_dialect(name: str = DEFAULT_DIALECT) -> Dialect:
    """Return the dialect called `name`, or the one in the XML file at that path.

    Raises `DialectError` when there is none, or when the XML cannot be understood.
    """
    if name == DEFAULT_DIALECT:
        packed = importlib.resources.files(__package__).joinpath(f"data/{name}.json").read_bytes()
        return Dialect(name, msgspec.json.decode(packed, type=tuple[Layout, ...]))
    from mavframecheck.wire.definitions import read_definitions

    return Dialect(name, read_definitions(_definition_file(name)))


def pymavlink_definitions() -> Path:
    """Return the folder with the XML that pymavlink ships, without importing pymavlink."""
    spec = importlib.util.find_spec("pymavlink")
    if spec is None or not spec.submodule_search_locations:
        message = "pymavlink is not installed, so only the default dialect is available"
        raise DialectError(message)
    return Path(spec.submodule_search_locations[0]) / "dialects" / "v20"


def _definition_file(name: str) -> Path:
    own = Path(name)
    if own.suffix == ".xml":
        if not own.is_file():
            message = f"{own}: no such dialect file"
            raise DialectError(message)
        return own
    folder = pymavlink_definitions()
    file = folder / f"{name}.xml"
    if not file.is_file():
        known = sorted(path.stem for path in folder.glob("*.xml"))
        near = difflib.get_close_matches(name, known, n=1)
        hint = (
            f"did you mean {near[0]}?"
            if near
            else f"choose one of {', '.join(known)}, or give an XML file"
        )
        message = f"no dialect called {name!r}: {hint}"
        raise DialectError(message)
    return file
