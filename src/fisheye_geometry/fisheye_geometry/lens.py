"""Lens models: rays of the optical frame to pixels and back, past 90 degrees off axis.

Frames follow REP-103 (z forward, x right, y down); integer pixel coordinates are pixel centres.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot, isfinite, pi
from typing import ClassVar

import cv2
import numpy as np

from fisheye_geometry.errors import CalibrationError

MAX_PICTURE_SIDE_PX = 16384
"""Larger pictures do not fit the 16-bit maps of OpenCV's remap."""


@dataclass(frozen=True)
class Lens(ABC):
    """A calibrated camera: picture size, camera matrix, distortion, and how far it sees.

    `visible_angle_rad` is the radius of the image circle where it is known; the lens's own
    `max_angle_rad` never exceeds it.
    """

    width: int
    height: int
    focal_x_px: float
    focal_y_px: float
    center_x_px: float
    center_y_px: float
    distortion: tuple[float, ...] = ()
    skew_px: float = 0.0
    visible_angle_rad: float = pi

    model: ClassVar[str] = ''
    coefficient_counts: ClassVar[tuple[int, ...]] = ()

    def __post_init__(self):
        for name in ('width', 'height'):
            side = getattr(self, name)
            if not 1 <= side <= MAX_PICTURE_SIDE_PX:
                raise CalibrationError(
                    f'{name} is {side} px; expected 1 to {MAX_PICTURE_SIDE_PX} px'
                )
        for name in ('focal_x_px', 'focal_y_px', 'visible_angle_rad'):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise CalibrationError(f'{name} is {value}; expected a finite number above 0')
        for value in (self.center_x_px, self.center_y_px, self.skew_px, *self.distortion):
            if not isfinite(value):
                raise CalibrationError(
                    f'principal point, skew and distortion must be finite numbers; found {value}'
                )
        if len(self.distortion) not in self.coefficient_counts:
            expected = ' or '.join(map(str, self.coefficient_counts))
            raise CalibrationError(
                f'{len(self.distortion)} distortion coefficients; '
                f"the model '{self.model}' has {expected}"
            )

    @property
    def matrix(self) -> np.ndarray:
        """Camera matrix K, (3, 3) float64, in px."""
        return np.array(
            [
                [self.focal_x_px, self.skew_px, self.center_x_px],
                [0.0, self.focal_y_px, self.center_y_px],
                [0.0, 0.0, 1.0],
            ]
        )

    @property
    def ros_model(self) -> str:
        """`distortion_model` of REP-104."""
        return self.model

    @property
    @abstractmethod
    def max_angle_rad(self) -> float:
        """Largest angle from the optical axis at which the lens maps rays to pixels, rad."""

    @abstractmethod
    def _distort(self, rays: np.ndarray) -> np.ndarray:
        """Rays (..., 3) within `max_angle_rad` to normalized picture coordinates (..., 2)."""

    @abstractmethod
    def _undistort(self, normalized: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normalized picture coordinates (..., 2) to unit rays (..., 3) and their validity."""

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give the pixels at which rays meet the picture.

        Parameters
        ----------
        rays
            (..., 3) directions in the optical frame, of any length above 0.

        Returns
        -------
        pixels : ndarray
            (..., 2) float64, px; outside the picture too, if the lens bends the ray there.
        seen : ndarray
            (...) bool; False beyond `max_angle_rad`, where `pixels` means nothing.
        """
        rays = np.asarray(rays, float)
        x, y, z = np.moveaxis(rays, -1, 0)
        seen = np.arctan2(np.hypot(x, y), z) <= self.max_angle_rad
        u, v = np.moveaxis(self._distort(np.where(seen[..., None], rays, (0.0, 0.0, 1.0))), -1, 0)
        pixels = np.stack(
            [
                self.focal_x_px * u + self.skew_px * v + self.center_x_px,
                self.focal_y_px * v + self.center_y_px,
            ],
            axis=-1,
        )
        return pixels, seen

    def unproject(self, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give the rays that meet the picture at pixels; the inverse of `project`.

        Parameters
        ----------
        pixels
            (..., 2) px.

        Returns
        -------
        rays : ndarray
            (..., 3) float64 unit vectors in the optical frame.
        seen : ndarray
            (...) bool; False where no ray within `max_angle_rad` meets the pixel.
        """
        x, y = np.moveaxis(np.asarray(pixels, float), -1, 0)
        v = (y - self.center_y_px) / self.focal_y_px
        u = (x - self.center_x_px - self.skew_px * v) / self.focal_x_px
        return self._undistort(np.stack([u, v], axis=-1))

    def angle_at(self, x_px: float, y_px: float) -> float:
        """Angle between the optical axis and the ray at a pixel, rad, `max_angle_rad` at most."""
        ray, seen = self.unproject(np.array([x_px, y_px]))
        if not seen:
            return self.max_angle_rad
        return float(np.arctan2(hypot(ray[0], ray[1]), ray[2]))

    def seen_within(self, angle_rad: float) -> 'Lens':
        """Give the same lens with an image circle of this radius, rad."""
        return replace(self, visible_angle_rad=angle_rad)


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

    def _radius(self, angle):
        k1, k2, k3, k4 = self.distortion
        square = angle * angle
        return angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))

    def _slope(self, angle):
        k1, k2, k3, k4 = self.distortion
        square = angle * angle
        return 1 + square * (3 * k1 + square * (5 * k2 + square * (7 * k3 + square * 9 * k4)))

    def _distort(self, rays):
        x, y, z = np.moveaxis(rays, -1, 0)
        side = np.hypot(x, y)
        radius = self._radius(np.arctan2(side, z))
        scale = np.divide(radius, side, out=np.zeros_like(side), where=side > 0)
        return np.stack([x * scale, y * scale], axis=-1)

    def _undistort(self, normalized):
        u, v = np.moveaxis(normalized, -1, 0)
        radius = np.hypot(u, v)
        # Rays at the very edge come back with a rounding error that must not hide them.
        seen = radius <= self._radius(self.max_angle_rad) * (1 + 1e-12)
        angle = self._angle(np.where(seen, radius, 0.0))
        scale = np.divide(np.sin(angle), radius, out=np.ones_like(radius), where=radius > 0)
        return np.stack([u * scale, v * scale, np.cos(angle)], axis=-1), seen

    def _angle(self, radius):
        """Invert `_radius`: a table gives the start, Newton's method the rest."""
        table = np.linspace(0.0, self.max_angle_rad, 4096)
        angle = np.interp(radius, self._radius(table), table)
        for _ in range(4):
            # The slope reaches 0 where the lens ends; the table's start is exact there already.
            slope = np.maximum(self._slope(angle), 1e-6)
            step = (self._radius(angle) - radius) / slope
            angle = np.clip(angle - step, 0.0, self.max_angle_rad)
        return angle


class PinholeLens(Lens):
    """Conventional lens with the distortion of Brown and Conrady (`plumb_bob` and rational).

    The formulas are those of OpenCV's `projectPoints`, which does the forward mapping here.

    References
    ----------
    Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966.
    """

    model = 'plumb_bob'
    coefficient_counts = (0, 4, 5, 8)
    _STEEPEST = 1.5
    """No plane picture reaches 90 degrees; rad."""

    @property
    def ros_model(self) -> str:
        """`distortion_model` of REP-104, which names the rational form apart."""
        return 'rational_polynomial' if len(self.distortion) == 8 else 'plumb_bob'

    @cached_property
    def max_angle_rad(self) -> float:
        """Angle at which the radial distortion folds back, or the image circle's edge, rad."""
        angles = np.linspace(0.0, self._STEEPEST, 3000)
        rays = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
        folds = np.flatnonzero(np.diff(self._distort(rays)[:, 0]) <= 0)
        limit = angles[folds[0]] if len(folds) else self._STEEPEST
        return float(min(limit, self.visible_angle_rad))

    def _distort(self, rays):
        rays = np.asarray(rays, float)
        none = np.zeros(3)
        pixels, _ = cv2.projectPoints(
            rays.reshape(-1, 1, 3), none, none, np.eye(3), np.array(self.distortion)
        )
        return pixels.reshape(*rays.shape[:-1], 2)

    def _undistort(self, normalized):
        shape = normalized.shape[:-1]
        target = normalized.reshape(-1, 2)
        plane = self._start(target)
        for _ in range(20):
            value = self._on_plane(plane)
            step = 1e-6
            dx = (self._on_plane(plane + np.array([step, 0.0])) - value) / step
            dy = (self._on_plane(plane + np.array([0.0, step])) - value) / step
            jacobian = np.stack([dx, dy], axis=-1)
            determinant = np.linalg.det(jacobian)
            jacobian[np.abs(determinant) < 1e-9] = np.eye(2)
            miss = (target - value)[..., None]
            plane = plane + np.linalg.solve(jacobian, miss)[..., 0].clip(-0.5, 0.5)
        rays = np.concatenate([plane, np.ones((len(plane), 1))], axis=-1)
        angle = np.arctan(np.hypot(*plane.T))
        seen = np.hypot(*(self._on_plane(plane) - target).T) < 1e-9
        seen &= angle <= self.max_angle_rad * (1 + 1e-12)
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays.reshape(*shape, 3), seen.reshape(shape)

    def _start(self, target):
        """Undo the radial part by a table: near enough for Newton's method to converge."""
        angles = np.linspace(0.0, self.max_angle_rad, 4096)
        rays = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
        radius = np.hypot(*target.T)
        plain = np.tan(np.interp(radius, self._distort(rays)[:, 0], angles))
        return (
            target * np.divide(plain, radius, out=np.ones_like(radius), where=radius > 0)[:, None]
        )

    def _on_plane(self, plane):
        return self._distort(np.concatenate([plane, np.ones((len(plane), 1))], axis=-1))


_MODELS = {
    'equidistant': FisheyeLens,
    'fisheye': FisheyeLens,
    'plumb_bob': PinholeLens,
    'rational_polynomial': PinholeLens,
}


def make_lens(model: str, width: int, height: int, matrix, distortion) -> Lens:
    """Build the lens that a ROS camera_info describes.

    Parameters
    ----------
    model
        `distortion_model` of REP-104: `equidistant` (or `fisheye`), `plumb_bob`,
        `rational_polynomial`.
    width, height
        Size of the picture, px.
    matrix
        Camera matrix K, nine numbers in row order or (3, 3), px.
    distortion
        The model's coefficients.

    Raises
    ------
    CalibrationError
        For an unknown model and for numbers that describe no lens.
    """
    if model not in _MODELS:
        raise CalibrationError(
            f"distortion model '{model}' is not known; expected one of {', '.join(_MODELS)}"
        )
    matrix = np.asarray(matrix, float).reshape(3, 3)
    focal_x, skew, center_x = matrix[0]
    return _MODELS[model](
        width=int(width),
        height=int(height),
        focal_x_px=float(focal_x),
        focal_y_px=float(matrix[1, 1]),
        center_x_px=float(center_x),
        center_y_px=float(matrix[1, 2]),
        distortion=tuple(float(k) for k in distortion),
        skew_px=float(skew),
    )
