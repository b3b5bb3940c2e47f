"""What every lens is: rays of the optical frame to pixels and back, past 90 degrees off axis.

Frames follow REP-103 (z forward, x right, y down); integer pixel coordinates are pixel centres.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import hypot, pi
from typing import ClassVar

import numpy as np

from fisheye_core.errors import CalibrationError

MAX_PICTURE_SIDE_PX = 16384
"""Larger pictures do not fit the 16-bit maps of OpenCV's remap."""
_LARGEST = 1e6
"""No number of a real lens comes near it, and none below it overflows."""


@dataclass(frozen=True)
class Lens(ABC):
    """A calibrated camera: picture size, camera matrix, distortion, and how far it sees.

    Attributes
    ----------
    width, height
        Size of the picture, px.
    focal_x_px, focal_y_px
        Pixels per unit of the normalized picture: of a fisheye lens pixels per radian at the axis.
    center_x_px, center_y_px
        Principal point, px.
    distortion
        The model's coefficients, in the order that ROS gives them; without unit.
    skew_px
        Pixels to the right for each unit down of the normalized picture.
    visible_angle_rad
        Radius of the image circle where it is known; `max_angle_rad` never exceeds it.
    model
        `distortion_model` in a camera_info.
    has_image_circle
        Whether the lens lights a circle around its axis, or something else.
    coefficient_counts
        How many coefficients the model may have.

    Raises
    ------
    CalibrationError
        If the numbers describe no possible lens.
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
    has_image_circle: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for name in ('width', 'height'):
            side = getattr(self, name)
            if not 1 <= side <= MAX_PICTURE_SIDE_PX:
                raise CalibrationError(
                    f'{name} is {side} px; expected 1 to {MAX_PICTURE_SIDE_PX} px'
                )
        for name in ('focal_x_px', 'focal_y_px', 'visible_angle_rad'):
            value = getattr(self, name)
            if not 1 / _LARGEST <= value <= _LARGEST:
                raise CalibrationError(
                    f'{name} is {value}; expected a number above 0, up to {_LARGEST:g}'
                )
        for value in (self.center_x_px, self.center_y_px, self.skew_px, *self.distortion):
            if not abs(value) <= _LARGEST:
                raise CalibrationError(
                    'principal point, skew and distortion must be finite numbers up to '
                    f'{_LARGEST:g}; found {value}'
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
        """Return the pixels at which rays meet the picture.

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
        """Return the rays that meet the picture at pixels; the inverse of `project`.

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

    def field_rad(self) -> tuple[float, float, float, float]:
        """Return what it sees to the left, right, up and down of its axis, rad."""
        return (
            self.angle_at(-0.5, self.center_y_px),
            self.angle_at(self.width - 0.5, self.center_y_px),
            self.angle_at(self.center_x_px, -0.5),
            self.angle_at(self.center_x_px, self.height - 0.5),
        )

    def with_max_angle(self, angle_rad: float) -> 'Lens':
        """Return the same lens with an image circle of this radius, rad."""
        return replace(self, visible_angle_rad=angle_rad)
