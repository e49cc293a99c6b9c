"""Which way the axes really point: what streams say of motion, beside the motion there was.

`judge` listens and compares, `axes` tells where the axes of a position or velocity point, `attitude` and
`twist` how a rotation and a velocity are to be read, `lever` how far beside the vehicle a stream measures, `checks` are the rules. `holds` and `response` put what was
asked for beside what was done; `commanded` has the rules on that.
"""

from mavframecheck.checks.motion.checks import (
    BodyAxes,
    EstimateScale,
    EulerSwapped,
    LeverArm,
    LocalAxes,
    PoseRotation,
    QuarterTurn,
    QuaternionOrder,
    SensorMount,
    SpeedFrame,
    Unaligned,
    VectorFrame,
    Vertical,
    YawSign,
)
from mavframecheck.checks.motion.commanded import AttitudeFrame, Response
from mavframecheck.checks.motion.gyros import Units
from mavframecheck.checks.motion.representations import Representations
from mavframecheck.checks.motion.stale import StalePose
from mavframecheck.checks.motion.wind import WindDirection

__all__ = [
    "AttitudeFrame",
    "BodyAxes",
    "EstimateScale",
    "EulerSwapped",
    "LeverArm",
    "LocalAxes",
    "PoseRotation",
    "QuarterTurn",
    "QuaternionOrder",
    "Representations",
    "Response",
    "SensorMount",
    "SpeedFrame",
    "StalePose",
    "Unaligned",
    "Units",
    "VectorFrame",
    "Vertical",
    "WindDirection",
    "YawSign",
]
