"""What users write about rules: codes, prefixes, names and parameters, checked against the pack."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import TypeAlias

from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.settings import SettingsError
from mavframecheck.model import Rule, setting

Value: TypeAlias = float | str | bool

_BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}


def selectors(words: Iterable[str], pack: Pack) -> tuple[str, ...]:
    """Return `words` as codes and prefixes; the name of a rule becomes its code."""
    return tuple(_selector(word, pack) for word in words)


def _selector(word: str, pack: Pack) -> str:
    if word and any(rule.code.startswith(word.upper()) for rule in pack.rules):
        return word.upper()
    for rule in pack.rules:
        if rule.name == word.lower():
            return rule.code
    known = [text for rule in pack.rules for text in (rule.code, rule.name)]
    raise SettingsError(f"no rule has the code or prefix '{word}'. {similar(word, known)}")


def parameter(code: str, name: str, text: str, pack: Pack) -> tuple[str, Value]:
    """Return the code of a rule, and `text` as the type that its parameter `name` has in its file."""
    rule = _rule(code, pack)
    if name not in rule.params:
        known = ", ".join(f"{key}={setting(value)}" for key, value in rule.params.items())
        raise SettingsError(f"{rule.code} has no parameter '{name}'. It has: {known or 'none'}.")
    kind = type(rule.params[name])
    try:
        value = _BOOLEANS[text.lower()] if kind is bool else _finite(kind(text))
    except (KeyError, ValueError):
        message = f"{rule.code}.{name} takes {_KINDS[kind]}, not '{text}'."
        raise SettingsError(message) from None
    return rule.code, value


def _rule(code: str, pack: Pack) -> Rule:
    rule = pack.by_code.get(code.upper())
    if rule is None:
        adjustable = [each.code for each in pack.rules if each.params]
        raise SettingsError(
            f"there is no rule {code}. {similar(code.upper(), adjustable)} Rules with parameters: {', '.join(adjustable) or 'none'}."
        )
    return rule


def _finite(value: Value) -> Value:
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError
    return value


def similar(word: str, known: Iterable[str]) -> str:
    """Return a sentence that names what the user may have meant, and where the list is."""
    return f"{did_you_mean(word, list(known))}'mavframecheck rules' lists them."


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """Return a question that names what looks like `word`, with a space behind it; or nothing."""
    folded = {text.lower(): text for text in known}
    close = [folded[match] for match in get_close_matches(word.lower(), folded, cutoff=0.5)]
    return f"Did you mean {' or '.join(close)}? " if close else ""
