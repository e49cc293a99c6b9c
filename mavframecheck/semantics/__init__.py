"""What every number of MAVLink means, as data: see `docs/conventions.md`."""

from mavframecheck.semantics.catalogue import (
    CommandFacts,
    all_tags,
    command,
    find,
    group,
    messages,
    partners,
    tags,
    tags_of,
)
from mavframecheck.semantics.commands import altitude_commands, location_commands
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.mavframe import FRAMES, frame_facts, frame_name
from mavframecheck.semantics.names import family, mode_name
from mavframecheck.semantics.tags import Condition, FieldTag, Sentinel

__all__ = [
    "FRAMES",
    "CommandFacts",
    "Condition",
    "FieldTag",
    "Sentinel",
    "all_tags",
    "altitude_commands",
    "command",
    "constant",
    "family",
    "find",
    "frame_facts",
    "frame_name",
    "group",
    "location_commands",
    "messages",
    "mode_name",
    "partners",
    "tags",
    "tags_of",
]
