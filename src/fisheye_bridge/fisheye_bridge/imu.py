"""sensor_msgs/Imu to the direction in which things fall."""

import numpy as np
from sensor_msgs.msg import Imu

from fisheye_bridge.stamps import ns_of
from fisheye_geometry.inertial import ImuReading

_UNKNOWN = -1.0
"""First number of a covariance that says that a quantity is not measured (sensor_msgs/Imu)."""
_LEAST_M_S2 = 1.0
"""Less acceleration is free fall, or none was measured."""
_BODY_TO_OPTICAL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""REP-103: from a body's frame (x ahead, y left, z up) to that of a camera that looks ahead."""


def reading_of(message: Imu) -> ImuReading | None:
    """Return what a message tells of where things fall, in the frame of an optical frame ahead.

    Parameters
    ----------
    message
        In a body's frame after REP-103; its orientation where one is given, else its
        acceleration, which holds while the robot does not accelerate.

    Returns
    -------
    ImuReading or None
        None where the message says neither.
    """
    stamp_ns, turn_rad_s = ns_of(message.header.stamp), _turn(message)
    q = message.orientation
    x, y, z, w = (q.x, q.y, q.z, q.w)
    norm = float(np.sqrt(x * x + y * y + z * z + w * w))
    if message.orientation_covariance[0] != _UNKNOWN and 0.9 < norm < 1.1:
        # The world's vertical in the body's frame: the last row of the rotation matrix.
        up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])
        return ImuReading(stamp_ns, _down(up), turn_rad_s=turn_rad_s)
    a = message.linear_acceleration
    up = np.array([a.x, a.y, a.z])
    if message.linear_acceleration_covariance[0] == _UNKNOWN:
        return None
    if not np.isfinite(up).all() or np.linalg.norm(up) < _LEAST_M_S2:
        return None
    return ImuReading(stamp_ns, _down(up), False, float(np.linalg.norm(up)), turn_rad_s)


def _down(up: np.ndarray) -> np.ndarray:
    return -_BODY_TO_OPTICAL @ (up / np.linalg.norm(up))


def _turn(message: Imu) -> np.ndarray | None:
    rate = message.angular_velocity
    turn_rad_s = _BODY_TO_OPTICAL @ (rate.x, rate.y, rate.z)
    if message.angular_velocity_covariance[0] == _UNKNOWN or not np.isfinite(turn_rad_s).all():
        return None
    return turn_rad_s
