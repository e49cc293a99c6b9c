"""What is known of a link at one moment, for a screen."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from mavframecheck.engine.episodes import Episode, Key
from mavframecheck.engine.live.news import QUIET_S
from mavframecheck.engine.live.watched import Watched
from mavframecheck.model.live import Place, Standing, View
from mavframecheck.vehicle.origins import Registry

RESIDUAL = "left"
"""What a fit of motion left over, in the evidence of a finding."""
MOST_RESIDUALS = 24


class Eye:
    """Looks at a link again and again, and remembers how residuals went."""

    def __init__(self) -> None:
        """Start with nothing seen."""
        self._residuals: dict[Key, deque[float]] = {}

    def look(self, watched: Watched, now: float) -> View:
        """Return what is known of a link at `now`, s since 1970."""
        reading = watched.session.reading
        senders = watched.pulse.senders(now)
        vehicles = ((each, each.sysid * 256 + each.compid) for each in reading.vehicles())
        return View(
            status=watched.status(now),
            senders=tuple((each, senders[key]) for each, key in vehicles if key in senders),
            places=tuple(_places(reading.context.registry)),
            streams=tuple(watched.streams),
            findings=tuple(sorted(self._findings(watched, now), key=_rank)),
            judging=watched.session.runner.judging,
            deviations=watched.deviations,
        )

    def _findings(self, watched: Watched, now: float) -> Iterator[Standing]:
        episodes = watched.session.runner.episodes
        lasting = episodes.lasting()
        self._residuals = {k: v for k, v in self._residuals.items() if k in lasting}
        for key, episode in lasting.items():
            first, last = (_seconds_ago(mark.t_us, now) for mark in (episode.first, episode.last))
            yield Standing(
                finding=episodes.finding(episode),
                active=last < QUIET_S,
                age_s=first,
                last_s=last,
                residuals=self._trace(key, episode),
            )

    def _trace(self, key: Key, episode: Episode) -> tuple[float, ...]:
        left = episode.words.evidence.get(RESIDUAL)
        if not isinstance(left, float):
            return ()
        trace = self._residuals.setdefault(key, deque(maxlen=MOST_RESIDUALS))
        trace.append(left)
        return tuple(trace)


def _seconds_ago(t_us: int | None, now: float) -> float:
    return 0.0 if t_us is None else max(0.0, now - t_us * 1e-6)


def _rank(standing: Standing) -> tuple[bool, int, float]:
    return not standing.active, -standing.finding.severity.rank, standing.last_s


def _places(registry: Registry) -> Iterator[Place]:
    """Yield home and origin of each vehicle as they stand."""
    for system in registry.systems:
        homes = [home for home in registry.homes if home.system == system]
        if homes:
            home = homes[-1]
            by = "HOME_POSITION" if home.asked_by is None else _asked(home.asked_by)
            yield Place(
                system=system, what="home", source=by, moves=len(homes) - 1, **home.at._asdict()
            )
        origin = registry.in_force(system)
        if origin is not None:
            by = origin.source if origin.asked_by is None else _asked(origin.asked_by)
            moves = len(registry.of(system)) - 1
            yield Place(system=system, what="origin", source=by, moves=moves, **origin.at._asdict())


def _asked(sender: int) -> str:
    return f"asked by {sender >> 8}/{sender & 0xFF}"
