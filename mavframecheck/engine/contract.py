"""Contracts: what a recording shows that a system sends, and how another one differs from it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import msgspec

from mavframecheck.model.contract import Aspect, Contract, Deviation, Terms
from mavframecheck.model.survey import FieldSurvey, ReferenceCount, SenderSurvey, StreamSurvey
from mavframecheck.sources import SourceError

ALWAYS = ("HEARTBEAT",)
"""Messages that belong into a contract although they say nothing of place or time."""


def read_contract(path: Path) -> Contract:
    """Return the contract in a TOML file; SourceError names what is wrong with it."""
    try:
        return msgspec.convert(tomllib.loads(path.read_text("utf-8")), Contract)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise SourceError(
            f"{path}: this is no contract of 'inspect --contract': {error}"
        ) from error


def terms(senders: Iterable[SenderSurvey]) -> list[Terms]:
    """Return the terms of every stream of a survey, by sender and message."""
    return [_terms(sender, stream) for sender in senders for stream in sender.streams]


def worth_keeping(streams: Iterable[Terms]) -> list[Terms]:
    """Return the streams for a contract: those that run, and say something of place or time."""
    return [
        each
        for each in streams
        if each.rate_hz is not None
        and (each.frames or each.heights or each.clocks or each.message in ALWAYS)
    ]


def _terms(sender: SenderSurvey, stream: StreamSurvey) -> Terms:
    fields = [field for view in stream.views for field in view.fields if field.used]
    return Terms(
        sender=f"{sender.sysid}/{sender.compid}",
        message=stream.message,
        rate_hz=stream.rate_hz,
        frames=_names(field.frames for field in fields),
        heights=_names(field.heights for field in fields),
        clocks=tuple(sorted({_clock(field) for field in fields if field.clock and _given(field)})),
    )


def _names(counts: Iterable[tuple[ReferenceCount, ...]]) -> tuple[str, ...]:
    return tuple(sorted({each.reference for each in chain.from_iterable(counts)}))


def _clock(field: FieldSurvey) -> str:
    return f"{field.name}: {field.clock_seen or field.clock}"


def _given(field: FieldSurvey) -> bool:
    return field.maximum is not None


def deviations(contract: Contract, found: Iterable[Terms]) -> Iterator[Deviation]:
    """Yield where the streams `found` differ from `contract`, in its order; newcomers come last."""
    by_key = {each.key: each for each in found}
    for wanted in contract.stream:
        seen = by_key.get(wanted.key)
        if seen is None:
            yield _deviation("missing", wanted, _rate(wanted.rate_hz), "nothing")
        else:
            yield from _differences(wanted, seen, contract.rate_within)
    agreed = {each.key for each in contract.stream}
    for seen in worth_keeping(by_key.values()):
        if seen.key not in agreed:
            yield _deviation("unexpected", seen, "nothing", _rate(seen.rate_hz))


def _differences(wanted: Terms, seen: Terms, within: float) -> Iterator[Deviation]:
    aspects: tuple[Aspect, ...] = ("frames", "heights", "clocks")
    for what in aspects:
        expected, observed = getattr(wanted, what), getattr(seen, what)
        if expected and sorted(expected) != sorted(observed):
            yield _deviation(what, wanted, ", ".join(expected), ", ".join(observed) or "none")
    if (
        wanted.rate_hz
        and seen.rate_hz
        and not (wanted.rate_hz / within <= seen.rate_hz <= wanted.rate_hz * within)
    ):
        yield _deviation("rate", wanted, _rate(wanted.rate_hz), _rate(seen.rate_hz))


def _deviation(what: Aspect, stream: Terms, expected: str, observed: str) -> Deviation:
    return Deviation(
        what=what,
        sender=stream.sender,
        message=stream.message,
        expected=expected,
        observed=observed,
    )


def _rate(rate_hz: float | None) -> str:
    return "any rate" if rate_hz is None else f"{rate_hz:.3g} Hz"
