"""Bytes to frames to columns."""

from mavframecheck.wire.batch import Batch, batch_of, read_batches
from mavframecheck.wire.chunk import Chunk, whole
from mavframecheck.wire.damage import Ranges
from mavframecheck.wire.dialect import (
    DEFAULT_DIALECT,
    Dialect,
    DialectError,
    Field,
    Layout,
    load_dialect,
)
from mavframecheck.wire.frames import Frames, Place
from mavframecheck.wire.table import Column, Table, Tables

__all__ = [
    "DEFAULT_DIALECT",
    "Batch",
    "Chunk",
    "Column",
    "Dialect",
    "DialectError",
    "Field",
    "Frames",
    "Layout",
    "Place",
    "Ranges",
    "Table",
    "Tables",
    "batch_of",
    "load_dialect",
    "read_batches",
    "whole",
]
