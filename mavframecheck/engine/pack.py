"""Loading rules: the shipped pack from one compiled file, a user's from TOML."""

from __future__ import annotations

import functools
import importlib.resources
import tomllib
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

import msgspec

from mavframecheck.checks import load_check
from mavframecheck.engine.compiled import CompiledRule, Pack, bound_messages
from mavframecheck.engine.expression import RuleFileError
from mavframecheck.engine.settings import Settings
from mavframecheck.model import Rule

COMPILED = "data/pack.json"


def load_pack(directories: Sequence[Path] = ()) -> Pack:
    """Return the shipped rules and those below `directories`, by code.

    Raises `RuleFileError` when a file cannot be used or two rules share a code.
    """
    shipped = _shipped()
    own = [read_rule(file) for folder in directories for file in rule_files(folder)]
    if not own:
        return shipped
    pack = _pack([*((rule, shipped.sources[rule.code]) for rule in shipped.rules), *own])
    return msgspec.structs.replace(pack, binds=shipped.binds, context=shipped.context)


@functools.cache
def _shipped() -> Pack:
    packed = importlib.resources.files(__package__).joinpath(COMPILED).read_bytes()
    return msgspec.json.decode(packed, type=Pack)


def source_folder() -> Path:
    """Return the folder of the shipped rule files: in an installed package, else in the checkout."""
    package = Path(__file__).parents[1]
    installed = package / "rules"
    return installed if installed.is_dir() else package.parent / "rules"


def rule_files(folder: Path) -> list[Path]:
    """Return the rule files below `folder`, sorted; RuleFileError when there is none."""
    if not folder.is_dir():
        message = f"{folder}: no such directory of rules"
        raise RuleFileError(message)
    files = sorted(folder.rglob("*.toml"))
    if not files:
        message = f"{folder}: no rule file (*.toml) in it"
        raise RuleFileError(message)
    return files


def read_rule(file: Path) -> tuple[Rule, str]:
    """Return the rule in `file` and the name of the file; RuleFileError names file, key and column."""
    try:
        content = tomllib.loads(file.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        message = f"{file}: {error}"
        raise RuleFileError(message) from error
    try:
        rule = msgspec.convert(content, Rule)
    except msgspec.ValidationError as error:
        message = f"{file}: {error}"
        raise RuleFileError(message) from error
    compile_rule(rule, {}, str(file)).validate()
    return rule, str(file)


def compile_rule(
    rule: Rule,
    params: dict[str, float | str | bool],
    source: str,
    binds: Collection[str] | None = None,
    speaks_of: Collection[str] | None = None,
) -> CompiledRule:
    """Return `rule` ready to run; RuleFileError when it has no, or two, ways to detect."""
    if bool(rule.detect.flag) == bool(rule.detect.check):
        message = f"{source}: detect needs either flag or check"
        raise RuleFileError(message)
    if rule.detect.check and binds is None:
        try:
            load_check(rule.detect.check)
        except LookupError as error:
            message = f"{source}: detect.check: {error}"
            raise RuleFileError(message) from error
    if not (rule.detect.check or rule.applies.message or rule.applies.tag):
        message = f"{source}: applies needs message or tag"
        raise RuleFileError(message)
    return CompiledRule(rule, params, source, binds, speaks_of)


_ready: tuple[Pack, Settings, list[CompiledRule]] | None = None
"""The rules of the last call: the files of a run share what is compiled."""


def chosen_rules(pack: Pack, settings: Settings) -> list[CompiledRule]:
    """Return the rules of `pack` that `settings` let run; asked again for the same two, the same ones."""
    global _ready  # noqa: PLW0603  (neither of the two can be hashed)
    if _ready is None or _ready[0] is not pack or _ready[1] != settings:
        _ready = pack, settings, _chosen(pack, settings)
    return _ready[2]


def _chosen(pack: Pack, settings: Settings) -> list[CompiledRule]:
    return [
        compile_rule(
            rule,
            settings.overrides.get(rule.code, {}),
            pack.sources[rule.code],
            pack.binds.get(rule.code),
            pack.context.get(rule.code),
        )
        for rule in pack.rules
        if _runs(rule, settings)
    ]


def _runs(rule: Rule, settings: Settings) -> bool:
    if settings.ignore and rule.code.startswith(settings.ignore):
        return False
    if settings.extend_select and rule.code.startswith(settings.extend_select):
        return True
    if settings.select and not rule.code.startswith(settings.select):
        return False
    return rule.status == "stable" or settings.preview or rule.code in settings.select


def compiled_pack() -> bytes:
    """Return the content that the compiled pack must have: one rule a line."""
    folder = source_folder()
    read = [read_rule(file) for file in rule_files(folder)]
    pack = _pack((rule, Path(file).relative_to(folder).as_posix()) for rule, file in read)
    compiled = [compile_rule(rule, {}, "") for rule in pack.rules]
    found = {
        "sources": pack.sources,
        "binds": {each.rule.code: bound_messages(each) for each in compiled},
        "context": {each.rule.code: sorted(each.spoken_of) for each in compiled},
    }
    rules = b",\n".join(msgspec.json.encode(rule) for rule in pack.rules)
    rest = [b'"%s":%s' % (key.encode(), msgspec.json.encode(value)) for key, value in found.items()]
    return b'{"rules":[\n' + rules + b"\n],\n" + b",\n".join(rest) + b"}\n"


def _pack(rules: Iterable[tuple[Rule, str]]) -> Pack:
    sources: dict[str, str] = {}
    by_code: dict[str, Rule] = {}
    for rule, source in rules:
        if rule.code in by_code:
            message = f"{source}: {rule.code} is the code of {sources[rule.code]} already"
            raise RuleFileError(message)
        by_code[rule.code], sources[rule.code] = rule, source
    return Pack(tuple(by_code[code] for code in sorted(by_code)), sources)


if __name__ == "__main__":
    target = Path(__file__).parent / COMPILED
    target.parent.mkdir(exist_ok=True)
    target.write_bytes(compiled_pack())
