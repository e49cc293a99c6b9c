r"""Text from logs and file names is hostile: make it harmless before anybody reads it.

The escapes are those of Python string literals (``\x1b``, ``\u202e``), so that what was really
there can still be read.
"""

from __future__ import annotations

import re

_SURROGATE = re.compile("[\ud800-\udfff]")


def terminal(text: str) -> str:
    """Return `text` with every character that is no visible one written as an escape.

    `str.isprintable` refuses exactly what must not reach a terminal: control characters (and with
    them ANSI sequences, line ends and tabs), bidirectional overrides, zero-width and other format
    characters, line separators, lone surrogates, private and unassigned code points.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def sentence(text: str) -> str:
    """Return `text` on one line, safe for a terminal."""
    return terminal(" ".join(text.split()))


def utf8(text: str) -> str:
    """Return `text` with what UTF-8 cannot hold (bytes of a non-UTF-8 file name) as escapes."""
    return _SURROGATE.sub(lambda match: _escape(match[0]), text)


def _escape(character: str) -> str:
    """Return the escape of one character; an undecodable byte of a file name as that byte."""
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:
        return f"\\x{code - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")
