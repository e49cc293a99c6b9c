"""What the stream has said so far: who speaks, who is meant, and what is known of each vehicle."""

from mavframecheck.vehicle.context import Context, Known
from mavframecheck.vehicle.facts import NAMES
from mavframecheck.vehicle.traffic import Traffic

__all__ = ["NAMES", "Context", "Known", "Traffic"]
