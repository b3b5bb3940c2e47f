"""The fisheye lens, `equidistant` in ROS."""

from functools import cached_property
from math import pi
from typing import TypeVar

import numpy as np

from fisheye_geometry.lens_model import Lens

_Angle = TypeVar('_Angle', float, np.ndarray)


class FisheyeLens(Lens):
    """Fisheye lens of Kannala and Brandt with four coefficients (OpenCV's fisheye model).

    The distance from the principal point is ``t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9`` focal
    lengths for an angle t from the axis. It is usable up to the angle where that stops growing.

    References
    ----------
    Kannala and Brandt, "A generic camera model and calibration method for conventional,
    wide-angle, and fish-eye lenses", IEEE TPAMI 28(8), 2006, doi 10.1109/TPAMI.2006.153.
    """

    model = 'equidistant'
    coefficient_counts = (4,)

    @cached_property
    def max_angle_rad(self) -> float:
        """Angle at which the radius stops growing, or the edge of the image circle, rad."""
        odd_powers = np.array([1.0, 3.0, 5.0, 7.0, 9.0])
        squares = np.roots((odd_powers * (1.0, *self.distortion))[::-1])
        turning = [np.sqrt(s.real) for s in squares if s.real > 0 and abs(s.imag) < 1e-9]
        return float(min([pi, self.visible_angle_rad, *turning]))

    def _radius(self, angle: _Angle) -> _Angle:
        k1, k2, k3, k4 = self.distortion
        square = angle * angle
        return angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))

    def _slope(self, angle: np.ndarray) -> np.ndarray:
        k1, k2, k3, k4 = self.distortion
        square = angle * angle
        return 1 + square * (3 * k1 + square * (5 * k2 + square * (7 * k3 + square * 9 * k4)))

    def _distort(self, rays: np.ndarray) -> np.ndarray:
        x, y, z = np.moveaxis(rays, -1, 0)
        side = np.hypot(x, y)
        radius = self._radius(np.arctan2(side, z))
        scale = np.divide(radius, side, out=np.zeros_like(side), where=side > 0)
        return np.stack([x * scale, y * scale], axis=-1)

    def _undistort(self, normalized: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, v = np.moveaxis(normalized, -1, 0)
        radius = np.hypot(u, v)
        # Rays at the very edge come back with a rounding error that must not hide them.
        seen = radius <= self._radius(self.max_angle_rad) * (1 + 1e-12)
        angle = self._angle(np.where(seen, radius, 0.0))
        scale = np.divide(np.sin(angle), radius, out=np.ones_like(radius), where=radius > 0)
        return np.stack([u * scale, v * scale, np.cos(angle)], axis=-1), seen

    def _angle(self, radius: np.ndarray) -> np.ndarray:
        """Invert `_radius`: a table gives the start, Newton's method the rest."""
        table = np.linspace(0.0, self.max_angle_rad, 4096)
        angle = np.interp(radius, self._radius(table), table)
        for _ in range(4):
            # The slope reaches 0 where the lens ends; the table's start is exact there already.
            slope = np.maximum(self._slope(angle), 1e-6)
            step = (self._radius(angle) - radius) / slope
            angle = np.clip(angle - step, 0.0, self.max_angle_rad)
        return angle
