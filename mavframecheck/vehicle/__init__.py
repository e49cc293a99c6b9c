"""What the stream has said so far: who speaks, who is meant, and what is known of each vehicle."""

from mavframecheck.vehicle.context import CONTEXT_NAMES, Context, Known
from mavframecheck.vehicle.traffic import Traffic

__all__ = ["CONTEXT_NAMES", "Context", "Known", "Traffic"]
