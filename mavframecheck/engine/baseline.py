"""The baseline: findings that were there when somebody began to look, so that only new ones count.

An entry is keyed by rule and stream, not by bytes or names of recordings: it holds in every other
recording of the same system. A finding in a mission file is keyed by file and item as well.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import msgspec

from mavframecheck.engine.settings import SettingsError
from mavframecheck.model import FileReport, Finding, MissionLocation, Severity, Subject, Suppressed

VERSION = 1
Key: TypeAlias = tuple[str, str, str, int | None]


class Entry(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A known finding."""

    rule: str
    name: str
    stream: str
    severity: Severity
    """The worst that is known: what is worse is new."""
    file: str = ""
    """Of a mission: a recording is made again, a mission is not."""
    item: int | None = None
    reason: str = ""
    """Why it is accepted; kept when the baseline is written again."""

    @property
    def key(self) -> Key:
        """What tells entries apart."""
        return self.rule, self.stream, self.file, self.item


@dataclass
class Judged:
    """What a run has looked at: only there can something be missing."""

    codes: set[str] = field(default_factory=set)
    """Rules that judged something."""
    senders: set[str] = field(default_factory=set)
    """``1/191``, and ``1/*`` for what is about all of a system."""
    files: set[str] = field(default_factory=set)

    def add(self, file: FileReport) -> None:
        """Take in one file."""
        self.codes |= {run.code for run in file.runs if run.status == "ran"}
        for vehicle in file.vehicles:
            self.senders.add(str(Subject(vehicle.sysid, vehicle.compid)))
            self.senders.add(str(Subject(vehicle.sysid)))
        self.files.add(Path(file.path).as_posix())

    def covers(self, entry: Entry) -> bool:
        """Return whether the finding would have been seen if it were still there."""
        sender = entry.stream.partition(" ")[0] if "/" in entry.stream else ""
        return (
            entry.rule in self.codes
            and (not sender or sender in self.senders)
            and (not entry.file or entry.file in self.files)
        )


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    version: int
    entries: tuple[Entry, ...] = ()


class Baseline:
    """The entries of a baseline file, and which of them still occur."""

    def __init__(
        self, file: Path, entries: Iterable[Entry] = (), *, learning: bool = False
    ) -> None:
        """Hold `entries` of `file`; `learning` takes in every finding that it lacks."""
        self.file = file
        self._entries = {entry.key: entry for entry in entries}
        self._seen: set[Key] = set()
        self._learning = learning

    @classmethod
    def read(cls, file: Path, *, learning: bool = False) -> Baseline:
        """Return the baseline in `file`; a missing one is empty while `learning`."""
        try:
            content = msgspec.json.decode(file.read_bytes(), type=_File)
        except FileNotFoundError:
            if learning:
                return cls(file, learning=True)
            raise SettingsError(f"{file}: no such baseline; --update-baseline writes it") from None
        except OSError as error:
            raise SettingsError(f"{file}: cannot be read: {error.strerror}") from error
        except msgspec.DecodeError as error:
            raise SettingsError(f"{file}: is no baseline: {error}") from error
        if content.version != VERSION:
            raise SettingsError(f"{file}: baseline of version {content.version}, not {VERSION}")
        return cls(file, content.entries, learning=learning)

    def suppressed(self, finding: Finding) -> Suppressed | None:
        """Return a finding that is known, or None when it is new or worse than known."""
        fresh = _entry(finding)
        entry = self._entries.get(fresh.key)
        if self._learning and (entry is None or entry.severity.rank < fresh.severity.rank):
            reason = "" if entry is None else entry.reason
            entry = self._entries[fresh.key] = msgspec.structs.replace(fresh, reason=reason)
        if entry is None or entry.severity.rank < finding.severity.rank:
            return None
        self._seen.add(entry.key)
        reason = entry.reason or "in the baseline"
        return Suppressed(finding=finding, by="baseline", reason=reason)

    def remarks(self, judged: Judged) -> Iterator[str]:
        """Yield the entries that did not occur although somebody looked."""
        if self._learning:
            return
        for entry in self._stale(judged):
            stream = f" on {entry.stream}" if entry.stream else ""
            yield (
                f"{self.file}: {entry.rule}{stream} no longer occurs; --update-baseline removes it"
            )

    def write(self, judged: Judged) -> int:
        """Write what was found and what could not be judged; return the number of entries.

        The file is replaced at once, so that there is never half of one. Raises OSError.
        """
        stale = {entry.key for entry in self._stale(judged)}
        kept = sorted(
            (entry for key, entry in self._entries.items() if key not in stale),
            key=lambda entry: (*entry.key[:3], entry.item or 0),
        )
        lines = b",\n".join(b"  " + msgspec.json.encode(entry) for entry in kept)
        text = b'{"version": %d, "entries": [\n%s\n]}\n' % (VERSION, lines)
        draft = self.file.with_name(f"{self.file.name}.{os.getpid()}.tmp")
        try:
            draft.write_bytes(text)
            draft.replace(self.file)
        finally:
            draft.unlink(missing_ok=True)
        return len(kept)

    def _stale(self, judged: Judged) -> list[Entry]:
        return [
            entry
            for key, entry in self._entries.items()
            if key not in self._seen and judged.covers(entry)
        ]


def _entry(finding: Finding) -> Entry:
    mission = finding.location if isinstance(finding.location, MissionLocation) else None
    return Entry(
        rule=finding.code,
        name=finding.name,
        stream=finding.subject,
        severity=finding.severity,
        file=Path(finding.file).as_posix() if mission else "",
        item=mission.item if mission else None,
    )
