"""Configuration files: found upwards, and every mistake says what was meant."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from mavframecheck.engine import SettingsError
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.config import find_config, read_config, resolve
from mavframecheck.model import Severity
from tests.report import made_up

PACK = Pack(made_up.rules(), {rule.code: "" for rule in made_up.rules()})
FULL = """
select = ["MFC3", "unmasked-zero-yaw"]
extend-select = ["mfc1"]
ignore = ["degrees-in-scaled-field"]
preview = true
fail-on = "error"
autopilot = "px4"
dialect = "common"
rules = ["mine"]
baseline = "known.json"

[severity]
unmasked-zero-yaw = "info"

[params.MFC302]
near_km = 2
strict = false

[per-file-ignores]
"bench/*" = ["MFC1"]

[per-sysid-ignores]
255 = ["MFC302"]

[per-stream-ignores]
"1/191 ODOMETRY" = ["MFC302"]

[[suppressions]]
rule = "unmasked-zero-yaw"
stream = "1/191"
file = "*.raw"
reason = "known since the bench test"
until = 2026-12-31
"""


def written(folder: Path, text: str, name: str = "mavframecheck.toml") -> Path:
    """Write a configuration file."""
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_every_key_is_read(tmp_path: Path) -> None:
    """In its type, with codes in place of names."""
    file = written(tmp_path, FULL)
    config = resolve(read_config(file), PACK, file)
    assert config.select == ("MFC3", "MFC107")
    assert config.extend_select == ("MFC1",)
    assert config.ignore == ("MFC302",)
    assert (config.preview, config.fail_on) == (True, Severity.ERROR)
    assert (config.autopilot, config.dialect) == ("px4", "common")
    assert (config.rules, config.baseline) == (("mine",), "known.json")
    assert config.severity == {"MFC107": Severity.INFO}
    assert config.params == {"MFC302": {"near_km": 2.0, "strict": False}}
    assert config.per_file_ignores == {"bench/*": ("MFC1",)}
    assert config.per_sysid_ignores == {"255": ("MFC302",)}
    assert config.per_stream_ignores == {"1/191 ODOMETRY": ("MFC302",)}
    (suppression,) = config.suppressions
    assert (suppression.rule, suppression.until) == ("MFC107", date(2026, 12, 31))


def test_the_nearest_file_above_holds(tmp_path: Path) -> None:
    """A pyproject.toml counts only with our table in it; a mistake in another's is not ours."""
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    written(tmp_path, "preview = true")
    written(inner, "[tool.other", "pyproject.toml")
    assert find_config(inner) == tmp_path / "mavframecheck.toml"
    own = written(tmp_path / "a", "[tool.mavframecheck]\npreview = true", "pyproject.toml")
    assert find_config(inner) == own
    assert read_config(own).preview


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("selct = []", "settings: no setting is called 'selct'. Did you mean select"),
        ("zzzz = 1", "There are: select, extend-select, ignore"),
        ("select = 'MFC3'", "select: expected a list, got text"),
        ("select = ['MFC3'", "is no valid TOML"),
        ("fail-on = 'fatal'", "fail-on: invalid enum value 'fatal'"),
        ("autopilot = 'px5'", "autopilot: invalid enum value 'px5'"),
        ("[severity]\nMFC302 = 'bad'", "severity[...]: invalid enum value 'bad'"),
        ("[per-sysid-ignores]\ncamera = []", "'camera' is no system id (0 to 255)"),
        ("[[suppressions]]\nrule = 'MFC302'", "missing required field reason"),
        ("[[suppressions]]\nrule = 'MFC302'\nreason = ' '", "say why it is accepted"),
        ("[[suppressions]]\nrule='MFC302'\nraeson='x'", "suppressions[0]: no setting is called"),
        ("[[suppressions]]\nrule='MFC302'\nreason='x'\nuntil='soon'", "until: invalid"),
    ],
)
def test_mistakes_name_file_key_and_remedy(tmp_path: Path, text: str, words: str) -> None:
    """Nobody searches for what is wrong."""
    file = written(tmp_path, text)
    with pytest.raises(SettingsError) as refused:
        read_config(file)
    assert str(refused.value).startswith(str(file))
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("select = ['MFC303']", "select: no rule has the code or prefix 'MFC303'. Did you mean"),
        ("ignore = ['']", "ignore: no rule has the code or prefix ''"),
        ("[params.MFC302]\nnear = 1", "params: MFC302 has no parameter 'near'"),
        ("[params.MFC302]\nnear_km = 'far'", "MFC302.near_km takes a number, not 'far'"),
        ("[params.MFC999]\nx = 1", "there is no rule MFC999"),
        ("[per-file-ignores]\n'*' = ['MFC9']", "per-file-ignores.*: no rule"),
        ("[[suppressions]]\nrule='x'\nreason='y'", "suppressions[0].rule: no rule"),
    ],
)
def test_rules_that_do_not_exist(tmp_path: Path, text: str, words: str) -> None:
    """A misspelt rule silences nothing, and is said."""
    file = written(tmp_path, text)
    with pytest.raises(SettingsError) as refused:
        resolve(read_config(file), PACK, file)
    assert words in str(refused.value)


def test_a_file_without_the_table(tmp_path: Path) -> None:
    """`--config pyproject.toml` without our table is a mistake, not an empty configuration."""
    with pytest.raises(SettingsError, match=r"no table \[tool.mavframecheck\]"):
        read_config(written(tmp_path, "[tool.ruff]", "pyproject.toml"))
    with pytest.raises(SettingsError, match="cannot be read: No such file"):
        read_config(tmp_path / "gone.toml")
    (tmp_path / "latin.toml").write_bytes(b"select = ['\xff']")
    with pytest.raises(SettingsError, match="is no valid TOML"):
        read_config(tmp_path / "latin.toml")
