"""The settings of `check`: the configuration file, and what the command line says over it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, get_args

import click
import msgspec

from mavframecheck.cli.options import (
    DIALECT_HELP,
    input_kind_option,
    listed,
    load_rules,
    overrides,
    rules_option,
    selected,
)
from mavframecheck.model import Severity
from mavframecheck.model.config import Autopilot, Config
from mavframecheck.report.escape import sentence

if TYPE_CHECKING:
    from mavframecheck.engine import Pack, Settings
    from mavframecheck.engine.baseline import Baseline
    from mavframecheck.engine.policy import Policy

Command = TypeVar("Command", bound=Callable[..., Any])

_BARE = re.compile(r"[A-Za-z0-9_-]+")
"""Keys that TOML takes without quotes."""
_OPTIONS = (
    click.option(
        "--select",
        metavar="CODES",
        multiple=True,
        help="Run only these codes, prefixes or names: MFC1,MFC302. Repeatable.",
    ),
    click.option(
        "--extend-select",
        metavar="CODES",
        multiple=True,
        help="Run these as well, even those still on trial. Repeatable.",
    ),
    click.option("--ignore", metavar="CODES", multiple=True, help="Leave these out. Repeatable."),
    click.option(
        "--fail-on",
        type=click.Choice([severity.value for severity in Severity]),
        help="Exit 1 when a finding is at least this bad.  [default: warning]",
    ),
    click.option("--preview", is_flag=True, help="Also run rules that are still on trial."),
    click.option(
        "--autopilot",
        type=click.Choice(get_args(Autopilot)),
        help="What the vehicle is, where a recording does not say; in mission files whatever they say.",
    ),
    click.option(
        "--dialect",
        metavar="NAME|FILE.xml",
        help=f"{DIALECT_HELP}  [default: ardupilotmega]",
    ),
    click.option(
        "--set",
        "assignments",
        metavar="CODE.param=value",
        multiple=True,
        help="Change a parameter of a rule ('mavframecheck rule CODE' lists them). Repeatable.",
    ),
    rules_option,
    click.option(
        "--config",
        "config_file",
        metavar="FILE",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="Use this configuration file. Otherwise mavframecheck.toml, or [tool.mavframecheck] in "
        "pyproject.toml, in this folder or the nearest one above.",
    ),
    click.option("--isolated", is_flag=True, help="Use no configuration file."),
    click.option(
        "--show-settings", is_flag=True, help="Show the settings that hold, as TOML, and stop."
    ),
)


_OF_FILES = (
    input_kind_option,
    click.option(
        "--baseline",
        metavar="FILE",
        type=click.Path(dir_okay=False, path_type=Path),
        help="Leave out the findings that this file lists.",
    ),
    click.option(
        "--update-baseline", is_flag=True, help="Write all that is found now to the baseline."
    ),
)


def settings_options(command: Command) -> Command:
    """Give a command that judges files the options that `choose` reads."""
    return judging_options(_given(command, _OF_FILES))


def judging_options(command: Command) -> Command:
    """Give a command those of them that say which rules run, and what to assume."""
    return _given(command, _OPTIONS)


def _given(command: Command, options: Sequence[Callable[[Command], Command]]) -> Command:
    for option in reversed(options):
        command = option(command)
    return command


class Chosen(NamedTuple):
    """What a run is told."""

    pack: Pack
    settings: Settings
    policy: Policy | None
    """None where neither a configuration file nor a baseline says anything of findings."""
    baseline: Baseline | None
    """The one to write again, None unless asked for."""
    fail_on: Severity
    config: Config
    """Configuration file and command line as one."""
    source: Path | None
    """The configuration file."""


def choose(
    config_file: Path | None,
    *,
    isolated: bool,
    directories: tuple[Path, ...],
    assignments: tuple[str, ...],
    baseline: Path | None = None,
    update_baseline: bool = False,
    input_kind: str | None = None,
    plan: str | None = None,
    dem: str | None = None,
    **options: Any,
) -> Chosen:
    """Return what holds; a mistake in the file or on the command line is a usage error."""
    from mavframecheck.engine import Settings, SettingsError
    from mavframecheck.engine.config import find_config, read_config, resolve
    from mavframecheck.wire import DEFAULT_DIALECT

    try:
        source = config_file or (None if isolated else find_config(Path.cwd()))
        config = read_config(source) if source else Config()
        folder = source.absolute().parent if source else Path.cwd()
        pack = load_rules([*(folder / each for each in config.rules), *directories])
        if source:
            config = resolve(config, pack, source)
        config = _with_options(config, pack, assignments, **options)
        known = _baseline(baseline, folder, config, update=update_baseline)
    except SettingsError as error:
        raise click.UsageError(sentence(str(error))) from error
    settings = Settings(
        select=config.select or (),
        extend_select=config.extend_select,
        ignore=config.ignore,
        preview=config.preview,
        autopilot=config.autopilot,
        plan=plan,
        dem=dem or (str(folder / config.dem) if config.dem else None),
        input_kind=input_kind,
        overrides=config.params,
        dialect=config.dialect or DEFAULT_DIALECT,
    )
    policy = _policy(config, folder, known) if source or known else None
    written = known if update_baseline else None
    return Chosen(pack, settings, policy, written, config.fail_on, config, source)


def _policy(config: Config, folder: Path, baseline: Baseline | None) -> Policy:
    from mavframecheck.engine.policy import Policy

    return Policy(config, folder, baseline)


def _with_options(
    config: Config,
    pack: Pack,
    assignments: tuple[str, ...],
    *,
    select: tuple[str, ...],
    extend_select: tuple[str, ...],
    ignore: tuple[str, ...],
    fail_on: str | None,
    preview: bool,
    autopilot: Autopilot | None,
    dialect: str | None,
) -> Config:
    """Return `config` with the command line over it: --select replaces, lists and tables grow."""
    params = dict(config.params)
    for code, values in overrides(assignments, pack).items():
        params[code] = {**params.get(code, {}), **values}
    return msgspec.structs.replace(
        config,
        select=selected("--select", select, pack) if listed(select) else config.select,
        extend_select=config.extend_select + selected("--extend-select", extend_select, pack),
        ignore=config.ignore + selected("--ignore", ignore, pack),
        fail_on=Severity(fail_on) if fail_on else config.fail_on,
        preview=preview or config.preview,
        autopilot=autopilot or config.autopilot,
        dialect=dialect or config.dialect,
        params=params,
    )


def _baseline(given: Path | None, folder: Path, config: Config, *, update: bool) -> Baseline | None:
    from mavframecheck.engine.baseline import Baseline

    file = given or (folder / config.baseline if config.baseline else None)
    if file is None:
        if update:
            raise click.UsageError("--update-baseline needs --baseline FILE")
        return None
    return Baseline.read(file, learning=update)


def shown(chosen: Chosen) -> Iterator[str]:
    """Yield the settings as a configuration file that says the same."""
    yield f"# {sentence(str(chosen.source)) if chosen.source else 'no configuration file'}"
    fields = msgspec.to_builtins(chosen.config, builtin_types=(date,))
    tables = {key: value for key, value in fields.items() if isinstance(value, dict)}
    lists = fields.pop("suppressions")
    yield from _pairs({key: value for key, value in fields.items() if key not in tables})
    for name, table in tables.items():
        yield from _table(f"[{name}]", table)
    for each in lists:
        yield from _table("[[suppressions]]", each)


def _table(title: str, table: Mapping[str, object]) -> Iterator[str]:
    if table:
        yield ""
        yield title
    yield from _pairs(table)


def _pairs(table: Mapping[str, object]) -> Iterator[str]:
    for key, value in table.items():
        if value is not None:
            yield f"{key if _BARE.fullmatch(key) else _toml(key)} = {_toml(value)}"


def _toml(value: object) -> str:
    """Return a value as TOML, which strings, numbers and lists share with JSON."""
    if isinstance(value, dict):
        inner = ", ".join(f"{_toml(str(key))} = {_toml(item)}" for key, item in value.items())
        return f"{{{inner}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return value.isoformat() if isinstance(value, date) else msgspec.json.encode(value).decode()
