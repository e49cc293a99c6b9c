"""`inspect --origins`: origins, homes and launch points, as tables for people and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mavframecheck.model.origins import FileOrigins, Fix, HomeEntry, OriginEntry, VehicleOrigins
from mavframecheck.report.escape import sentence
from mavframecheck.report.layout import FilePage
from mavframecheck.report.words import plural

Row = tuple[str, ...]
_PLACE = ("time", "latitude", "longitude", "height")
_UNSAID = "not said: inferred from local and global positions"


class OriginPage(FilePage[FileOrigins]):
    """Writes registries for one context."""

    def file(self, found: FileOrigins) -> Iterator[str]:
        """Yield the head, and the three histories of each vehicle."""
        yield self.bold(sentence(found.path))
        for note in found.notes:
            yield from self.wrap(f"note: {note}", "  ", "    ")
        if not found.vehicles:
            yield from self.wrap("no autopilot says where its origin or home is", "  ")
        for vehicle in found.vehicles:
            yield from self._vehicle(vehicle, found.time_start)

    def _vehicle(self, vehicle: VehicleOrigins, start: float | None) -> Iterator[str]:
        yield ""
        restarts = f", {plural(vehicle.boots, 'restart')}" if vehicle.boots else ""
        yield self.paint(f"system {vehicle.system}", "cyan") + restarts
        origins = [
            (str(each.origin_id), *_place(each, start), _moved(each), _source(each))
            for each in vehicle.origins
        ]
        homes = [(*_place(each, start), _moved(each), _asked(each)) for each in vehicle.homes]
        launches = [_place(each, start) for each in vehicle.launches]
        yield from self._table(
            "Local origins", ("id", *_PLACE, "from the one before", "source"), origins
        )
        yield from self._table("Home", (*_PLACE, "from the origin", "set by"), homes)
        yield from self._table("Armed at", _PLACE, launches)

    def _table(self, title: str, head: Row, rows: Sequence[Row]) -> Iterator[str]:
        """Yield a table, its columns as wide as they need; long ones run on at the end of the line."""
        yield f"  {self.bold(title)}" if rows else f"  {title}: not known"
        widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        for number, row in enumerate((head, *rows) if rows else ()):
            cells = "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True))
            line = f"    {cells.rstrip()}"
            yield self.dim(line) if not number else line


def _place(fix: Fix, start: float | None) -> Row:
    """Return when and where: seconds since the recording began, degrees, metres."""
    known = fix.time is not None and start is not None
    time = f"{fix.time - start:.1f} s" if known and fix.time and start else f"byte {fix.offset}"
    height = f"{fix.height_m:.2f} m {fix.height_reference.upper()}"
    return f"boot {fix.boot}, {time}", f"{fix.lat:.7f}", f"{fix.lon:.7f}", height


def _moved(entry: OriginEntry | HomeEntry) -> str:
    if entry.north_m is None or entry.east_m is None or entry.up_m is None:
        return "-"
    return f"N {entry.north_m:+.1f}  E {entry.east_m:+.1f}  up {entry.up_m:+.1f} m"


def _source(entry: OriginEntry) -> str:
    said = _UNSAID if entry.source == "positions" else entry.source
    return f"{said}, asked for by {entry.asked_by}" if entry.asked_by else said


def _asked(entry: HomeEntry) -> str:
    by = entry.asked_by or "the vehicle"
    return f"{by}, armed" if entry.armed else by
