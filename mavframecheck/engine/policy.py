"""What the user has decided about findings: other severities, ignored ones, accepted ones."""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import msgspec

from mavframecheck.engine.baseline import Baseline, Judged
from mavframecheck.model import FileReport, Finding, Suppressed
from mavframecheck.model.config import Config, Suppression


class Policy:
    """Applies the configuration and the baseline to the findings of each file, and knows what was used."""

    def __init__(
        self,
        config: Config,
        folder: Path,
        baseline: Baseline | None = None,
        today: dt.date | None = None,
    ) -> None:
        """Take `config` with its codes resolved; patterns for paths count from `folder`."""
        self._config = config
        self._folder = folder
        self._baseline = baseline
        self._today = today or dt.datetime.now(dt.UTC).date()
        self._used: set[Suppression] = set()
        self.judged = Judged()

    def apply(
        self, file: FileReport, findings: Sequence[Finding]
    ) -> tuple[tuple[Finding, ...], tuple[Suppressed, ...]]:
        """Return what counts, and what was set aside."""
        self.judged.add(file)
        counting, aside = [], []
        for finding in map(self._rated, findings):
            if self._ignored(finding):
                continue
            suppressed = self._suppressed(finding)
            if suppressed is None:
                counting.append(finding)
            else:
                aside.append(suppressed)
        return tuple(counting), tuple(aside)

    def remarks(self) -> Iterator[str]:
        """Yield what is expired or of no use, once all files are judged.

        What is about a rule that judged nothing is not called unused: it may be needed tomorrow.
        """
        for each in self._config.suppressions:
            what = f"suppression of {each.rule}{f' on {each.stream}' if each.stream else ''}"
            if self._expired(each):
                yield f"{what} expired on {each.until}; it was: {each.reason}"
            elif each not in self._used and self._was_judged(each.rule):
                yield f"{what} is not used: nothing to suppress was found; it was: {each.reason}"
        if self._baseline is not None:
            yield from self._baseline.remarks(self.judged)

    def _rated(self, finding: Finding) -> Finding:
        """Return a finding with the severity that the user gives it: the longest prefix wins."""
        table = self._config.severity
        fitting = [prefix for prefix in table if finding.code.startswith(prefix)]
        if not fitting:
            return finding
        return msgspec.structs.replace(finding, severity=table[max(fitting, key=len)])

    def _ignored(self, finding: Finding) -> bool:
        config = self._config
        return (
            any(
                self._in(finding, pattern) and finding.code.startswith(codes)
                for pattern, codes in config.per_file_ignores.items()
            )
            or finding.code.startswith(config.per_sysid_ignores.get(str(finding.sysid), ()))
            or any(
                of_stream(finding, stream) and finding.code.startswith(codes)
                for stream, codes in config.per_stream_ignores.items()
            )
        )

    def _suppressed(self, finding: Finding) -> Suppressed | None:
        for each in self._config.suppressions:
            if not self._expired(each) and self._concerns(each, finding):
                self._used.add(each)
                return Suppressed(finding=finding, by="configuration", reason=each.reason)
        if self._baseline is not None:
            return self._baseline.suppressed(finding)
        return None

    def _concerns(self, suppression: Suppression, finding: Finding) -> bool:
        return (
            finding.code.startswith(suppression.rule)
            and (suppression.stream is None or of_stream(finding, suppression.stream))
            and (suppression.file is None or self._in(finding, suppression.file))
        )

    def _expired(self, suppression: Suppression) -> bool:
        return suppression.until is not None and suppression.until < self._today

    def _was_judged(self, prefix: str) -> bool:
        return any(code.startswith(prefix) for code in self.judged.codes)

    def _in(self, finding: Finding, pattern: str) -> bool:
        """Return whether the file of a finding fits `pattern`, by its path or its name alone."""
        return any(fnmatchcase(name, pattern) for name in _names(finding.file, self._folder))


def _names(path: str, folder: Path) -> Iterable[str]:
    """Return the ways to write a path: as given, from `folder`, and its last part."""
    given, here = Path(path), Path.cwd()
    yield given.as_posix()
    if (here / given).is_relative_to(folder):
        yield (here / given).relative_to(folder).as_posix()
    yield given.name


def of_stream(finding: Finding, stream: str) -> bool:
    """Return whether a finding is about `stream`: ``1/191 ODOMETRY.q``, or the beginning of it.

    ``*`` is any text: ``*/191``, ``1/* ODOMETRY``.
    """
    subject = finding.subject
    return any(fnmatchcase(subject, stream + rest) for rest in ("", " *", ".*"))
