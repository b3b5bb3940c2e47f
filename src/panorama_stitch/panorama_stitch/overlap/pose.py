"""Where one corrected picture lies in another, after a small turn of its camera."""

from dataclasses import dataclass

import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.surface import Surface

_SMALL_RAD = 1e-3
"""Turn over which the movement of a pixel is taken as straight."""


@dataclass(frozen=True)
class Pose:
    """Offset of the right picture in the left one, px, with the right camera turned, rad."""

    x_px: float
    y_px: float
    pitch_rad: float = 0.0
    roll_rad: float = 0.0

    @property
    def turn(self) -> Attitude:
        """The right camera's turn, with which the offset is meant."""
        return Attitude(0.0, self.pitch_rad, self.roll_rad)

    def moved(self, step: np.ndarray) -> 'Pose':
        """Return the pose after a step (4,) in x, y, pitch and roll."""
        x, y, pitch, roll = map(float, step)
        return Pose(self.x_px + x, self.y_px + y, self.pitch_rad + pitch, self.roll_rad + roll)

    def scaled(self, factor: float) -> 'Pose':
        """Return the same pose in pixels of another size."""
        return Pose(self.x_px * factor, self.y_px * factor, self.pitch_rad, self.roll_rad)

    def place(self, surface: Surface, points: np.ndarray) -> np.ndarray:
        """Map points of the right image to the left one.

        Parameters
        ----------
        surface
            The right picture's.
        points
            (n, 2) px.

        Returns
        -------
        ndarray
            (n, 2) float64 px.
        """
        if self.pitch_rad or self.roll_rad:
            rays = surface.rays(points[:, 0], points[:, 1]) @ self.turn.matrix.T
            points, _ = surface.project(rays)
        return points + np.array([self.x_px, self.y_px])

    def jacobian(self, surface: Surface, points: np.ndarray) -> np.ndarray:
        """How the places (n, 2) of points move with x, y, pitch and roll: (n, 2, 4)."""
        here = self.place(surface, points)
        jacobian = np.zeros((len(points), 2, 4))
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
        for k in (2, 3):
            step = np.zeros(4)
            step[k] = _SMALL_RAD
            jacobian[:, :, k] = (self.moved(step).place(surface, points) - here) / _SMALL_RAD
        return jacobian
