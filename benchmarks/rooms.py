"""Rooms with true depth, seen by two cameras beside each other and from midway between them.

All of a room is grey; who crosses is coloured, so that how much of them a panorama shows can be
told from its colours, however it was warped or faded.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from raycast import Cylinder, Wall, nearer
from worlds import cut, random_world

FOCAL_PX = 215.0
"""Of a panorama from 640x480 px, 170 degrees."""
FRAMES = 60
OVERLAP_DEG, VIEW_DEG, ROWS = 30.0, 70.0, 400
CROSSINGS = 'person', 'pole', 'box'
CHROMA = 120.0
"""Grey levels by which red exceeds green in whoever crosses, and in nothing else."""
_SUPERSAMPLING = 2
_NOISE = 2.0
_FLOOR_M, _CEILING_M = 1.2, -1.6
"""Below the cameras."""
_WALL_BEHIND_M = 2.5
_POST_TOP_M, _PAINT = -0.5, (110, 80, 200)
_CLUTTER, _CLUTTER_DEG = 4, 20.0
_WALK_DEG = 13.0
_TURN_DEG_PER_FRAME = 0.5
_VIEWPOINTS = -0.5, 0.5, 0.0
"""Left, right and midway, in units of the lenses' distance."""


class Shot(NamedTuple):
    """One moment, (ROWS, width, 3) uint8, VIEW_DEG wide; `moving`: where anything crosses."""

    left: np.ndarray
    right: np.ndarray
    midway: np.ndarray
    moving: np.ndarray


@dataclass(frozen=True)
class RoomScene:
    """A room and who crosses it.

    Attributes
    ----------
    nearest_m
        Distance of the nearest things.
    apart_m
        Distance between the two lenses.
    crossing
        One of `CROSSINGS`, or empty: the robot turns instead; or a post.
    post
        Its radius and distance, m.
    """

    nearest_m: float
    apart_m: float
    crossing: str = ''
    seed: int = 1
    post: tuple[float, float] = (0.05, 2.0)

    def shots(self, count: int = FRAMES) -> Iterator[Shot]:
        """Yield what is seen, moment after moment."""
        rng = np.random.default_rng([self.seed, round(100 * self.nearest_m)])
        room, step, seen = self._room(rng), 1 / max(1, count - 1), []
        for i in range(count):
            turn = 0.0 if self.crossing else np.radians(_TURN_DEG_PER_FRAME) * i
            if turn or not seen:
                seen = [self._look(room, at, turn) for at in _VIEWPOINTS]
            bearing = np.radians(_WALK_DEG) * (2 * i * step - 1)
            crossing = self._crossing(bearing) if self.crossing else []
            images, moving = [], np.zeros(_shape(), bool)
            for at, (color, distance) in zip(_VIEWPOINTS, seen, strict=True):
                color, nearest = self._look(crossing, at, turn, (color, distance))
                moving |= _reduced(nearest < distance) > 0
                images.append(_reduced(color))
            noise = (rng.standard_normal(c.shape, np.float32) * _NOISE for c in images[:2])
            noisy = [image + n for image, n in zip(images, noise, strict=False)]
            drawn = (c.round().clip(0, 255).astype(np.uint8) for c in (*noisy, images[2]))
            yield Shot(*drawn, moving)

    def _look(self, things, at: float, turn: float, behind=None):
        """Look at things, and at what is behind them, from `at` times the lenses' distance."""
        x, z = at * self.apart_m * np.cos(turn), -at * self.apart_m * np.sin(turn)
        rays = _rays(turn)
        if behind is None:
            behind = np.zeros(rays.shape, np.uint8), np.full(len(rays), np.inf, np.float32)
        color, distance = (c.copy() for c in behind)
        for met, seen in nearer(things, x, z, rays, distance):
            color[met] = seen
        return color, distance

    def _room(self, rng) -> list:
        far = self.nearest_m + _WALL_BEHIND_M
        walls = [Wall(axis, at * far, _plaster(rng), 2.5) for axis in (0, 2) for at in (-1, 1)]
        tiles = np.kron(rng.integers(60, 190, (8, 8)), np.ones((48, 48))).astype(np.uint8)
        floor = Wall(1, _FLOOR_M, cv2.merge([cv2.GaussianBlur(tiles, (0, 0), 1)] * 3), 2.0)
        ceiling = Wall(1, _CEILING_M, _plaster(rng), 4.0)
        clutter = []
        for bearing in np.radians(np.linspace(-_CLUTTER_DEG, _CLUTTER_DEG, _CLUTTER)):
            radius = rng.uniform(0.02, 0.12) * min(self.nearest_m, 1.5)
            z = self.nearest_m * rng.uniform(1.1, 1.8) + radius
            top = rng.uniform(-1.5, 0.3)
            place = np.tan(bearing + rng.uniform(-0.05, 0.05)) * z, z
            clutter.append(Cylinder(*place, radius, top, _FLOOR_M, _plaster(rng)))
        return [*walls, floor, ceiling, *clutter]

    def _crossing(self, bearing: float) -> list:
        """Make what crosses, as it is when its middle is seen at that bearing."""
        texture = _clothes(self.seed)
        if self.crossing == 'post':
            radius, z = self.post
            paint = np.full((8, 8, 3), _PAINT, np.uint8)
            return [Cylinder(z * np.tan(bearing), z, radius, _POST_TOP_M, _FLOOR_M, paint)]
        if self.crossing == 'pole':
            z = self.nearest_m + 0.03
            return [Cylinder(z * np.tan(bearing), z, 0.03, -1.4, _FLOOR_M, texture)]
        if self.crossing == 'box':
            x, front = self.nearest_m * np.tan(bearing), self.nearest_m
            low, high = (x - 0.2, x + 0.2), (front, front + 0.3)
            height = -0.1, 0.4
            return [
                Wall(2, front, texture, 1.0, (low, height)),
                Wall(0, low[0], texture, 1.0, (height, high)),
                Wall(0, low[1], texture, 1.0, (height, high)),
                Wall(1, height[0], texture, 1.0, (low, high)),
            ]
        z = self.nearest_m + 0.22
        x = z * np.tan(bearing)
        parts = (0, 0.22, -0.25, 0.45), (0, 0.11, -0.55, -0.27)
        legs = (-0.1, 0.09, 0.45, _FLOOR_M), (0.1, 0.09, 0.45, _FLOOR_M)
        return [Cylinder(x + part[0], z, *part[1:], texture) for part in (*parts, *legs)]


def _shape() -> tuple[int, int]:
    return ROWS, round(np.radians(VIEW_DEG) * FOCAL_PX)


@lru_cache(1)
def _rays(turn: float) -> np.ndarray:
    height, width = (n * _SUPERSAMPLING for n in _shape())
    bearing = ((np.arange(width) + 0.5 - width / 2) / FOCAL_PX / _SUPERSAMPLING + turn)[None, :]
    down = ((np.arange(height) + 0.5 - height / 2) / FOCAL_PX / _SUPERSAMPLING)[:, None]
    rays = np.broadcast_arrays(np.sin(bearing), down, np.cos(bearing))
    return np.stack(rays, axis=-1).reshape(-1, 3).astype(np.float32)


def _reduced(values: np.ndarray) -> np.ndarray:
    height, width = _shape()
    fine = values.reshape(height * _SUPERSAMPLING, width * _SUPERSAMPLING, -1)
    if values.dtype == bool:
        fine = fine.astype(np.uint8) * 255
    return cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)


def _plaster(rng) -> np.ndarray:
    return cut(_world(), rng, 512, 50, 210)


@cache
def _world() -> np.ndarray:
    rng = np.random.default_rng(3)
    fine = random_world(rng, 'texture') * 0.3
    return (fine + random_world(rng, 'shapes') * 0.7).astype(np.uint8)


@cache
def _clothes(seed: int) -> np.ndarray:
    """Make a coloured texture: red exceeds green by `CHROMA` everywhere."""
    level = np.float32(_plaster(np.random.default_rng(seed))[..., 0])
    level = 80 + (level - level.min()) * (90 / max(1.0, float(np.ptp(level))))
    return np.stack([level, level - CHROMA / 2, level + CHROMA / 2], -1).astype(np.uint8)
