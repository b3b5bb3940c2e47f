"""What an IMU tells at one moment."""

from typing import NamedTuple

import numpy as np


class ImuReading(NamedTuple):
    """One message of an IMU, in the frame x right, y down, z ahead of the robot.

    Attributes
    ----------
    stamp_ns
        When it was measured.
    down
        Unit vector (3,): where things fall.
    is_fused
        Whether `down` comes from an orientation, which the IMU has filtered itself; otherwise it
        is the direction of an acceleration.
    acceleration
        Length of that acceleration, in the unit of the IMU; 0 for an orientation.
    turn_rad_s
        Angular velocity (3,); None where it is not measured.
    """

    stamp_ns: int
    down: np.ndarray
    is_fused: bool = True
    acceleration: float = 0.0
    turn_rad_s: np.ndarray | None = None
