"""What `expected.toml` holds: recordings and places, clean streams to add, and mistakes with their codes."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Literal

import msgspec

EXPECTED = Path(__file__).parents[1] / "expected.toml"

Sender = Literal["companion", "gcs", "camera", "gimbal", "adsb", "autopilot"]


class _Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An unknown key is an error."""


class Spot(_Part, frozen=True):
    """A place to fly at: degrees, and metres above mean sea level."""

    lat: float
    lon: float
    alt: float


class Source(_Part, frozen=True):
    """A recording, how much of it is used, and where it is flown besides the place of its making."""

    name: str
    places: tuple[str, ...] = ()
    seconds: float = 180.0
    here: bool = True
    """Whether it is used unmoved too."""


class Stream(_Part, frozen=True):
    """Messages made of the vehicle's own telemetry, all of them right."""

    message: str
    fields: dict[str, str] = {}
    """Field -> expression; what is not given is 0."""
    at: str = "GLOBAL_POSITION_INT"
    """Messages of the autopilot that each one follows."""
    sender: Sender = "companion"
    when: str = "True"
    """Rows of `at` that are followed by one."""
    every_s: float = 0.2
    times: int = 1_000_000
    only: str = "True"
    """Which vehicles get it."""


class Mistake(_Part, frozen=True):
    """A mistake written into a recording, and the codes of which one must answer it."""

    name: str
    codes: tuple[str, ...]
    message: str
    set: dict[str, str] = {}
    """Field -> expression that replaces it."""
    where: str = "True"
    """Rows that get it."""
    decides: str = "True"
    """Rows in which the method can tell: there it must."""
    blind: str = ""
    """Rows in which it cannot tell and must be silent; empty: those that do not decide."""
    by: Literal["input", "autopilot"] = "input"
    """Whose messages: those sent to the autopilot, or its own."""
    about: str = ""
    """The message that the finding is about, where it is an input and another than the one changed."""
    stream: Stream | None = None
    """Where the message itself is the mistake: these are added."""
    least: int = 1
    """Rows that it takes."""
    times: int = 1_000_000
    """Rows that get it at most: the last ones."""


class Plan(_Part, frozen=True):
    """The whole file."""

    place: dict[str, Spot]
    recording: tuple[Source, ...]
    mistake: tuple[Mistake, ...]
    stream: tuple[Stream, ...] = ()
    unmeasured: dict[str, str] = {}
    """Code -> why no mistake of it can be written into these recordings."""


def read_plan(path: Path = EXPECTED) -> Plan:
    """Return the content of `expected.toml`; ValidationError says what is wrong with it."""
    return msgspec.convert(tomllib.loads(path.read_text("utf-8")), Plan)
