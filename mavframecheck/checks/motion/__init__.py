"""Which way the axes really point: what streams say of motion, beside the motion there was.

`judge` listens and compares, `axes` tells where the axes of a position or velocity point, `attitude` and
`twist` how a rotation and a velocity are to be read, `checks` are the rules.
"""

from mavframecheck.checks.motion.checks import (
    BodyAxes,
    EstimateScale,
    EulerSwapped,
    LocalAxes,
    PoseRotation,
    QuarterTurn,
    QuaternionOrder,
    Unaligned,
    VectorFrame,
    Vertical,
    YawSign,
)

__all__ = [
    "BodyAxes",
    "EstimateScale",
    "EulerSwapped",
    "LocalAxes",
    "PoseRotation",
    "QuarterTurn",
    "QuaternionOrder",
    "Unaligned",
    "VectorFrame",
    "Vertical",
    "YawSign",
]
