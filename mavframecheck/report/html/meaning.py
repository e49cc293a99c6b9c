"""The semantic map of a recording as rows of a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from mavframecheck.model.survey import FileSurvey, StreamSurvey, ViewSurvey
from mavframecheck.report.escape import sentence
from mavframecheck.report.fields import is_spatial, meaning, refers_to, values
from mavframecheck.report.survey import often

MOST_ROWS = 3000
"""Rows that a page lists; a hostile recording has more."""


class Row(NamedTuple):
    """One field of one view of a message of a sender."""

    sender: str
    message: str
    rate: str
    when: str
    field: str
    means: str
    refers: str
    came: str


def rows(survey: FileSurvey) -> list[Row]:
    """Return the fields about place, attitude, time and frames, the first `MOST_ROWS` of them."""
    found: list[Row] = []
    for row in _rows(survey):
        if len(found) == MOST_ROWS:
            break
        found.append(row)
    return found


def _rows(survey: FileSurvey) -> Iterator[Row]:
    labels = {each.name: each.label for each in survey.references}
    labels |= {each.name: each.label for each in survey.heights}
    for sender in survey.senders:
        who = f"{sender.sysid}/{sender.compid}"
        for stream in sender.streams:
            for view in stream.views:
                yield from _fields(who, stream, view, labels)


def _fields(
    who: str, stream: StreamSurvey, view: ViewSurvey, labels: dict[str, str]
) -> Iterator[Row]:
    chosen = ", ".join(f"{n} {each.words or each.value}" for n, each in view.selectors.items())
    for field in view.fields:
        if is_spatial(field) and field.name not in view.selectors:
            yield Row(
                who,
                stream.message,
                often(stream),
                sentence(", ".join(filter(None, (chosen, *field.when)))),
                field.name,
                meaning(field),
                refers_to(field, labels, "")[0],
                "; ".join(values(field)),
            )
