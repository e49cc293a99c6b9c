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
    """The message that the finding is about, where it is another than the one changed."""
    about_by: Literal["input", "autopilot"] = "input"
    """Whose message that is."""
    stream: Stream | None = None
    """Where the message itself is the mistake: these are added."""
    least: int = 1
    """Rows that it takes."""
    times: int = 1_000_000
    """Rows that get it at most: the last ones."""


class Distortion(_Part, frozen=True):
    """A stream that is distorted as a whole, and what is to be said of it."""

    name: str
    message: tuple[str, ...]
    codes: tuple[str, ...] = ()
    """Any of them must answer; none: it is legal, and nothing may."""
    also: tuple[str, ...] = ()
    """Codes that may come with it: consequences."""
    says: str = ""
    """Regular expression of the words that one of the answers must have."""
    set: dict[str, str] = {}
    """Field -> expression that replaces it; `k` is one of `values`."""
    values: tuple[float, ...] = ()
    """Each is a case."""
    permute: tuple[str, str, str] | None = None
    """Instead of `set`: the fields whose signed permutations are the cases, all but the right one."""
    free_heading: bool = False
    """Whether turns about the vertical are no mistake."""
    needs: tuple[
        Literal["across", "climb", "turn", "tilt", "far", "varies", "slides", "swings"], ...
    ] = ()
    """The motion that the method needs to tell: see `excitation.py`."""
    where: str = "True"
    """Holds for every row of a stream that it is about."""
    rows: str = "True"
    """Rows that get it."""


class MotionPlan(_Part, frozen=True):
    """What is done to streams of poses and velocities."""

    one_of: dict[Literal["whole", "own", "piece"], int]
    """Of so many cases one is run: of estimates in whole recordings, of the vehicle's own streams, in pieces."""
    seconds: float
    """How much of each recording is used."""
    places: tuple[str, ...]
    """Where recordings are flown besides the place of their making."""
    distortion: tuple[Distortion, ...]
    stream: tuple[Stream, ...]
    """One of them is added to each recording that has no estimate from outside."""


class FileMistake(_Part, frozen=True):
    """A mistake written into mission files (`files.py`), and the codes of which one must answer it."""

    name: str
    codes: tuple[str, ...]
    set: dict[str, str] = {}
    """Column -> expression that replaces it."""
    fence: str = ""
    """Expression that replaces the corners of the fence."""
    where: str = "True"
    """Items that get it."""
    decides: str = "True"
    """Items in which the method can tell: there it must."""
    blind: str = ""
    """Items in which it cannot tell and must be silent."""
    home: bool = False
    """Whether item 0 of a mission for ArduPilot gets it, too."""
    least: int = 1
    """Items that it takes."""
    times: int = 1_000_000
    """Items that get it at most: the last ones."""


class Plan(_Part, frozen=True):
    """The whole file."""

    place: dict[str, Spot]
    recording: tuple[Source, ...]
    mistake: tuple[Mistake, ...]
    motion: MotionPlan
    stream: tuple[Stream, ...] = ()
    file_mistake: tuple[FileMistake, ...] = ()
    unmeasured: dict[str, str] = {}
    """Code -> why no mistake of it can be written into these recordings."""


def read_plan(path: Path = EXPECTED) -> Plan:
    """Return the content of `expected.toml`; ValidationError says what is wrong with it."""
    return msgspec.convert(tomllib.loads(path.read_text("utf-8")), Plan)
