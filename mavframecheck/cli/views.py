"""The views of `inspect`: each reads recordings one by one, and has a page that shows what it found."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

import click

from mavframecheck.cli.output import echo
from mavframecheck.report import Context

if TYPE_CHECKING:
    from mavframecheck.engine import Settings
    from mavframecheck.model.clocks import FileClocks
    from mavframecheck.model.finding import FileSummary
    from mavframecheck.model.origins import FileOrigins
    from mavframecheck.model.survey import FileSurvey
    from mavframecheck.report.layout import FilePage

Advance = Callable[[int], None] | None
"""Is told how many bytes of a file were read so far."""
Found = TypeVar("Found", bound="FileSummary")


class View(ABC, Generic[Found]):
    """One way to look at recordings; what it reads is imported when it is asked for."""

    option: ClassVar[str]
    """The option that asks for it."""
    goes_with: ClassVar[frozenset[str]] = frozenset()
    """Of ``--message`` and ``--all``, those that may stand beside it."""

    def __init__(self, settings: Settings, messages: tuple[str, ...], *, every_field: bool) -> None:
        """Read recordings as `settings` say; `messages`: only these, empty for all."""
        for other, asked in (("--message", messages), ("--all", every_field)):
            if asked and other not in self.goes_with:
                raise click.UsageError(f"{other} does not go with {self.option}")
        self.settings = settings
        self.messages = messages
        self.every_field = every_field

    def show(self, paths: tuple[str, ...], form: str, context: Context) -> int:
        """Write what is in each file; return the exit code."""
        from mavframecheck.cli.files import Files
        from mavframecheck.report.json import listing

        files = Files(paths, self.counted)
        results = files.results()
        echo(listing(results, context) if form == "json" else self.page(context).render(results))
        return files.exit_code()

    def counted(self, path: str, advance: Advance) -> tuple[Found, int]:
        """Return what one recording holds, and its messages."""
        found = self.read(path, advance)
        return found, found.messages

    @abstractmethod
    def read(self, path: str, advance: Advance) -> Found:
        """Return what one recording holds."""

    @abstractmethod
    def page(self, context: Context) -> FilePage[Found]:
        """Return the page that shows it to people."""


class Map(View["FileSurvey"]):
    """What each message means, field by field."""

    goes_with = frozenset({"--message", "--all"})

    def read(self, path: str, advance: Advance) -> FileSurvey:
        """Return the semantic map."""
        from mavframecheck.engine.survey import survey_file

        return survey_file(path, self.settings, self.messages, advance)

    def page(self, context: Context) -> FilePage[FileSurvey]:
        """Return the map's page; a message that is asked for is shown with every field."""
        from mavframecheck.report.survey import MapPage

        return MapPage(context, every_field=self.every_field or bool(self.messages))


class Origins(View["FileOrigins"]):
    """Where local positions and heights above home count from."""

    option = "--origins"

    def read(self, path: str, advance: Advance) -> FileOrigins:
        """Return the registry."""
        from mavframecheck.engine.origins import origins_of_file

        return origins_of_file(path, self.settings, advance)

    def page(self, context: Context) -> FilePage[FileOrigins]:
        """Return the registry's page."""
        from mavframecheck.report.origins import OriginPage

        return OriginPage(context)


class Clocks(View["FileClocks"]):
    """Whose clock each stamp is, and how it runs."""

    option = "--clocks"
    goes_with = frozenset({"--message", "--all"})

    def read(self, path: str, advance: Advance) -> FileClocks:
        """Return the clock table."""
        from mavframecheck.engine.clocks import clocks_of_file

        return clocks_of_file(path, self.settings, advance)

    def page(self, context: Context) -> FilePage[FileClocks]:
        """Return the clock table's page."""
        from mavframecheck.report.clocks import ClockPage

        return ClockPage(context)
