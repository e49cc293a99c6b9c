"""What a vehicle sends back beside what it was sent (MFC910)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mavframecheck.checks.base import Observation
from mavframecheck.checks.missions.plans import (
    REFERENCE,
    Bools,
    Floats,
    MissionCheck,
    Plan,
    Plans,
    with_height,
    with_place,
)
from mavframecheck.geo.geodesy import distance_m
from mavframecheck.missions import Items, Readback
from mavframecheck.semantics.enums import AltRef


class Differs(MissionCheck):
    """Items that a vehicle accepted, and sends back at another place, height, or with another command."""

    def judge_all(self, plans: Plans, _sent: list[Plan]) -> Iterator[Observation]:
        """Yield each download that differs from the upload before it."""
        for pair in plans.readbacks():
            yield from self._compare(pair, plans.family(pair.before.system))

    def _compare(self, pair: Readback, family: str) -> Iterator[Observation]:
        sent, back = pair.before, pair.mission
        if sent.known != "uploaded" or len(sent.items) != sent.count:
            return
        self.looked += 1
        first = 0 if sent.mission_type or family == "px4" else 1
        shared, a, b = np.intersect1d(sent.items.seq, back.items.seq, return_indices=True)
        a, b = a[shared >= first], b[shared >= first]
        one, other = sent.items.take(a), back.items.take(b)
        moved_m, lifted_m, wrong = self._differences(one, other)
        if sent.count == len(back.items) and not wrong.any():
            return
        rows = b[wrong] if wrong.any() else np.arange(len(back.items))
        if not len(rows):
            return
        yield self.observed(
            back.items,
            rows,
            {
                "sent": sent.count,
                "back": len(back.items),
                "item": int(back.items.seq[rows[0]]),
                "differ": int(wrong.sum()),
                "moved_m": float(np.nanmax(np.where(wrong, moved_m, 0), initial=0.0)),
                "lifted_m": float(np.nanmax(np.where(wrong, lifted_m, 0), initial=0.0)),
                "commands": int((one.command != other.command).sum()),
            },
        )

    def _differences(self, sent: Items, back: Items) -> tuple[Floats, Floats, Bools]:
        """Return (n,) how far items moved and rose, m, and which differ."""
        placed = with_place(sent) & (sent.command == back.command)
        moved_m = distance_m(sent.x, sent.y, back.x, back.y)
        moved = placed & (moved_m > self.params["max_move_m"])
        lifted_m = np.abs(back.z - sent.z)
        heights = placed & with_height(sent)
        above = [np.array([_level(f) for f in items.frame.tolist()]) for items in (sent, back)]
        told = (above[0] != "") & (above[1] != "")
        lifted = (lifted_m > self.params["max_lift_m"]) | (told & (above[0] != above[1]))
        return moved_m, lifted_m, moved | (heights & lifted) | (sent.command != back.command)


def _level(frame: int) -> str:
    level = REFERENCE.get(frame, AltRef.NONE)
    return level if level in (AltRef.MSL, AltRef.HOME, AltRef.TERRAIN) else ""
