"""Loading rules: the shipped pack is current, and a mistake in a rule file is named."""

from __future__ import annotations

import copy
import importlib.resources
from pathlib import Path

import pytest

from mavframecheck.engine import RuleFileError, Settings, check_file, load_pack
from mavframecheck.engine.pack import COMPILED, chosen_rules, compiled_pack, read_rule
from tests.engine.judged import RULE, pack_of, rule

SAMPLES = Path(__file__).parents[2] / "samples"


def test_the_compiled_pack_is_up_to_date() -> None:
    """`make generate` writes it."""
    packed = importlib.resources.files("mavframecheck.engine").joinpath(COMPILED).read_bytes()
    assert packed == compiled_pack()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return where to write a rule."""
    return tmp_path / "MFC999-made-up.toml"


def test_a_users_rule_beside_the_shipped_ones(file: Path) -> None:
    file.write_text(RULE)
    pack = load_pack([file.parent])
    assert pack.by_code["MFC999"].name == "made-up"
    assert pack.sources["MFC999"] == str(file)
    codes = [each.code for each in pack.rules]
    assert codes == sorted(codes)
    assert len(codes) == len(load_pack().rules) + 1


def test_rules_in_folders_below(file: Path) -> None:
    below = file.parent / "family" / file.name
    below.parent.mkdir()
    below.write_text(RULE)
    assert "MFC999" in load_pack([file.parent]).by_code


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('severity = "error"', 'severity = "fatal"', r"severity"),
        ('severity = "error"', 'severity = "error"\ncolour = 1', r"unknown field `colour`"),
        ("[detect]", "[detect]\nflags = 'x'", r"unknown field `flags`.*\$\.detect"),
        ('summary = "Made up for a test."', "", r"summary"),
        ("raw(roll) > 1", "raw(roll) > ", r"detect\.flag, column \d+: not an expression"),
        ("raw(roll) > 1", "roll > 1", r"detect\.flag, column 1: unknown name 'roll'"),
        ("raw(roll) > 1", "1 + open('x')", r"detect\.flag, column 5: unknown function 'open'"),
        ("{raw(roll):.1f}", "{raw(roll}", r"explain\.text, column"),
        ("{raw(roll):.1f}", "{roll}", r"explain\.text, column 1: unknown name 'roll'"),
        ('flag = "raw(roll) > 1"', "", r"detect needs either flag or check"),
        (
            'flag = "raw(roll) > 1"',
            'flag = "raw(roll) > 1"\ncheck = "stream.StrayBytes"',
            r"detect needs either flag or check",
        ),
        ('flag = "raw(roll) > 1"', 'check = "stream.Nobody"', r"detect\.check: there is no check"),
        ('flag = "raw(roll) > 1"', 'check = "os.path"', r"detect\.check: there is no check"),
        ('flag = "raw(roll) > 1"', 'check = "../evil"', r"detect\.check: a check is named"),
        ('flag = "raw(roll) > 1"', 'check = "base.place"', r"detect\.check: .* is no check"),
        ('message = ["ATTITUDE"]', "", r"applies needs message or tag"),
        ("[detect]", "[let]\nb = 'a'\na = '1'\n[detect]", r"let\.b, column 1: unknown name 'a'"),
        ("[detect]", "[detect", r"line \d+"),
        (
            "[explain]",
            "[[severity_when]]\nif = 'x'\nseverity = 'info'\n[explain]",
            r"severity_when\[0\], column 1",
        ),
        ("[explain]", "[evidence]\nobserved = '{x}'\n[explain]", r"evidence\.observed, column 1"),
    ],
)
def test_mistakes_name_file_key_and_column(file: Path, old: str, new: str, words: str) -> None:
    assert old in RULE
    file.write_text(RULE.replace(old, new))
    with pytest.raises(RuleFileError, match=words) as refusal:
        load_pack([file.parent])
    assert str(refusal.value).startswith(str(file))


def test_a_file_that_is_no_text(file: Path) -> None:
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RuleFileError, match=file.name):
        read_rule(file)


def test_a_code_that_is_taken(file: Path) -> None:
    """By a shipped rule or by another of the user's: the text names both files."""
    file.write_text(RULE.replace("MFC999", "MFC302"))
    with pytest.raises(RuleFileError, match=r"MFC302 is the code of .*MFC302-degrees"):
        load_pack([file.parent])
    file.write_text(RULE)
    (file.parent / "second.toml").write_text(RULE)
    with pytest.raises(RuleFileError, match=r"second\.toml: MFC999 is the code of .*MFC999"):
        load_pack([file.parent])


def test_directories_without_rules(tmp_path: Path) -> None:
    with pytest.raises(RuleFileError, match="no rule file"):
        load_pack([tmp_path])
    with pytest.raises(RuleFileError, match="no such directory"):
        load_pack([tmp_path / "nowhere"])


class TestChoosing:
    """Which rules run."""

    PACK = pack_of(rule(code="MFC101"), rule(code="MFC102", status="preview"), rule(code="MFC201"))

    def codes(self, settings: Settings) -> list[str]:
        return [each.rule.code for each in chosen_rules(self.PACK, settings)]

    @pytest.mark.parametrize(
        ("settings", "codes"),
        [
            (Settings(), ["MFC101", "MFC201"]),
            (Settings(preview=True), ["MFC101", "MFC102", "MFC201"]),
            (Settings(select=("MFC1",)), ["MFC101"]),
            (Settings(select=("MFC102",)), ["MFC102"]),
            (Settings(ignore=("MFC1",)), ["MFC201"]),
            (Settings(select=("MFC1",), ignore=("MFC101",), preview=True), ["MFC102"]),
            (Settings(select=("MFC9",)), []),
        ],
    )
    def test_by_prefix_and_status(self, settings: Settings, codes: list[str]) -> None:
        assert self.codes(settings) == codes


def test_the_files_of_a_run_share_rules_and_nothing_else() -> None:
    """What is compiled for one file finds the same in the next as if it were the first."""
    pack, settings = load_pack(), Settings()
    shared = chosen_rules(pack, settings)
    assert chosen_rules(pack, Settings()) is shared
    assert chosen_rules(pack, Settings(preview=True)) is not shared
    assert chosen_rules(copy.copy(pack), settings) is not shared
    names = ("degrees_in_scaled_field", "bad_covariance", "clean_px4", "degrees_in_scaled_field")
    for path in [str(SAMPLES / f"{name}.tlog") for name in names]:
        assert check_file(path, pack, settings) == check_file(path, copy.copy(pack), settings)
