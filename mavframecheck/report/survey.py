"""`inspect`: the semantic map of recordings, as tables for people and as JSON."""

from __future__ import annotations

from collections.abc import Iterator

from mavframecheck.model.survey import (
    FieldSurvey,
    FileSurvey,
    SenderSurvey,
    StreamSurvey,
    ValueCount,
    ViewSurvey,
)
from mavframecheck.report import Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.fields import is_spatial, meaning, refers_to, share, values
from mavframecheck.report.layout import FilePage
from mavframecheck.report.words import component, plural, what_was_read
from mavframecheck.semantics.references import Reference

_MOST_NAMED = 8
"""Instances named in the title of a message."""
_WIDEST_NAME, _WIDEST_MEANING = 24, 20
_LEGEND_COLUMN = 24


class MapPage(FilePage[FileSurvey]):
    """Writes maps for one context."""

    def __init__(self, context: Context, *, every_field: bool) -> None:
        super().__init__(context)
        self._every_field = every_field
        self._labels: dict[str, str] = {}
        self._said: set[str] = set()
        """Names of the references that the tables of a file speak of."""

    def file(self, survey: FileSurvey) -> Iterator[str]:
        """Yield the head, a section for each sender, and what the references mean."""
        self._said = set()
        self._labels = {each.name: each.label for each in survey.references}
        self._labels |= {each.name: each.label for each in survey.heights}
        yield self.bold(sentence(survey.path))
        yield from self.wrap(what_was_read(survey), "  ", "    ")
        for note in survey.notes:
            yield from self.wrap(f"note: {note}", "  ", "    ")
        senders = [sender for sender in survey.senders if sender.streams]
        if survey.messages and not senders:
            yield from self.wrap("none of the messages asked for is in it", "  ")
        for sender in senders:
            yield from self._sender(sender)
        yield from self._legend(survey)

    def _sender(self, sender: SenderSurvey) -> Iterator[str]:
        """Yield who it is, a table for each message about place or time, the others in a paragraph."""
        yield ""
        said = f"{sender.sysid}/{sender.compid} {component(sender)}"
        yield self.paint(said, "cyan") + f", {plural(sender.messages, 'message')}"
        stamped, others = [], []
        for stream in sender.streams:
            shown = [view for view in stream.views if self._shown(view)]
            if not shown:
                others.append(f"{stream.message} {often(stream)}")
            elif not self._every_field and _only_stamped(shown):
                stamped.append(f"{stream.message} {often(stream)}")
            else:
                yield ""
                yield from self._stream(stream, shown)
        yield from self._folded("of place and time only a stamp in: ", stamped)
        yield from self._folded("nothing of place or time in: ", others)

    def _folded(self, intro: str, streams: list[str]) -> Iterator[str]:
        if streams:
            yield ""
            yield from self.wrap(intro + "; ".join(streams), "  ", "    ")

    def _shown(self, view: ViewSurvey) -> list[FieldSurvey]:
        """Return the fields that get a row; a selector stands in the title already."""
        fields = [field for field in view.fields if field.name not in view.selectors]
        if self._every_field:
            return fields
        return [field for field in fields if is_spatial(field)]

    def _stream(self, stream: StreamSurvey, shown: list[ViewSurvey]) -> Iterator[str]:
        title = f"{stream.message}  {often(stream)}"
        if len(stream.views) == 1:
            title += "".join(f", {text}" for text in _selectors(shown[0]))
        first, *rest = self.wrap(title + _instances(stream), "  ", "    ")
        yield first.replace(stream.message, self.bold(stream.message), 1)
        yield from rest
        indent = "    " if len(stream.views) == 1 else "      "
        for view in shown:
            if len(stream.views) > 1:
                words = ", ".join(_selectors(view))
                yield from self.wrap(f"{words}: {plural(view.count, 'message')}", "    ", "      ")
            yield from self._view(view, indent)
        yield from self._rest(stream, shown)

    def _rest(self, stream: StreamSurvey, shown: list[ViewSurvey]) -> Iterator[str]:
        """Yield a line with what of a message is not in the tables."""
        hidden = [
            f"{', '.join(_selectors(view))} ({view.count})"
            for view in stream.views
            if view not in shown
        ]
        if hidden:
            yield from self.wrap(f"without such parameters: {'; '.join(hidden)}", "    ", "      ")
        if stream.views_others:
            yield f"    {plural(stream.views_others, 'message')} of further kinds"
        further = max(
            len({field.name for field in view.fields} - {field.name for field in self._shown(view)})
            - len(view.selectors)
            for view in shown
        )
        if further > 0:
            yield self.dim(f"    {plural(further, 'further field')}")

    def _view(self, view: ViewSurvey, indent: str) -> Iterator[str]:
        fields = sorted(self._shown(view), key=_order)
        masks = [field for field in fields if field.quantity == "mask"]
        yield from self._table([field for field in fields if field not in masks], indent)
        for field in masks:
            yield from self._mask(field, indent)

    def _mask(self, field: FieldSurvey, indent: str) -> Iterator[str]:
        """Yield the values of a mask, the bits in words."""
        for each in field.seen:
            words = f"{each.value} {share(each.count, field.used)}: {each.words or 'no bit set'}"
            yield from self.wrap(f"{field.name} {words}", indent, f"{indent}  ")
        if field.seen_others:
            yield f"{indent}{field.name}: other values in {plural(field.seen_others, 'message')}"

    def _table(self, fields: list[FieldSurvey], indent: str) -> Iterator[str]:
        """Yield a row for each field: name, meaning, what it refers to, values."""
        from rich.console import Console
        from rich.table import Table
        from rich.text import Text

        if not fields:
            return
        table = Table.grid(padding=(0, 2, 0, 0))
        for width in self._widths(fields, self.context.width - len(indent)):
            table.add_column(width=width, overflow="fold")
        before = ""
        for field in fields:
            self._said.update(each.reference for each in (*field.frames, *field.heights))
            refers, before = refers_to(field, self._labels, before)
            cells = (_name(field), meaning(field), refers, "\n".join(values(field)))
            table.add_row(*(Text(cell) for cell in cells))
        console = Console(width=self.context.width, color_system=None, legacy_windows=False)
        with console.capture() as capture:
            console.print(table)
        yield from (f"{indent}{line}".rstrip() for line in capture.get().splitlines())

    @staticmethod
    def _widths(fields: list[FieldSurvey], width: int) -> tuple[int, int, int, int]:
        """Return the widths of the columns; what name and meaning leave is shared by the others."""
        name = min(max(len(_name(field)) for field in fields), _WIDEST_NAME)
        said = min(max(len(meaning(field)) for field in fields), _WIDEST_MEANING)
        left = width - 6 - name - said
        return name, said, left // 2, left - left // 2

    def _legend(self, survey: FileSurvey) -> Iterator[str]:
        """Yield the notions behind each reference, told apart."""
        rows = [(each.label, _notions(each)) for each in survey.references if self._in_tables(each)]
        heights = [each for each in survey.heights if each.name in self._said]
        rows += [(each.label, f"height from: {each.surface}") for each in heights]
        if rows:
            yield ""
            yield self.bold("What they refer to")
        for label, words in rows:
            yield from self.labelled(sentence(label), words, _LEGEND_COLUMN)

    def _in_tables(self, each: Reference) -> bool:
        """Return whether a table names it; a vertical is named by its height reference instead."""
        return each.name in self._said and each.system != "height"


def _notions(each: Reference) -> str:
    return (
        f"{each.system}; axes: {each.axes}; origin: {each.origin}; "
        f"datum: {each.datum}; projection: {each.projection}"
    )


def _only_stamped(views: list[ViewSurvey]) -> bool:
    """Return whether a single time stamp is all that a message says of place and time."""
    spatial = [field for view in views for field in view.fields if is_spatial(field)]
    return len(spatial) == 1 and spatial[0].quantity == "timestamp"


def often(stream: StreamSurvey) -> str:
    """Return ``4.0 Hz (1234)``, or only the count."""
    if stream.rate_hz is None:
        return f"({stream.count})"
    rate = f"{stream.rate_hz:.1f}" if stream.rate_hz >= 1 else f"{stream.rate_hz:.2g}"
    return f"{rate} Hz ({stream.count})"


def _instances(stream: StreamSurvey) -> str:
    """Return which instances there are, if there are several."""
    if len(stream.instances) < 2:
        return ""
    named = [f"{each.value} ({each.count})" for each in stream.instances[:_MOST_NAMED]]
    more = len(stream.instances) - len(named)
    return f"; by {stream.instance_field}: {', '.join(named)}" + (f", {more} more" if more else "")


def _selectors(view: ViewSurvey) -> list[str]:
    return [f"{name} {_word(each)}" for name, each in view.selectors.items()]


def _word(each: ValueCount) -> str:
    return each.words or str(each.value)


def _name(field: FieldSurvey) -> str:
    return f"{field.name} ({', '.join(field.when)})" if field.when else field.name


def _order(field: FieldSurvey) -> int:
    """Return where a field stands: time first, then what selects, then the rest as on the wire."""
    selects = (field.quantity or "").endswith("selector")
    return 0 if field.quantity == "timestamp" else 1 if selects else 2
