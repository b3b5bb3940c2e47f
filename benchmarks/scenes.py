"""Scenes with depth: a far background, and things near the cameras, seen from any place.

Metres; x right, y down, z ahead. Every ray is cast, so that near things move between two lenses as
they really do, and hide what is behind them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi

import cv2
import numpy as np

FAR = -1
"""Index of the background."""


@dataclass(frozen=True, eq=False)
class Post:
    """An upright cylinder: a post, a mast, a tree, or a person's body."""

    x: float
    z: float
    radius: float
    top: float
    bottom: float
    texture: np.ndarray

    def meet(self, origin, rays):
        """Distances along rays (n, 3), inf where they miss, and grey levels."""
        x, y, z = rays.T
        dx, dz = origin[0] - self.x, origin[2] - self.z
        a = np.maximum(x * x + z * z, 1e-12)
        half_b = x * dx + z * dz
        root = half_b**2 - a * (dx * dx + dz * dz - self.radius**2)
        distance = (-half_b - np.sqrt(np.maximum(root, 0))) / a
        height = origin[1] + distance * y
        hit = (root > 0) & (distance > 0.01) & (height > self.top) & (height < self.bottom)
        around = np.arctan2(dx + distance * x, dz + distance * z) * self.radius
        return np.where(hit, distance, np.inf), _textured(self.texture, around, height)


@dataclass(frozen=True, eq=False)
class Panel:
    """A flat thing: floor, wall, side of a box. `size` is its extent from `corner` along axes."""

    corner: np.ndarray
    right: np.ndarray
    down: np.ndarray
    size: tuple[float, float]
    texture: np.ndarray

    def meet(self, origin, rays):
        """As `Post.meet`."""
        normal = np.cross(self.right, self.down)
        slope = rays @ normal
        slope = np.where(np.abs(slope) < 1e-9, 1e-9, slope)
        distance = ((self.corner - origin) @ normal) / slope
        place = origin + distance[:, None] * rays - self.corner
        a, b = place @ self.right, place @ self.down
        hit = (distance > 0.01) & (a >= 0) & (a <= self.size[0]) & (b >= 0) & (b <= self.size[1])
        return np.where(hit, distance, np.inf), _textured(self.texture, a, b)


TEXELS_PER_M = 200.0
_ROW = 1024
"""`cv2.remap` takes no side of more than 32767."""


def _textured(texture, a, b):
    """Grey levels of a texture that repeats, at places in metres."""
    height, width = texture.shape
    a = np.nan_to_num(a * TEXELS_PER_M, posinf=0, neginf=0) % width
    b = np.nan_to_num(b * TEXELS_PER_M, posinf=0, neginf=0) % height
    return _sampled(texture, a, b)


def _sampled(picture, x, y):
    """Grey levels (n,) of a picture, which goes on across its edges, at pixels (n,) each."""
    rows = -(-len(x) // _ROW)
    places = np.zeros((rows * _ROW, 2), np.float32)
    places[: len(x), 0], places[: len(x), 1] = x, y
    places = places.reshape(rows, _ROW, 2)
    levels = cv2.remap(picture, places, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_WRAP)
    return levels.ravel()[: len(x)]


@dataclass(frozen=True, eq=False)
class OverlapScene:
    """What is around a rig.

    Attributes
    ----------
    background
        (h, 2 h) float32, equirectangular, infinitely far.
    things
        What is nearer.
    """

    background: np.ndarray
    things: Sequence[Post | Panel] = field(default_factory=tuple)

    def look(self, origin: np.ndarray, rays: np.ndarray, density: float):
        """Return grey levels, and indices of what is seen, for rays (..., 3) of the scene.

        Parameters
        ----------
        origin
            (3,) where the lens is.
        rays
            Unit vectors.
        density
            Pixels per radian of the camera: the background is not drawn finer.
        """
        shape, rays = rays.shape[:-1], rays.reshape(-1, 3)
        light = self._far(rays, density)
        nearest = np.full(len(rays), np.inf)
        index = np.full(len(rays), FAR)
        for number, thing in enumerate(self.things):
            distance, level = thing.meet(origin, rays)
            closer = distance < nearest
            light[closer], nearest[closer], index[closer] = level[closer], distance[closer], number
        return light.reshape(shape), index.reshape(shape)

    def _far(self, rays, density):
        width = min(self.background.shape[1], round(2 * pi * density) // 2 * 2)
        world = cv2.resize(self.background, (width, width // 2), interpolation=cv2.INTER_AREA)
        x, y, z = rays.T
        column = (np.arctan2(x, z) / (2 * pi) + 0.5) * width - 0.5
        row = (np.arcsin(np.clip(y, -1, 1)) / pi + 0.5) * (width // 2) - 0.5
        return _sampled(world, column, row)


def random_things(rng, texture) -> list[Post | Panel]:
    """Put up to five things near the rig: posts, people, boxes, a floor, a wall.

    Parameters
    ----------
    rng
        Random numbers.
    texture
        Called with `rng`: a new texture (h, w) float32.
    """
    things = []
    floor = rng.uniform(0.3, 1.3)
    if rng.random() < 0.6:
        reach = rng.uniform(1.0, 8.0)
        corner = np.array([-reach, floor, -reach])
        axes = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
        things.append(Panel(corner, *axes, (2 * reach, 2 * reach), texture(rng)))
    for _ in range(int(rng.integers(0, 4))):
        angle, distance = rng.normal(0, 0.35), np.exp(rng.uniform(np.log(0.5), np.log(4)))
        x, z = distance * np.sin(angle), distance * np.cos(angle)
        kind = rng.integers(3)
        if kind == 0:
            radius = min(rng.uniform(0.01, 0.06), distance / 8)
            things.append(Post(x, z, radius, -rng.uniform(0.2, 3), floor, _plain(rng)))
        elif kind == 1:
            top, distance = floor - 1.75, max(distance, 1.0)
            x, z = distance * np.sin(angle), distance * np.cos(angle)
            things.append(Post(x, z, 0.22, top + 0.3, floor, texture(rng)))
            things.append(Post(x, z, 0.1, top, top + 0.3, _plain(rng)))
        else:
            things += _box(rng, x, z, angle, distance, floor, texture)
    return things


def _box(rng, x, z, angle, distance, floor, texture):
    wide, high = np.minimum(rng.uniform(0.1, 0.9, 2), 0.6 * distance)
    turn = angle + rng.uniform(-0.5, 0.5)
    right = np.array([np.cos(turn), 0.0, -np.sin(turn)])
    back = np.array([np.sin(turn), 0.0, np.cos(turn)])
    down = np.array([0.0, 1.0, 0.0])
    top = floor - high if rng.random() < 0.6 else rng.uniform(-0.6, floor - high)
    corner = np.array([x, top, z]) - right * wide / 2
    side = texture(rng)
    return [
        Panel(corner, right, down, (wide, high), side),
        Panel(corner, back, down, (wide, high), side * 0.7),
        Panel(corner + right * wide, back, down, (wide, high), side * 0.8),
        Panel(corner, right, back, (wide, wide), side),
    ]


def _plain(rng):
    return np.full((8, 8), rng.uniform(10, 240), np.float32)
