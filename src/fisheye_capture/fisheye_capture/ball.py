"""The ball that bounces back and forth across bearing 0 of the synthetic world."""

from dataclasses import dataclass
from math import cos, pi, radians, sin, tan

import numpy as np

PERIOD_NS = 6_000_000_000
"""Time in which it goes to the right, to the left and back."""
_REACH_RAD = radians(40)
_LOWEST_RAD, _BOUNCE_RAD = radians(-21), radians(15)
_RADIUS_RAD = radians(6.5)
_SEGMENTS = 5
_RED, _WHITE = np.array([(44, 70, 190), (184, 190, 194)], np.float32)
"""BGR."""
_TO_LIGHT = np.array([-0.5, -0.62, -0.6], np.float32)
_SOFTNESS_PX = 2.5
"""Width of its edges; as soft as the town around it."""


@dataclass(frozen=True)
class Ball:
    """Where the ball is: bearing to the right, elevation up, and how far it has spun, rad."""

    bearing_rad: float
    elevation_rad: float
    spin_rad: float

    @classmethod
    def at(cls, stamp_ns: int) -> 'Ball':
        """Return the ball at a time since the epoch."""
        phase = 2 * pi * (stamp_ns % PERIOD_NS) / PERIOD_NS
        bearing = _REACH_RAD * sin(phase)
        return cls(bearing, _LOWEST_RAD + _BOUNCE_RAD * abs(sin(3 * phase)), 4 * bearing)

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors (3, 3) to its right, down, and from the viewer through its centre."""
        sin_b, cos_b = sin(self.bearing_rad), cos(self.bearing_rad)
        sin_e, cos_e = sin(self.elevation_rad), cos(self.elevation_rad)
        right = (cos_b, 0.0, -sin_b)
        forward = (sin_b * cos_e, -sin_e, cos_b * cos_e)
        return np.array([right, np.cross(forward, right), forward])

    def rim(self) -> np.ndarray:
        """Return directions (N, 3) just around the ball."""
        angle = np.linspace(0, 2 * pi, 32, endpoint=False)
        radius = tan(1.1 * _RADIUS_RAD)
        local = [radius * np.cos(angle), radius * np.sin(angle), np.ones_like(angle)]
        return np.stack(local, axis=-1) @ self.axes

    def seen_along(self, rays: np.ndarray, px_per_rad: float) -> tuple[np.ndarray, np.ndarray]:
        """Return what an image shows of the ball.

        Parameters
        ----------
        rays
            (..., 3) unit vectors in the world; zeros see nothing.
        px_per_rad
            Resolution of the picture.

        Returns
        -------
        color : ndarray
            (..., 3) float32 BGR.
        cover : ndarray
            (..., 1) float32, 0 to 1: how much of the pixel the ball fills.
        """
        x, y, forward = np.moveaxis(rays @ self.axes.T.astype(np.float32), -1, 0)
        scale = tan(_RADIUS_RAD) * np.maximum(forward, 0.1)
        x, y = x / scale, y / scale
        radius = np.hypot(x, y)
        sharpness = _RADIUS_RAD * px_per_rad / _SOFTNESS_PX
        cover = np.clip(0.5 + (1 - radius) * sharpness, 0, 1) * (forward > 0.1)
        wave = np.sin(_SEGMENTS * (np.arctan2(y, x) - self.spin_rad))
        red = np.clip(0.5 + wave * radius / _SEGMENTS * sharpness, 0, 1)[..., None]
        normal = np.stack([x, y, -np.sqrt(np.maximum(1 - radius * radius, 0))], axis=-1)
        light = 0.55 + 0.45 * np.maximum(normal @ _TO_LIGHT, 0)[..., None]
        return (red * _RED + (1 - red) * _WHITE) * light, cover[..., None]
