"""What is new about the findings of a link, compared with what was said last."""

from __future__ import annotations

from dataclasses import dataclass

from mavframecheck.engine.episodes import GAP_US, Episode, Episodes, Key
from mavframecheck.model import Finding
from mavframecheck.model.live import Change, What

UPDATE_S = 5.0
"""A finding that goes on is said again after so long (s of receive time)."""
QUIET_S = GAP_US * 1e-6
"""A finding without a hit for so long (s) has ended: what comes later may be another episode."""


@dataclass(slots=True)
class _Said:
    """What was last said of an episode."""

    finding: Finding
    count: int
    time: float
    ended: bool = False


class FindingNews:
    """Remembers what was said of every episode of a link."""

    def __init__(self, link: str, episodes: Episodes) -> None:
        """Report on `episodes` of the link called `link`."""
        self._link = link
        self._episodes = episodes
        self._said: dict[Key, _Said] = {}

    def since(self, now: float) -> list[Change]:
        """Return the changes since the last call; `now` is the time of the newest message, s since 1970."""
        lasting = self._episodes.lasting()
        changes = [
            self._change("withdrawn", now, self._said.pop(key).finding)
            for key in [key for key in self._said if key not in lasting]
        ]
        for key, episode in lasting.items():
            what = _what(self._said.get(key), episode, now)
            if what is not None:
                finding = self._episodes.finding(episode)
                self._said[key] = _Said(finding, episode.count, now, ended=what == "ended")
                changes.append(self._change(what, now, finding))
        return changes

    def _change(self, what: What, now: float, finding: Finding) -> Change:
        return Change(what=what, time=now, link=self._link, finding=finding)


def _what(said: _Said | None, episode: Episode, now: float) -> What | None:
    """Return what is to be said of an episode, None where nothing is."""
    if said is None:
        return "found"
    if episode.words.severity.rank > said.finding.severity.rank:
        return "worse"
    if episode.count != said.count and (said.ended or now - said.time >= UPDATE_S):
        return "resumed" if said.ended else "updated"
    last_us = episode.last.t_us
    over = last_us is not None and now - last_us * 1e-6 >= QUIET_S
    return "ended" if over and not said.ended else None
