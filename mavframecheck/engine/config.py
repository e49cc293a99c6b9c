"""Configuration files: found upwards, read, and every mistake in them named with its key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from mavframecheck.engine.choices import did_you_mean, parameter, selectors
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.settings import SettingsError
from mavframecheck.model import setting
from mavframecheck.model.config import Config, Suppression

OWN = "mavframecheck.toml"
SHARED = "pyproject.toml"
TABLE = ("tool", "mavframecheck")
"""Where the settings are in a file that is shared with other tools."""
_TYPES = {
    "array": "a list",
    "object": "a table",
    "str": "text",
    "bool": "true or false",
    "int": "a whole number",
    "float": "a number",
}
"""What msgspec calls types, and what they are for people."""


def find_config(start: Path) -> Path | None:
    """Return the configuration file in `start` or the nearest folder above it that has one."""
    for folder in (start, *start.parents):
        if (folder / OWN).is_file():
            return folder / OWN
        if _has_settings(folder / SHARED):
            return folder / SHARED
    return None


def _has_settings(file: Path) -> bool:
    """Return whether a file that other tools share speaks of this one; else its mistakes are theirs."""
    try:
        named = TABLE[-1].encode() in file.read_bytes()
    except OSError:
        return False
    return named and _settings_in(_toml(file)) is not None


def read_config(file: Path) -> Config:
    """Return the settings in `file`; SettingsError names file and key, and what was meant perhaps."""
    content = _toml(file)
    settings = _settings_in(content) if file.name == SHARED else content
    if settings is None:
        raise SettingsError(f"{file}: no table [{'.'.join(TABLE)}] in it")
    for path, key, known in _unknown(settings):
        hint = did_you_mean(key, known) or f"There are: {', '.join(known)}."
        raise SettingsError(f"{file}: {path}: no setting is called '{key}'. {hint.strip()}")
    try:
        config = msgspec.convert(settings, Config)
    except msgspec.ValidationError as error:
        raise SettingsError(f"{file}: {_in_words(str(error))}") from error
    _check(config, file)
    return config


def resolve(config: Config, pack: Pack, file: Path) -> Config:
    """Return `config` with codes in place of names; SettingsError for a rule that does not exist."""

    def codes(key: str, words: tuple[str, ...]) -> tuple[str, ...]:
        try:
            return selectors(words, pack)
        except SettingsError as error:
            raise SettingsError(f"{file}: {key}: {error}") from error

    def table(name: str, ignores: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        return {key: codes(f"{name}.{key}", words) for key, words in ignores.items()}

    return msgspec.structs.replace(
        config,
        select=None if config.select is None else codes("select", config.select),
        extend_select=codes("extend-select", config.extend_select),
        ignore=codes("ignore", config.ignore),
        severity={codes("severity", (k,))[0]: value for k, value in config.severity.items()},
        params=_parameters(config, pack, file),
        per_file_ignores=table("per-file-ignores", config.per_file_ignores),
        per_sysid_ignores=table("per-sysid-ignores", config.per_sysid_ignores),
        per_stream_ignores=table("per-stream-ignores", config.per_stream_ignores),
        suppressions=tuple(
            msgspec.structs.replace(each, rule=codes(f"suppressions[{k}].rule", (each.rule,))[0])
            for k, each in enumerate(config.suppressions)
        ),
    )


def _parameters(config: Config, pack: Pack, file: Path) -> dict[str, dict[str, float | str | bool]]:
    result: dict[str, dict[str, float | str | bool]] = {}
    for rule, values in config.params.items():
        for name, value in values.items():
            try:
                code, typed = parameter(rule, name, setting(value), pack)
            except SettingsError as error:
                raise SettingsError(f"{file}: params: {error}") from error
            result.setdefault(code, {})[name] = typed
    return result


def _toml(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text("utf-8"))
    except OSError as error:
        raise SettingsError(f"{file}: cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SettingsError(f"{file}: is no valid TOML: {error}") from error


def _settings_in(content: dict[str, Any]) -> dict[str, Any] | None:
    for key in TABLE:
        inner = content.get(key)
        if not isinstance(inner, dict):
            return None
        content = inner
    return content


def _unknown(settings: dict[str, Any]) -> Iterator[tuple[str, str, list[str]]]:
    """Yield table, key and the keys that exist, for every key that does not."""
    yield from _strange(settings, Config, "settings")
    suppressions = settings.get("suppressions")
    for number, each in enumerate(suppressions if isinstance(suppressions, list) else ()):
        if isinstance(each, dict):
            yield from _strange(each, Suppression, f"suppressions[{number}]")


def _strange(
    table: dict[str, Any], struct: type[msgspec.Struct], path: str
) -> Iterator[tuple[str, str, list[str]]]:
    known = list(struct.__struct_encode_fields__)
    yield from ((path, key, known) for key in table if key not in known)


def _in_words(message: str) -> str:
    """Return msgspec's ``Expected `array`, got `str` - at `$.select``` in words of TOML, the key first."""
    reason, _, place = message.replace("`", "").replace(" | null", "").partition(" - at ")
    for word, toml in _TYPES.items():
        reason = re.sub(rf"\b{word}\b", toml, reason)
    return f"{place.removeprefix('$.')}: {reason[:1].lower()}{reason[1:]}" if place else reason


def _check(config: Config, file: Path) -> None:
    """Refuse what has the right type and still makes no sense."""
    for key in config.per_sysid_ignores:
        if not (key.isdecimal() and int(key) < 256):
            raise SettingsError(f"{file}: per-sysid-ignores: '{key}' is no system id (0 to 255)")
    for number, each in enumerate(config.suppressions):
        if not each.reason.strip():
            raise SettingsError(f"{file}: suppressions[{number}].reason: say why it is accepted")
