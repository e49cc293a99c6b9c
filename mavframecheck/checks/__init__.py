"""Checks that need memory over time, written in Python; a rule names one as `check = "module.Class"`."""

from mavframecheck.checks.base import Check, Observation, Verdict, load_check

__all__ = ["Check", "Observation", "Verdict", "load_check"]
