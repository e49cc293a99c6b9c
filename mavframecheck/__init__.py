"""A linter for the meaning of MAVLink numbers."""

from typing import Any

__version__ = "0.1.0"


def init(mpstate: Any) -> Any:
    """Return the module for MAVProxy, which looks here for it: ``module load mavframecheck``."""
    from mavframecheck.cli.mavproxy import Module

    return Module(mpstate)
