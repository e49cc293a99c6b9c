"""The closed vocabularies of the catalogue: a value outside them fails the build.

Every word says one thing only. What does not fit in a word goes into the `remark` of a row.
`docs/conventions.md` explains each word.
"""

from __future__ import annotations

from enum import StrEnum


class Quantity(StrEnum):
    """What a number measures, whatever its unit."""

    LATITUDE = "latitude"
    LONGITUDE = "longitude"
    ALTITUDE = "altitude"
    POSITION = "position"
    POSITION_OFFSET = "position_offset"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    SPECIFIC_FORCE = "specific_force"
    DELTA_VELOCITY = "delta_velocity"
    ATTITUDE_ANGLE = "attitude_angle"
    ATTITUDE_QUATERNION = "attitude_quaternion"
    ANGULAR_RATE = "angular_rate"
    ANGULAR_ACCELERATION = "angular_acceleration"
    DELTA_ANGLE = "delta_angle"
    ANGLE = "angle"
    HEADING = "heading"
    COURSE = "course"
    BEARING = "bearing"
    SPEED = "speed"
    AIRSPEED = "airspeed"
    WIND_SPEED = "wind_speed"
    WIND_VELOCITY = "wind_velocity"
    WIND_DIRECTION = "wind_direction"
    DISTANCE = "distance"
    LIMIT = "limit"
    TIMESTAMP = "timestamp"
    DURATION = "duration"
    COVARIANCE = "covariance"
    ACCURACY = "accuracy"
    DILUTION = "dilution"
    INNOVATION_RATIO = "innovation_ratio"
    ERROR = "error"
    BIAS = "bias"
    MAGNETIC_FIELD = "magnetic_field"
    PRESSURE = "pressure"
    TEMPERATURE = "temperature"
    OPTICAL_FLOW = "optical_flow"
    VIBRATION = "vibration"
    DIRECTION = "direction"
    IMAGE_COORDINATE = "image_coordinate"
    NORMALIZED = "normalized"
    QUALITY = "quality"
    COUNT = "count"
    SEQUENCE = "sequence"
    INSTANCE = "instance"
    ADDRESS = "address"
    MASK = "mask"
    VALIDITY = "validity"
    FRAME_SELECTOR = "frame_selector"
    COMMAND_SELECTOR = "command_selector"
    ALTITUDE_SELECTOR = "altitude_selector"
    ORIENTATION_SELECTOR = "orientation_selector"
    SELECTOR = "selector"
    COMMAND_PARAM = "command_param"


class Frame(StrEnum):
    """The axes that a number is expressed in; rotations are named `target_from_source`."""

    NONE = ""
    WGS84 = "wgs84"
    VERTICAL = "vertical"
    NORTH = "north"
    NED = "ned"
    LOCAL_NED = "local_ned"
    LOCAL = "local"
    MOCAP = "mocap"
    BODY_FRD = "body_frd"
    HEADING_FRD = "heading_frd"
    NED_FROM_FRD = "ned_from_frd"
    LOCAL_FROM_FRD = "local_from_frd"
    MOCAP_FROM_FRD = "mocap_from_frd"
    NED_FROM_CAMERA = "ned_from_camera"
    NED_FROM_SURFACE = "ned_from_surface"
    FRD_FROM_SENSOR = "frd_from_sensor"
    NED_FROM_HEADING = "ned_from_heading"
    NED_FROM_TARGET = "ned_from_target"
    GIMBAL_BY_FLAGS = "gimbal_by_flags"
    GIMBAL_FROM_VEHICLE = "gimbal_from_vehicle"
    GIMBAL = "gimbal"
    CAMERA = "camera"
    IMAGE = "image"
    SENSOR = "sensor"
    BORESIGHT = "boresight"
    AIR = "air"
    TARGET = "target"
    PLATFORM = "platform"
    BY_FIELD = "by_field"
    UNSPECIFIED = "unspecified"


class Axis(StrEnum):
    """Which component of the frame."""

    NONE = ""
    LATITUDE = "lat"
    LONGITUDE = "lon"
    NORTH = "north"
    EAST = "east"
    DOWN = "down"
    UP = "up"
    FORWARD = "forward"
    RIGHT = "right"
    X = "x"
    Y = "y"
    Z = "z"
    XYZ = "xyz"
    ROLL = "roll"
    PITCH = "pitch"
    YAW = "yaw"
    ROLL_PITCH_YAW = "rpy"
    W = "w"
    WXYZ = "wxyz"
    AZIMUTH = "azimuth"
    ELEVATION = "elevation"
    HORIZONTAL = "horizontal"
    VERTICAL = "vertical"
    CROSS_TRACK = "cross_track"
    SLANT = "slant"


class Positive(StrEnum):
    """Which way the number grows."""

    NONE = ""
    NORTH = "north"
    EAST = "east"
    DOWN = "down"
    UP = "up"
    FORWARD = "forward"
    RIGHT = "right"
    RIGHT_HAND = "right_hand"
    RIGHT_WING_DOWN = "right_wing_down"
    NOSE_UP = "nose_up"
    CLOCKWISE = "clockwise"
    FROM = "from"
    TOWARDS = "towards"
    BY_FRAME = "by_frame"
    UNSPECIFIED = "unspecified"


class AltRef(StrEnum):
    """The level that a vertical number is measured from."""

    NONE = ""
    MSL = "msl"
    ELLIPSOID = "ellipsoid"
    HOME = "home"
    ORIGIN = "origin"
    TERRAIN = "terrain"
    GROUND_DISTANCE = "ground_distance"
    PRESSURE = "pressure"
    TARGET = "target"
    BY_FRAME = "by_frame"
    BY_FIELD = "by_field"
    UNSPECIFIED = "unspecified"


class Clock(StrEnum):
    """The clock domain of a stamp; the resolution follows from the unit."""

    NONE = ""
    BOOT = "boot"
    BOOT_EVENT = "boot_event"
    UNIX = "unix"
    UNIX_2019 = "unix_2019"
    UTC_HOUR = "utc_hour"
    GPS = "gps"
    GPS_WEEK = "gps_week"
    AMBIGUOUS = "ambiguous"
    SENDER = "sender"
    DURATION = "duration"


class CovLayout(StrEnum):
    """How a matrix lies in an array; the digits are the side of the matrix."""

    NONE = ""
    UPPER_6 = "upper_6"
    UPPER_9 = "upper_9"
    FULL_6 = "full_6"
    FULL_3 = "full_3"
    DIAGONAL_3 = "diagonal_3"
    DIAGONAL_2 = "diagonal_2"
    VARIANCE = "variance"
    UNSPECIFIED = "unspecified"


class RefPoint(StrEnum):
    """The physical point that a position or a measurement belongs to."""

    NONE = ""
    VEHICLE = "vehicle"
    ANTENNA = "antenna"
    IMU = "imu"
    CAMERA = "camera"
    GIMBAL = "gimbal"
    SENSOR = "sensor"
    OPERATOR = "operator"
    TARGET = "target"
    HOME = "home"
    ORIGIN = "origin"
    PLATFORM = "platform"


class FrameStatus(StrEnum):
    """Whether a MAV_FRAME value may be used."""

    CURRENT = "current"
    SUPERSEDED = "superseded"
    RESERVED = "reserved"


class FrameKind(StrEnum):
    """What sort of coordinates a MAV_FRAME value announces."""

    GLOBAL = "global"
    LOCAL = "local"
    BODY = "body"
    MISSION = "mission"


class MaskSense(StrEnum):
    """What a set bit of a mask says about its field."""

    IGNORE = "ignore"
    USE = "use"
    FLAG = "flag"


DIAGONALS: dict[CovLayout, tuple[int, ...]] = {
    CovLayout.UPPER_6: (0, 6, 11, 15, 18, 20),
    CovLayout.UPPER_9: (0, 9, 17, 24, 30, 35, 39, 42, 44),
    CovLayout.FULL_6: (0, 7, 14, 21, 28, 35),
    CovLayout.FULL_3: (0, 4, 8),
    CovLayout.DIAGONAL_3: (0, 1, 2),
    CovLayout.DIAGONAL_2: (0, 1),
    CovLayout.VARIANCE: (0,),
}
"""Where the variances lie in the array of each layout (MAVLink XML and guide, row-major)."""
