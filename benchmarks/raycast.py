"""Things that rays meet: upright cylinders and rectangles; x to the right, y down, z ahead, m."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np


class Hit(NamedTuple):
    """What rays meet, which of them, in which colour (n, 3) uint8 and how far away."""

    rays: np.ndarray
    color: np.ndarray
    distance: np.ndarray


@dataclass(frozen=True, eq=False)
class Cylinder:
    """An upright one."""

    x: float
    z: float
    radius: float
    top: float
    bottom: float
    texture: np.ndarray

    def meet(self, x: float, z: float, rays: np.ndarray) -> Hit:
        """Look along rays (n, 3) from (x, 0, z)."""
        x, z = x - self.x, z - self.z
        a = rays[:, 0] ** 2 + rays[:, 2] ** 2
        b = rays[:, 0] * x + rays[:, 2] * z
        inside = b * b - a * (x * x + z * z - self.radius**2)
        hit = np.flatnonzero((inside > 0) & (b < 0))
        k = (-b[hit] - np.sqrt(inside[hit])) / a[hit]
        y = k * rays[hit, 1]
        within = (y > self.top) & (y < self.bottom)
        hit, k, y = hit[within], k[within], y[within]
        around = np.arctan2(x + k * rays[hit, 0], z + k * rays[hit, 2]) * self.radius
        return Hit(hit, _sampled(self.texture, around, y, 1.0), k)


@dataclass(frozen=True, eq=False)
class Wall:
    """A rectangle across one axis, at `at` along it; `within` limits the other two axes, m."""

    axis: int
    at: float
    texture: np.ndarray
    tile_m: float
    within: tuple[tuple[float, float], tuple[float, float]] = ((-np.inf, np.inf),) * 2

    def meet(self, x: float, z: float, rays: np.ndarray) -> Hit:
        """Look along rays (n, 3) from (x, 0, z)."""
        eye = x, 0.0, z
        with np.errstate(divide='ignore'):
            k = np.float32(self.at - eye[self.axis]) / rays[:, self.axis]
        hit = np.flatnonzero((k > 1e-3) & np.isfinite(k))
        for axis, (low, high) in zip(self._others, self.within, strict=True):
            value = eye[axis] + k[hit] * rays[hit, axis]
            hit = hit[(value >= low) & (value <= high)]
        one, two = (eye[axis] + k[hit] * rays[hit, axis] for axis in self._others)
        return Hit(hit, _sampled(self.texture, one, two, self.tile_m), k[hit])

    @property
    def _others(self) -> list[int]:
        return [axis for axis in range(3) if axis != self.axis]


def nearer(
    things: Iterable[Cylinder | Wall], x: float, z: float, rays: np.ndarray, distance: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield which rays from (x, 0, z) meet each thing before `distance` (n,), and the colours.

    `distance` then tells how far these are.
    """
    for thing in things:
        met = thing.meet(x, z, rays)
        closer = met.distance < distance[met.rays]
        distance[met.rays[closer]] = met.distance[closer]
        yield met.rays[closer], met.color[closer]


def _sampled(texture: np.ndarray, across: np.ndarray, down: np.ndarray, tile_m: float):
    """(n, 3) uint8 of a texture that is laid mirrored to all sides."""
    size = np.float32(texture.shape[:2])
    # Its mirror images do not meet straight ahead.
    u, v = (np.abs(np.mod(c / tile_m + 0.37, 2) - 1) for c in (across, down))
    x, y = u * (size[1] - 1), v * (size[0] - 1)
    maps = [np.float32(c).reshape(-1, 1) for c in (x, y)]
    # The side of a picture that OpenCV remaps is limited.
    parts = [
        cv2.remap(texture, *(c[i : i + 30000] for c in maps), cv2.INTER_LINEAR)
        for i in range(0, len(x), 30000)
    ]
    return np.concatenate([np.empty((0, 1, 3), np.uint8), *parts])[:, 0]
