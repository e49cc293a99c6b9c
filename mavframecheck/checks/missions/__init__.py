"""Rules about whole missions, fences and rally points, as they went over the link or stand in a file.

`plans` gathers them with what is known of the vehicles; every other module is a rule, or a few of a kind.
"""

from mavframecheck.checks.missions.fences import FenceGeometry
from mavframecheck.checks.missions.legs import ImplausibleLeg
from mavframecheck.checks.missions.modes import PlanHeights
from mavframecheck.checks.missions.order import Sequence
from mavframecheck.checks.missions.profile import AltitudeProfile
from mavframecheck.checks.missions.readback import Differs
from mavframecheck.checks.missions.rounded import Rounded
from mavframecheck.checks.missions.terrain import TerrainClearance
from mavframecheck.checks.missions.track import TrackAgainstPlan
from mavframecheck.checks.missions.yaw import ZeroYaw

__all__ = [
    "AltitudeProfile",
    "Differs",
    "FenceGeometry",
    "ImplausibleLeg",
    "PlanHeights",
    "Rounded",
    "Sequence",
    "TerrainClearance",
    "TrackAgainstPlan",
    "ZeroYaw",
]
