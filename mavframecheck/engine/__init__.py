"""Rules over rows: loading, expressions, running, episodes, verdicts."""

from mavframecheck.engine.check import check_file, check_recording, draw_file
from mavframecheck.engine.choices import parameter, selectors, similar
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.expression import RuleFileError
from mavframecheck.engine.pack import chosen_rules, load_pack
from mavframecheck.engine.settings import Settings, SettingsError

__all__ = [
    "Pack",
    "RuleFileError",
    "Settings",
    "SettingsError",
    "check_file",
    "check_recording",
    "chosen_rules",
    "draw_file",
    "load_pack",
    "parameter",
    "selectors",
    "similar",
]
