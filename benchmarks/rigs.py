"""Random two-camera rigs in random worlds whose true overlap is known; equal seeds, equal rigs."""

from dataclasses import dataclass, field
from math import pi, radians, tan

import cv2
import numpy as np
from worlds import STYLES, WORLD_WIDTH, random_world

from fisheye_geometry.lens import FisheyeLens, Lens
from fisheye_geometry.remap import Turn
from fisheye_geometry.surface import Surface

SIZES = ((320, 240), (640, 480), (640, 480), (800, 600), (1280, 960))


@dataclass(frozen=True)
class RandomRig:
    """One pair of frames and the truth about it.

    Attributes
    ----------
    offset_deg
        Angle from the left picture's centre to the right one's that aligns the scene at the
        horizon.
    common_deg
        Width of the scene that both see, negative where there is none.
    """

    name: str
    left: np.ndarray
    right: np.ndarray
    left_lens: Lens
    right_lens: Lens
    surface: str
    offset_deg: float
    common_deg: float
    overlaps: bool
    about: dict = field(default_factory=dict)


def random_rig(seed: int, overlaps: bool = True) -> RandomRig:
    """Make a rig; without `overlaps` it looks at two worlds, or at two ends of one."""
    rng = np.random.default_rng([seed, overlaps])
    style = STYLES[rng.integers(len(STYLES) - overlaps)]
    world = random_world(rng, style)
    width, height = SIZES[rng.integers(len(SIZES))]
    yaw_deg = rng.uniform(120, 160)
    other = world
    if not overlaps:
        if rng.random() < 0.5:
            other = random_world(rng, style)
        else:
            yaw_deg = 180.0
    parallax_deg = rng.uniform(0, 3) if rng.random() < 0.5 else 0.0
    tilt = rng.uniform(-2, 2, 2) if rng.random() < 0.5 else np.zeros(2)
    lens = random_lens(rng, width, height, 170.0 if yaw_deg == 180 else rng.choice([170.0, 180.0]))
    room = rng.random() < 0.5
    step = 2 * tan(radians(parallax_deg) / 2)
    noise, vignetting = rng.uniform(0, 10), rng.uniform(0, 0.4)
    exposure = np.exp(rng.uniform(np.log(0.7), np.log(1.4)))
    frames = [
        _expose(rng, see(lens, scene, turn, (x, 0.0, 0.0), room), lens, gain, vignetting, noise)
        for scene, turn, x, gain in (
            (world, Turn(-radians(yaw_deg) / 2), -step / 2, 1.0),
            (other, Turn(radians(yaw_deg) / 2, *np.radians(tilt)), step / 2, exposure),
        )
    ]
    offset_deg = yaw_deg + parallax_deg
    seen_deg = np.degrees(lens.max_angle_rad) * 2
    return RandomRig(
        name=f'{style}_{seed}',
        left=frames[0],
        right=frames[1],
        left_lens=lens,
        right_lens=lens,
        surface=('cylindrical', 'equirectangular')[rng.integers(2)],
        offset_deg=offset_deg,
        common_deg=min(seen_deg, seen_deg) - offset_deg if overlaps else -1.0,
        overlaps=overlaps,
        about={
            'size': f'{width}x{height}',
            'exposure': round(float(exposure), 2),
            'noise': round(noise, 1),
            'parallax_deg': round(parallax_deg, 2),
            'tilt_deg': [round(float(t), 2) for t in tilt],
            'style': style,
        },
    )


def random_lens(rng, width: int, height: int, fov_deg: float) -> FisheyeLens:
    """Make a fisheye whose image circle is as wide as its picture."""
    edge = radians(fov_deg) / 2
    distortion = tuple(np.array([-0.02, 0.004, -0.001, 0.0001]) * rng.uniform(0, 2))
    unit = FisheyeLens(width, height, 1.0, 1.0, 0.0, 0.0, distortion)
    radius, _ = unit.project(np.array([np.sin(edge), 0.0, np.cos(edge)]))
    focal = width / 2 / float(radius[0])
    shift = rng.uniform(-0.01, 0.01, 2) * width
    return FisheyeLens(
        width,
        height,
        focal,
        focal,
        (width - 1) / 2 + shift[0],
        (height - 1) / 2 + shift[1],
        distortion,
        visible_angle_rad=edge,
    )


def see(lens: Lens, world: np.ndarray, turn: Turn, place, room: bool) -> np.ndarray:
    """Look at a world (its surface one unit away) from `place` through a lens.

    Parameters
    ----------
    world
        (h, 2 h) float32, equirectangular.
    place
        (3,) the camera's position; the world's centre is the origin.
    room
        Whether the world is a round room with floor and ceiling, or a ball.

    Returns
    -------
    ndarray
        (lens.height, lens.width) float32, 0 where the lens sees nothing.
    """
    y, x = np.mgrid[: lens.height, : lens.width]
    rays, seen = lens.unproject(np.stack([x, y], axis=-1))
    points = _meet(np.asarray(place, float), rays @ turn.matrix.T, room)
    width = max(2, round(min(WORLD_WIDTH, 2 * pi * lens.focal_x_px)) // 2 * 2)
    world = cv2.resize(world, (width, width // 2), interpolation=cv2.INTER_AREA)
    sphere = Surface(
        'equirectangular', width, width // 2, width / 2 / pi, (width - 1) / 2, (width / 2 - 1) / 2
    )
    where, _ = sphere.project(points)
    picture = cv2.remap(
        world,
        *np.moveaxis(where.astype(np.float32), -1, 0),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP,
    )
    return np.where(seen, picture, 0.0)


def _meet(place, rays, room):
    """Points at which rays from `place` meet the world."""
    if not room:
        along = rays @ place
        return place + rays * (np.sqrt(along**2 + 1 - place @ place) - along)[..., None]
    x, y, z = np.moveaxis(rays, -1, 0)
    side = np.maximum(x * x + z * z, 1e-9)
    along = (x * place[0] + z * place[2]) / side
    wall = np.sqrt(along**2 + (1 - place[0] ** 2 - place[2] ** 2) / side) - along
    flat = np.where(y > 0, 0.6, 1.0) / np.maximum(np.abs(y), 1e-9)
    return place + rays * np.minimum(wall, flat)[..., None]


def _expose(rng, picture, lens, gain, vignetting, noise):
    """Turn light into a frame: vignetting, exposure, noise, 8 bits; black outside the circle."""
    y, x = np.ogrid[: lens.height, : lens.width]
    radius = np.hypot(x - lens.center_x_px, y - lens.center_y_px) / (lens.width / 2)
    lit = picture > 0
    picture = picture * gain * (1 - vignetting * np.minimum(radius, 1) ** 2)
    picture += rng.normal(0, max(noise, 1e-3), picture.shape)
    return np.where(lit, np.clip(np.rint(picture), 1, 255), 0).astype(np.uint8)
