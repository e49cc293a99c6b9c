"""`mavframecheck inspect --positions`: every position of a recording as a record."""

from __future__ import annotations

import functools
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self

import click

from mavframecheck.cli.output import complain, echo

if TYPE_CHECKING:
    from mavframecheck.engine import Settings
    from mavframecheck.engine.conversion import Converter, Target
    from mavframecheck.report.positions import Writer
    from mavframecheck.semantics.positions import Origin

FORMATS = ("csv", "jsonl", "parquet")
REPRESENTATIONS = ("geodetic", "ecef", "ned", "enu", "utm")
HEIGHTS = ("ellipsoid", "msl")


@dataclass(frozen=True)
class Wish:
    """What positions are to become, as the options say it."""

    representation: str | None = None
    height: str | None = None
    origin: str | None = None
    zone: str | None = None
    output: Path | None = None


def position_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options about positions; it is called with a `wish`, None without --positions."""

    @functools.wraps(command)
    def called(*args: Any, positions: bool, **values: Any) -> Any:
        wish = Wish(**{field.name: values.pop(field.name) for field in fields(Wish)})
        if not positions and wish != Wish():
            raise click.UsageError(
                "--as, --height, --origin, --zone and --output go with --positions"
            )
        return command(*args, wish=wish if positions else None, **values)

    for option in reversed(_OPTIONS):
        called = option(called)
    return called


_OPTIONS = (
    click.option(
        "--positions",
        is_flag=True,
        help="Write every position as a record: --format csv (default), jsonl or parquet.",
    ),
    click.option(
        "--as",
        "representation",
        type=click.Choice(REPRESENTATIONS),
        help="With --positions: convert all to this; a record that cannot be says why.",
    ),
    click.option(
        "--height",
        type=click.Choice(HEIGHTS),
        help="With --positions: heights above this, through the EGM96 geoid.",
    ),
    click.option(
        "--origin",
        metavar="LAT,LON,HEIGHT,REF",
        help="With --as ned or enu: the origin, degrees and m above REF (ellipsoid or msl); "
        "by default the one in force of each vehicle.",
    ),
    click.option(
        "--zone",
        metavar="34N",
        help="With --as utm: zone and hemisphere; by default those of the first position.",
    ),
    click.option(
        "--output",
        metavar="FILE",
        type=click.Path(dir_okay=False, path_type=Path),
        help="With --positions: write here instead of standard output.",
    ),
)


class Positions:
    """Writes the positions of recordings as they are read."""

    def __init__(self, settings: Settings, messages: tuple[str, ...], wish: Wish) -> None:
        self._settings = settings
        self._messages = messages
        self._target = _target(wish)
        self._output = wish.output

    def show(self, paths: tuple[str, ...], form: str) -> int:
        """Write the positions of each file in one format; return the exit code."""
        from mavframecheck.cli.files import Files
        from mavframecheck.engine.conversion import Converter
        from mavframecheck.report.positions import FORMATS as WRITERS

        if form not in FORMATS:
            raise click.UsageError(f"positions are written as {', '.join(FORMATS)}, not {form}")
        if form == "parquet" and self._output is None and sys.stdout.isatty():
            raise click.UsageError("Parquet is not for a terminal: give --output or a pipe")
        try:
            writer, converter = WRITERS[form](), Converter(self._target)
        except ModuleNotFoundError as error:
            raise click.UsageError(str(error)) from error
        with _Out(self._output) as out:
            out.write(writer.head())
            pen = _Pen(writer, converter, out)
            files = Files(paths, lambda path, advance: self._read(path, advance, pen))
            for _ in files.results():
                pass
            out.write(writer.foot())
        return files.exit_code()

    def _read(
        self, path: str, advance: Callable[[int], None] | None, pen: _Pen
    ) -> tuple[None, int]:
        from mavframecheck.engine.positions import positions
        from mavframecheck.engine.reading import Reading
        from mavframecheck.report.positions import Records
        from mavframecheck.sources import open_recording
        from mavframecheck.wire import load_dialect

        dialect = load_dialect(self._settings.dialect)
        with open_recording(path, self._settings.input_kind) as recording:
            reading = Reading(recording, self._settings, dialect)
            for found in positions(reading, self._messages, advance):
                try:
                    records = Records.of(path, pen.converter.convert(found))
                except ModuleNotFoundError as error:
                    raise click.UsageError(str(error)) from error
                if records.size:
                    pen.out.write(pen.writer.body(records))
        return None, reading.counts["messages"]


@dataclass(frozen=True)
class _Pen:
    """What turns positions into bytes, and where those go."""

    writer: Writer
    converter: Converter
    out: _Out


class _Out:
    """Standard output or a file; what cannot be written ends the command."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._file: BinaryIO | None = None

    def __enter__(self) -> Self:
        if self._path is not None:
            try:
                self._file = self._path.open("wb")
            except OSError as error:
                self._fail(error)
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def write(self, piece: bytes) -> None:
        """Write some bytes."""
        if self._file is None:
            echo([piece] if piece else [])
            return
        try:
            self._file.write(piece)
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        complain(f"cannot write the positions: {error.strerror}")
        raise click.exceptions.Exit(2) from error


def _target(wish: Wish) -> Target:
    """Return what the options ask for; what does not go together is a usage error."""
    from mavframecheck.engine.conversion import Target
    from mavframecheck.semantics.enums import AltRef

    if wish.origin is not None and wish.representation not in ("ned", "enu"):
        raise click.UsageError("--origin is for --as ned and --as enu")
    if wish.zone is not None and wish.representation != "utm":
        raise click.UsageError("--zone is for --as utm")
    if wish.height is not None and wish.representation in ("ecef", "ned", "enu"):
        raise click.UsageError(f"--as {wish.representation} has no heights: leave out --height")
    return Target(
        representation=wish.representation,  # type: ignore[arg-type]
        height=AltRef(wish.height) if wish.height else None,
        origin=None if wish.origin is None else _origin(wish.origin),
        zone=None if wish.zone is None else _zone(wish.zone),
    )


def _origin(text: str) -> Origin:
    """Return the origin in ``47.397742,8.545594,488,msl``."""
    from mavframecheck.semantics.enums import AltRef
    from mavframecheck.semantics.positions import Origin

    parts = [part.strip() for part in text.split(",")]
    form = "LAT,LON,HEIGHT,REF, for example 47.397742,8.545594,488,msl"
    if len(parts) != 4 or parts[3] not in HEIGHTS:
        raise click.BadParameter(f"'{text}' is not {form}", param_hint="--origin")
    try:
        lat, lon, height = map(float, parts[:3])
    except ValueError:
        raise click.BadParameter(f"'{text}' is not {form}", param_hint="--origin") from None
    if not (abs(lat) <= 90 and abs(lon) <= 180 and abs(height) < 1e5):
        raise click.BadParameter(f"'{text}' is no place on the Earth", param_hint="--origin")
    return Origin("given", lat, lon, height, AltRef(parts[3]))


def _zone(text: str) -> tuple[int, bool]:
    """Return the zone in ``34N``, and whether it is the northern half."""
    match = re.fullmatch(r"([1-9]|[1-5]\d|60)([NS])", text.strip().upper())
    if match is None:
        raise click.BadParameter(
            f"'{text}' is not a zone 1 to 60 with N or S (hemisphere), such as 34N",
            param_hint="--zone",
        )
    return int(match[1]), match[2] == "N"
