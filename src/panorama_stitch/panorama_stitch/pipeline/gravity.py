"""Gravity as a robot that moves feels it: smoothed, and news only where it has turned."""

from time import monotonic

import numpy as np

_SHARE = 0.05
"""Of the way to what was felt last that the smoothed direction goes: bumps even out."""
_TURNED_RAD = np.radians(0.5)
_PAUSE_S = 2.0
"""A panorama that is levelled anew costs a table for each camera: not more often than so."""


class Gravity:
    """Where things fall in the robot's frame.

    Attributes
    ----------
    direction : ndarray or None
        Unit vector (3,) with x right, y down, z ahead, as it was last used; None before.
    """

    def __init__(self) -> None:
        self.direction: np.ndarray | None = None
        self._smooth: np.ndarray | None = None
        self._used_s = -_PAUSE_S

    def feel(self, gravity: np.ndarray) -> bool:
        """Add what was felt, (3,); return whether `direction` is another one now."""
        former = gravity if self._smooth is None else self._smooth
        smooth = (1 - _SHARE) * former + _SHARE * gravity
        self._smooth = smooth / max(float(np.linalg.norm(smooth)), 1e-9)
        now_s = monotonic()
        if self.direction is not None:
            turned_rad = _angle_rad(self.direction, self._smooth)
            if turned_rad < _TURNED_RAD or now_s - self._used_s < _PAUSE_S:
                return False
        self.direction, self._used_s = self._smooth, now_s
        return True


def _angle_rad(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
