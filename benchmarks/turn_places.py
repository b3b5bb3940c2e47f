"""Five places with true depth in which a robot turns on the spot, and what its cameras see.

Metres; x right, y down, z ahead of the robot before it turns; the cameras are at height 0. Every
ray is cast from where the lens is, so that near things move against far ones as they really do.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache

import cv2
import numpy as np
from raycast import Cylinder, Wall, nearer
from worlds import cut, random_world

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import Lens

_FLOOR_M = 0.9
_TEXTURE_PX = 1024
_BLUR_PX = 1.2
_NOISE = 2.0
_WALK_M = 0.6
"""Half of the way that a person walks up and down during the turn."""


@dataclass(frozen=True)
class Place:
    """What stands around the robot.

    Attributes
    ----------
    size_m
        Of the room: across, along.
    center_m
        Where its middle is, seen from the axis of the turn.
    ceiling_m
        Above the cameras; 0 for the open air, with a world far away above the walls.
    things
        Number of posts, people and cupboards in it.
    nearest_m
        How near they come.
    walker
        Whether one of them walks.
    """

    size_m: tuple[float, float]
    center_m: tuple[float, float] = (0.0, 0.0)
    ceiling_m: float = 1.8
    things: int = 10
    nearest_m: float = 1.2
    walker: bool = True


PLACES = {
    'room': Place((5.0, 4.0), (0.4, -0.3), 1.6, 6, 1.0),
    'office': Place((9.0, 7.0), (-1.0, 0.5), 1.8, 12, 1.2),
    'corridor': Place((2.4, 24.0), (0.1, 3.0), 1.5, 4, 1.0),
    'hall': Place((24.0, 16.0), (2.0, -1.0), 5.0, 16, 1.5),
    'yard': Place((60.0, 40.0), (5.0, 4.0), 0.0, 20, 2.0),
}


@dataclass(frozen=True)
class TurnCamera:
    """A camera that turns with the robot: lens, attitude and place (x, z) in the robot's frame."""

    lens: Lens
    attitude: Attitude
    place_m: tuple[float, float] = (0.0, 0.0)
    noise: float = _NOISE


@dataclass(frozen=True)
class _Walker:
    """A person who walks up and down."""

    at: np.ndarray
    along: np.ndarray
    texture: np.ndarray

    def parts(self, share: float) -> list[Cylinder]:
        x, z = self.at + self.along * _WALK_M * np.sin(4 * np.pi * share)
        body = (0.22, -0.35, 0.3), (0.11, -0.65, -0.35), (0.15, 0.3, _FLOOR_M)
        return [Cylinder(x, z, *part, self.texture) for part in body]


@dataclass(frozen=True)
class TurnScene:
    """A place with all that stands in it.

    Attributes
    ----------
    place
        Which one.
    seed
        Of everything random in it.
    """

    place: Place
    seed: int = 0
    _things: list = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        """Furnish it."""
        rng = np.random.default_rng(self.seed)
        object.__setattr__(self, '_things', [*self._walls(rng), *self._furniture(rng)])
        object.__setattr__(self, '_walker', self._person(rng))

    def pictures(
        self, cameras: Sequence[TurnCamera], angles_rad: Sequence[float]
    ) -> Iterator[tuple[np.ndarray, ...]]:
        """Yield what all cameras see, (height, width) uint8 each, angle after angle."""
        rng = np.random.default_rng(self.seed + 1)
        rays = [_rays(camera.lens) for camera in cameras]
        for number, angle in enumerate(angles_rad):
            moving = self._walker.parts(number / len(angles_rad)) if self.place.walker else []
            turn = Attitude(yaw_rad=angle).matrix
            yield tuple(
                self._picture(camera, turn, ray, moving, rng)
                for camera, ray in zip(cameras, rays, strict=True)
            )

    def _picture(self, camera, turn, rays, moving, rng):
        rays, seen = rays
        world = rays @ (turn @ camera.attitude.matrix).T.astype(np.float32)
        x, _, z = turn @ (camera.place_m[0], 0.0, camera.place_m[1])
        light = _sky(world) if not self.place.ceiling_m else np.zeros(len(world), np.float32)
        nearest = np.full(len(world), np.inf, np.float32)
        for met, color in nearer((*self._things, *moving), x, z, world, nearest):
            light[met] = color[:, 0]
        picture = np.zeros(seen.shape, np.float32)
        picture[seen] = light
        picture = cv2.GaussianBlur(picture, (0, 0), 0.6)
        picture += rng.normal(0, camera.noise, picture.shape)
        picture[~seen] *= 0.1
        return picture.round().clip(0, 255).astype(np.uint8)

    def _walls(self, rng) -> list[Wall]:
        place, infinite = self.place, (-np.inf, np.inf)
        top = -place.ceiling_m if place.ceiling_m else -4.0
        limits = [
            (center - size / 2, center + size / 2)
            for center, size in zip(place.center_m, place.size_m, strict=True)
        ]
        up, tile = (top, _FLOOR_M), max(3.0, max(place.size_m) / 5)
        walls = [Wall(0, at, _texture(rng), tile, (up, infinite)) for at in limits[0]]
        walls += [Wall(2, at, _texture(rng), tile, (infinite, up)) for at in limits[1]]
        walls.append(Wall(1, _FLOOR_M, _texture(rng), tile, tuple(limits)))
        if place.ceiling_m:
            walls.append(Wall(1, top, _texture(rng), tile, tuple(limits)))
        return walls

    def _spot(self, rng):
        """Return where something may stand."""
        place = self.place
        while True:
            spot = place.center_m + rng.uniform(-0.45, 0.45, 2) * place.size_m
            if place.nearest_m < np.hypot(*spot) < 8 * place.nearest_m:
                return spot

    def _furniture(self, rng) -> list[Cylinder]:
        tops = rng.uniform(-1.4, 0.4, self.place.things)
        return [
            Cylinder(*self._spot(rng), rng.uniform(0.04, 0.3), top, _FLOOR_M, _texture(rng))
            for top in tops
        ]

    def _person(self, rng) -> _Walker:
        at = self._spot(rng)
        return _Walker(at, np.array([-at[1], at[0]]) / np.hypot(*at), _texture(rng))


def _rays(lens: Lens) -> tuple[np.ndarray, np.ndarray]:
    """Rays (n, 3) float32 of the pixels that the lens lights, and which these are."""
    pixels = np.stack(np.meshgrid(np.arange(lens.width), np.arange(lens.height)), -1)
    rays, seen = lens.unproject(pixels)
    return rays[seen].astype(np.float32), seen


def _sky(rays: np.ndarray) -> np.ndarray:
    """Grey levels of a world that is far away."""
    world = _world()
    height, width = world.shape
    column = (np.arctan2(rays[:, 0], rays[:, 2]) / (2 * np.pi) + 0.5) * width - 0.5
    row = (np.arcsin(rays[:, 1].clip(-1, 1)) / np.pi + 0.5) * height - 0.5
    parts = [
        cv2.remap(world, column[i : i + 30000], row[i : i + 30000], cv2.INTER_LINEAR)
        for i in range(0, len(rays), 30000)
    ]
    return np.concatenate(parts)[:, 0]


def _texture(rng) -> np.ndarray:
    return cut(_world(), rng, _TEXTURE_PX, 40, 220)


@cache
def _world() -> np.ndarray:
    rng = np.random.default_rng(3)
    mixed = random_world(rng, 'texture') * 0.4 + random_world(rng, 'shapes') * 0.6
    return cv2.GaussianBlur(mixed, (0, 0), _BLUR_PX).astype(np.uint8)
