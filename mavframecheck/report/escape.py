r"""Text from logs and file names is hostile: make it harmless before anybody reads it.

The escapes are those of Python string literals (``\x1b``, ``\u202e``), so that what was really
there can still be read.
"""

from __future__ import annotations

import re

_COMMAND = re.compile(r":(?=:)|#(?=#\w*\[)")
"""Where a line becomes a command to the machine that runs a CI job: ``::error::``, ``##vso[``."""
_MARKDOWN = re.compile(r"[\\`*_{}\[\]()<>#|~!&@+-]|/(?=/)")


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
    """Return `text` on one line, safe for a terminal and for the log of a CI job."""
    line = terminal(" ".join(text.split()))
    return _COMMAND.sub(_byte, line) if "::" in line or "##" in line else line


def json_text(document: bytes) -> bytes:
    r"""Return a JSON document in which what is not visible is written as ``\uXXXX``.

    It says the same to every reader, and nothing to a terminal that it is shown on.
    """
    return document if document.isascii() and b"\x7f" not in document else _ascii(document)


def markdown(text: str) -> str:
    """Return `text` on one line that Markdown shows as it is: no link, no markup, no HTML."""
    return _MARKDOWN.sub(r"\\\g<0>", sentence(text))


def utf8(text: str) -> str:
    """Return `text` with what UTF-8 cannot hold (bytes of a non-UTF-8 file name) as escapes."""
    return text if text.isascii() else re.sub("[\ud800-\udfff]", lambda m: _escape(m[0]), text)


def _ascii(document: bytes) -> bytes:
    text = document.decode()
    return "".join(c if c.isprintable() or c < "\x7f" else _units(c) for c in text).encode()


def _units(character: str) -> str:
    """Return the UTF-16 units of a character as JSON escapes."""
    units = character.encode("utf-16-be", "surrogatepass").hex()
    return "".join(f"\\u{units[k : k + 4]}" for k in range(0, len(units), 4))


def _byte(match: re.Match[str]) -> str:
    return f"\\x{ord(match[0]):02x}"


def _escape(character: str) -> str:
    """Return the escape of one character; an undecodable byte of a file name as that byte."""
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:
        return f"\\x{code - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")
