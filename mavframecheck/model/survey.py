"""What `inspect` found: who speaks, and what each number of each message means."""

from __future__ import annotations

import msgspec

from mavframecheck.model.finding import FileSummary, Vehicle
from mavframecheck.semantics.references import HeightReference, Reference


class ValueCount(msgspec.Struct, frozen=True, kw_only=True):
    """How often a selector, a mask or an instance had one value."""

    value: int | str
    """As on the wire."""
    words: str | None
    """What it says: the entry of the enumeration, or the bits of the mask in words."""
    count: int


class SentinelCount(msgspec.Struct, frozen=True, kw_only=True):
    """How often a field held a code in the place of a measurement."""

    code: str
    """``NaN``, ``65535``, ``< 0``."""
    meaning: str
    """``unknown``, ``north``..."""
    count: int
    """Elements; of all values of the field, see `FieldSurvey.values`."""


class ReferenceCount(msgspec.Struct, frozen=True, kw_only=True):
    """A reference of a field, and how many messages had it."""

    reference: str
    """Name of a `Reference` or a `HeightReference` of the file."""
    count: int


class FieldSurvey(msgspec.Struct, frozen=True, kw_only=True):
    """One field, in one view of its message."""

    name: str
    when: tuple[str, ...]
    """Conditions on other fields under which it means this: ``param4 = 1``."""
    quantity: str | None
    """What it measures; None where the catalogue has no meaning for it."""
    unit: str
    """Unit on the wire."""
    si_unit: str | None
    """Unit of `minimum` and `maximum`; None: they are as on the wire."""
    frames: tuple[ReferenceCount, ...]
    """Frames of the values that count, most used first."""
    heights: tuple[ReferenceCount, ...]
    """Height references of the values that count, most used first."""
    axis: str | None
    positive: str | None
    """Which way it grows."""
    point: str | None
    """The physical point it belongs to: ``antenna``, ``home``..."""
    clock: str | None
    """Clock domain of a stamp."""
    clock_seen: str | None
    """What an ``ambiguous`` stamp was by its size: ``boot``, ``unix`` or ``mixed``."""
    extension: bool
    """Whether it is an extension field, which a sender may leave out."""
    mask: str | None
    """The field whose bit says whether this one counts."""
    count: int
    """Messages."""
    present: int
    """Messages in which the sender gave it."""
    used: int
    """Messages in which, besides, its mask lets it count."""
    values: int
    """Numbers in the used messages: an array has several in each."""
    nan: int
    """Values that are NaN, sentinels included."""
    infinite: int
    sentinels: tuple[SentinelCount, ...]
    """The codes that its meaning knows, those that never came included."""
    minimum: float | None
    """Smallest value that is a measurement (no code, not ignored); SI, lat and lon in degrees."""
    maximum: float | None
    seen: tuple[ValueCount, ...]
    """Values of a selector, mask or instance, most frequent first."""
    seen_others: int
    """Messages with values beyond the first 32 different ones."""


class ViewSurvey(msgspec.Struct, frozen=True, kw_only=True):
    """The messages of a stream that mean the same: of one command, in one frame..."""

    selectors: dict[str, ValueCount]
    """Field to value that all these messages share; empty where nothing selects."""
    count: int
    fields: tuple[FieldSurvey, ...]


class StreamSurvey(msgspec.Struct, frozen=True, kw_only=True):
    """One message of one sender."""

    message: str
    msgid: int
    count: int
    rate_hz: float | None
    """Messages per second of receive time, pauses left out; None without stamps or below 5 messages."""
    instance_field: str | None
    """The field that tells several sensors apart."""
    instances: tuple[ValueCount, ...]
    views: tuple[ViewSurvey, ...]
    """Most frequent first."""
    views_others: int
    """Messages of views beyond the first 32, or in a stream beyond the first 64 with views: counted only."""


class SenderSurvey(Vehicle, frozen=True, kw_only=True):
    """A component, who it says it is, and what it sent."""

    streams: tuple[StreamSurvey, ...]
    """By name."""


class FileSurvey(FileSummary, frozen=True, kw_only=True):
    """The semantic map of one recording."""

    senders: tuple[SenderSurvey, ...]
    references: tuple[Reference, ...]
    """What the names in `FieldSurvey.frames` mean."""
    heights: tuple[HeightReference, ...]
    """What the names in `FieldSurvey.heights` mean."""
