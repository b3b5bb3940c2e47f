"""The conventional lens, `plumb_bob` and `rational_polynomial` in ROS."""

from functools import cached_property

import cv2
import numpy as np

from fisheye_geometry.lens_model import Lens

_ITERATIONS = 20
"""Of Newton's method; what it has not found by then is no ray of a real lens."""
_CLOSE = 1e-9
"""Normalized picture coordinates that are the same."""


class PinholeLens(Lens):
    """Conventional lens with the distortion of Brown and Conrady (`plumb_bob` and rational).

    The formulas are those of OpenCV's `projectPoints`, which does the forward mapping here:
    k1, k2, p1, p2, k3, of the rational form k4, k5, k6 too, then the thin prism's s1 to s4 and
    the tilt of the sensor, tau_x and tau_y, rad.

    References
    ----------
    Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966.
    """

    model = 'plumb_bob'
    coefficient_counts = (0, 4, 5, 8, 12, 14)
    _STEEPEST = 1.5
    """No plane picture reaches 90 degrees; rad."""

    @property
    def ros_model(self) -> str:
        """`distortion_model` of REP-104, which names the rational form apart."""
        return 'rational_polynomial' if len(self.distortion) >= 8 else 'plumb_bob'

    @cached_property
    def max_angle_rad(self) -> float:
        """Angle at which the distortion folds back somewhere, or the image circle's edge, rad."""
        angles = np.linspace(0.0, self._STEEPEST, 3000)
        # Prism and tilt are not the same all around.
        around = np.linspace(0.0, 2 * np.pi, 8 if len(self.distortion) > 8 else 1, endpoint=False)
        side = np.sin(angles)[:, None]
        rays = np.stack(
            np.broadcast_arrays(
                side * np.cos(around), side * np.sin(around), np.cos(angles)[:, None]
            ),
            axis=-1,
        )
        outwards = np.stack([np.cos(around), np.sin(around)], axis=-1)
        distance = (self._distort(rays) * outwards).sum(axis=-1)
        folds = np.flatnonzero((np.diff(distance, axis=0) <= 0).any(axis=-1))
        limit = angles[folds[0]] if len(folds) else self._STEEPEST
        return float(min(limit, self.visible_angle_rad))

    def _distort(self, rays: np.ndarray) -> np.ndarray:
        rays = np.asarray(rays, float)
        if not rays.size:
            return rays[..., :2]
        none = np.zeros(3)
        pixels, _ = cv2.projectPoints(
            rays.reshape(-1, 1, 3), none, none, np.eye(3), np.array(self.distortion)
        )
        return pixels.reshape(*rays.shape[:-1], 2)

    def _undistort(self, normalized: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        shape = normalized.shape[:-1]
        target = normalized.reshape(-1, 2)
        plane = self._start(target)
        left = np.arange(len(plane))
        for _ in range(_ITERATIONS):
            now, step = plane[left], 1e-6
            value = self._on_plane(now)
            miss = target[left] - value
            is_off = np.hypot(*miss.T) > _CLOSE / 10
            left, now, value, miss = left[is_off], now[is_off], value[is_off], miss[is_off]
            if not len(left):
                break
            a, c = ((self._on_plane(now + np.array([step, 0.0])) - value) / step).T
            b, d = ((self._on_plane(now + np.array([0.0, step])) - value) / step).T
            determinant = a * d - b * c
            flat = np.abs(determinant) < 1e-9
            a, b, c, d, determinant = np.where(
                flat, [[1.0], [0.0], [0.0], [1.0], [1.0]], [a, b, c, d, determinant]
            )
            move = np.stack([d * miss[:, 0] - b * miss[:, 1], a * miss[:, 1] - c * miss[:, 0]])
            plane[left] = now + (move / determinant).T.clip(-0.5, 0.5)
        rays = np.concatenate([plane, np.ones((len(plane), 1))], axis=-1)
        angle = np.arctan(np.hypot(*plane.T))
        seen = np.hypot(*(self._on_plane(plane) - target).T) < _CLOSE
        seen &= angle <= self.max_angle_rad * (1 + 1e-12)
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays.reshape(*shape, 3), seen.reshape(shape)

    def _start(self, target: np.ndarray) -> np.ndarray:
        """Undo the radial part by a table: near enough for Newton's method to converge."""
        angles = np.linspace(0.0, self.max_angle_rad, 4096)
        rays = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
        radius = np.hypot(*target.T)
        plain = np.tan(np.interp(radius, self._distort(rays)[:, 0], angles))
        return (
            target * np.divide(plain, radius, out=np.ones_like(radius), where=radius > 0)[:, None]
        )

    def _on_plane(self, plane: np.ndarray) -> np.ndarray:
        return self._distort(np.concatenate([plane, np.ones((len(plane), 1))], axis=-1))
