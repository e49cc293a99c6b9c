"""Where a finding is, for services that show files of a repository: relative paths, lines, URIs."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote

from mavframecheck.model import Finding, MissionLocation
from mavframecheck.report.escape import sentence


def relative(path: str) -> str:
    """Return `path` with forward slashes, from the working directory if it lies below it."""
    given = Path(path)
    if given.is_absolute():
        try:
            given = given.relative_to(Path.cwd())
        except ValueError:
            return given.as_posix()
    return given.as_posix()


def shown(path: str) -> str:
    """Return the relative path, safe to show."""
    return sentence(relative(path))


def uri(path: str) -> str:
    """Return a URI reference: relative below the working directory, else ``file:///``.

    Bytes of a name that are no UTF-8 are kept, percent-encoded.
    """
    plain = relative(path)
    encoded = quote(os.fsencode(plain) if _fits(plain) else plain.encode(errors="replace"))
    if Path(plain).is_absolute():
        return f"file://{'' if encoded.startswith('/') else '/'}{encoded}"
    return encoded


def _fits(path: str) -> bool:
    """Return whether `path` is one that the file system can have given."""
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        return False
    return True


def line(finding: Finding) -> int:
    """Return the line in a text file; 1 in a recording, for services that insist on one."""
    match finding.location:
        case MissionLocation(line=int(number)):
            return number
    return 1
