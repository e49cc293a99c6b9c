"""Hits to findings: consecutive hits of one rule on one stream are one episode."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mavframecheck.engine.compiled import CompiledRule
from mavframecheck.model import (
    ByteLocation,
    Evidence,
    Finding,
    MissionLocation,
    Persist,
    Severity,
    Subject,
)
from mavframecheck.wire import Frames, Place

if TYPE_CHECKING:
    from mavframecheck.model.trace import Figure

MAX_EPISODES = 50
"""Episodes per rule and stream; what comes after counts into the last one."""
MAX_STREAMS = 4096
"""Streams of one message in which a rule tells episodes apart; further ones are not reported."""
GAP_US = 10_000_000
"""Hits further apart than this (us), with rows in between that were right, are two episodes."""

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Key: TypeAlias = tuple[str | int | None, ...]
"""Names an episode among all of a recording."""
Locate = Callable[[int, str | None], MissionLocation]
"""Says where in a mission file a frame number, and a field of it, stand."""


class Words(NamedTuple):
    """What is said about the first, or worst, hit of an episode."""

    severity: Severity
    text: str
    fix: str
    evidence: Evidence
    related: tuple[str, ...] = ()


class Judged(NamedTuple):
    """Rows that a rule looked at; arrays are (n,)."""

    stream: Ints
    """Which rows follow each other: sender, target and instance as one number."""
    frames: Frames
    hit: Bools
    badness: npt.NDArray[np.float64]
    """How bad each hit is; the worst one of an episode gives the words."""
    subject: Callable[[int], Subject]
    """Subject of the row at a place."""
    describe: Callable[[int], Words]
    """Words for the hit at a place."""
    timeless: bool = False
    """Whether nothing says how far apart rows are: then a row that is right ends an episode."""
    figures: Callable[[int], tuple[Figure, ...]] = lambda _: ()
    """Drawings of a stream, once the recording is read."""


@dataclass(slots=True)
class Episode:
    """Hits of one rule on one stream that belong together."""

    rule: CompiledRule
    subject: Subject
    first: Place
    last: Place
    words: Words
    badness: float = 0.0
    count: int = 1
    judged: int = 1
    """Rows judged from the first hit to the last."""
    since: int = 0
    """Rows judged and found right since the last hit."""
    figures: Callable[[], tuple[Figure, ...]] = tuple
    """Draws what proves it."""

    @property
    def lasts(self) -> bool:
        """Whether the episode is as long and dense as its rule asks."""
        persist: Persist = self.rule.rule.detect.persist
        seconds = 0.0
        if self.first.t_us is not None and self.last.t_us is not None:
            seconds = (self.last.t_us - self.first.t_us) / 1e6
        return (
            self.count >= persist.count
            and seconds >= persist.seconds
            and self.count >= persist.share * self.judged
        )


@dataclass(slots=True)
class _Stream:
    """The episodes of one rule on one stream, the open one last."""

    episodes: list[Episode] = field(default_factory=list)


class Episodes:
    """Collects hits into episodes, and episodes into findings."""

    def __init__(self, file: str, locate: Locate | None = None) -> None:
        """Collect for the recording called `file`, or, with `locate`, for a mission file."""
        self._file = file
        self._locate = locate
        self._streams: dict[tuple[str, str, str | None], dict[int, _Stream]] = {}
        self._observed: dict[str, list[Episode]] = {}

    def follows(self, code: str, message: str, label: str | None) -> bool:
        """Return whether a rule has had hits on a message, so that rows without one matter too."""
        return (code, message, label) in self._streams

    def collect(self, rule: CompiledRule, message: str, label: str | None, judged: Judged) -> None:
        """Add rows in frame order; rows of one stream must come in the order in which they were sent."""
        streams = self._streams.setdefault((rule.rule.code, message, label), {})
        judged = judged._replace(timeless=self._locate is not None)
        hits = np.flatnonzero(judged.hit)
        named = judged.stream[hits]
        begun = named[np.append(True, named[1:] != named[:-1])[: len(named)]].tolist()
        fresh = [stream for stream in dict.fromkeys(begun) if stream not in streams]
        for stream in fresh[: MAX_STREAMS - len(streams)]:
            streams[stream] = _Stream()
        order = np.argsort(judged.stream, kind="stable")
        edges = np.flatnonzero(np.diff(judged.stream[order])) + 1
        for places in np.split(order, edges):
            episodes = streams.get(int(judged.stream[places[0]]))
            if episodes is not None:
                _extend(episodes, rule, judged, places)

    def observe(self, code: str, episodes: list[Episode]) -> None:
        """Take the episodes that the Python check of a rule put together, instead of those before."""
        self._observed[code] = episodes

    def lasting(self) -> dict[Key, Episode]:
        """Return the episodes that last; one that goes on keeps its key."""
        collected = (
            ((*group, stream, e.first.number), e)
            for group, streams in self._streams.items()
            for stream, each in streams.items()
            for e in each.episodes
        )
        observed = (
            ((code, str(e.subject), place), e)
            for code, episodes in self._observed.items()
            for place, e in enumerate(episodes)
        )
        return {key: e for key, e in chain(collected, observed) if e.lasts}

    def findings(self) -> list[Finding]:
        """Return the findings of all episodes that last."""
        return [self.finding(each) for each in self.ordered()]

    def ordered(self) -> list[Episode]:
        """Return all episodes that last, in order of their first frame."""
        return sorted(
            self.lasting().values(),
            key=lambda e: (e.first.number, e.rule.rule.code, str(e.subject)),
        )

    def finding(self, episode: Episode) -> Finding:
        """Return an episode as a finding."""
        return _finding(episode, self._file, self._locate)


def _extend(stream: _Stream, rule: CompiledRule, judged: Judged, places: Ints) -> None:
    """Continue the episodes of `stream` with its rows at `places`."""
    ranks = np.flatnonzero(judged.hit[places])
    done = 0
    for near in _runs(judged, places, ranks):
        full = len(stream.episodes) >= MAX_EPISODES
        run = ranks[np.searchsorted(ranks, near[0]) :] if full else near
        right_before = int(run[0]) - done + (stream.episodes[-1].since if stream.episodes else 0)
        length = int(run[-1] - run[0]) + 1
        _add_run(stream, rule, judged, places[run], right_before, length)
        done = int(run[-1]) + 1
        if done > ranks[-1]:
            break
    if stream.episodes:
        stream.episodes[-1].since += len(places) - done


def _runs(judged: Judged, places: Ints, ranks: Ints) -> list[Ints]:
    """Split hits (at `ranks` of `places`) where right rows and a long time lie in between."""
    if not len(ranks):
        return []
    t_us, valid = judged.frames.t_us[places[ranks]], judged.frames.t_valid[places[ranks]]
    apart = valid[1:] & valid[:-1] & (np.abs(np.diff(t_us)) > GAP_US)
    apart = (np.diff(ranks) > 1) & (apart | judged.timeless)
    return np.split(ranks, np.flatnonzero(apart) + 1)


def _add_run(
    stream: _Stream,
    rule: CompiledRule,
    judged: Judged,
    hits: Ints,
    right_before: int,
    length: int,
) -> None:
    """Add a run of hits, within `length` rows and after `right_before` right ones, to a stream's episodes."""
    first, last = judged.frames.place(int(hits[0])), judged.frames.place(int(hits[-1]))
    worst = int(hits[np.argmax(judged.badness[hits])])
    badness = float(judged.badness[worst])
    current = stream.episodes[-1] if stream.episodes else None
    full = len(stream.episodes) >= MAX_EPISODES
    goes_on = current is not None and (
        right_before == 0 if judged.timeless else _continues(current, first, right_before)
    )
    if current is not None and (full or goes_on):
        current.judged += right_before + length
        current.count += len(hits)
        current.last = last
        current.since = 0
        if badness > current.badness:
            current.badness, current.words = badness, judged.describe(worst)
        return
    if current is not None and not current.lasts:
        stream.episodes.pop()
    stream.episodes.append(
        Episode(
            rule=rule,
            subject=judged.subject(int(hits[0])),
            first=first,
            last=last,
            words=judged.describe(worst),
            badness=badness,
            count=len(hits),
            judged=length,
            figures=functools.partial(judged.figures, int(judged.stream[hits[0]])),
        )
    )


def _continues(episode: Episode, first: Place, right_before: int) -> bool:
    """Return whether a hit belongs to `episode`: no right row in between, or no long time."""
    if right_before == 0:
        return True
    if episode.last.t_us is None or first.t_us is None:
        return True
    return abs(first.t_us - episode.last.t_us) <= GAP_US


def _finding(episode: Episode, file: str, locate: Locate | None) -> Finding:
    rule, subject, words = episode.rule.rule, episode.subject, episode.words
    location: ByteLocation | MissionLocation = ByteLocation(
        episode.first.offset, episode.first.size
    )
    item = ""
    if locate is not None:
        location = locate(episode.first.number, subject.field)
        subject = Subject(None, None, subject.message, subject.field)
        item = f"{location.item} {location.command}"
    return Finding(
        code=rule.code,
        name=rule.name,
        severity=words.severity,
        confidence=rule.confidence,
        file=file,
        subject=str(subject),
        sysid=subject.sysid,
        compid=subject.compid,
        message_name=subject.message,
        field=subject.field,
        time_first=_seconds(episode.first),
        time_last=_seconds(episode.last),
        utc_first=_utc(episode.first),
        utc_last=_utc(episode.last),
        count=episode.count,
        location=location,
        related=words.related,
        fingerprint=fingerprint(rule.code, subject, item),
        evidence=words.evidence,
        text=words.text,
        fix=words.fix,
    )


def fingerprint(code: str, subject: Subject, item: str = "") -> str:
    """Return a key that is the same for the same mistake of the same stream in another recording.

    In a mission file it is of the same `item` in another version of the file.
    """
    words = "|".join(filter(None, (code, str(subject), item)))
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def _seconds(place: Place) -> float | None:
    return None if place.t_us is None else place.t_us * 1e-6


def _utc(place: Place) -> str | None:
    if place.t_us is None:
        return None
    return (
        datetime.fromtimestamp(place.t_us * 1e-6, UTC)
        .isoformat(timespec="milliseconds")
        .replace("+00:00", "Z")
    )
