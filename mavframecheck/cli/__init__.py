"""The command line: thin click commands. What they do is in the rooms below."""

from mavframecheck.cli.group import main

__all__ = ["main"]
