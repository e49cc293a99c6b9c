"""A linter for the meaning of MAVLink numbers."""

__version__ = "0.1.0"
