"""What all tests share: the same examples in every run, and none that the clock decides."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

_PATIENT = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])

settings.register_profile("repeatable", _PATIENT, derandomize=True)
settings.register_profile("fresh", _PATIENT)
settings.load_profile("repeatable")
