"""docs/configuration.md knows every key, and its example is a configuration file."""

from __future__ import annotations

import re
from pathlib import Path

from mavframecheck.engine import load_pack
from mavframecheck.engine.config import read_config, resolve
from mavframecheck.model.config import Config, Suppression

DOCS = Path(__file__).parents[2] / "docs" / "configuration.md"


def test_example_sets_every_key(tmp_path: Path) -> None:
    """It is read without complaint against the shipped rules, and leaves no key at its default."""
    match = re.search(r"```toml\n(.*?)```", DOCS.read_text("utf-8"), re.DOTALL)
    assert match
    file = tmp_path / "mavframecheck.toml"
    file.write_text(match[1], encoding="utf-8")
    config = resolve(read_config(file), load_pack(), file)
    for key in Config.__struct_encode_fields__:
        assert re.search(rf"^\[*{key}\b", match[1], re.MULTILINE), key
    assert len(config.suppressions) == 1


def test_every_key_is_described() -> None:
    """Those of the file and those of a suppression."""
    named = set(re.findall(r"`([a-z-]+)`", DOCS.read_text("utf-8")))
    keys = {*Config.__struct_encode_fields__, *Suppression.__struct_encode_fields__}
    assert keys - {"rule"} <= named
