"""Random pairs of cameras in random scenes whose true rotation is known; equal seeds, equal rigs.

What varies is what varies in the field: place, near things at their true depth, the robot's own
body, lens, size, overlap, tilt, distance between the lenses, exposure, noise and blur.
"""

import os
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from mounts import half_width_rad, random_attitudes, random_lenses
from scenes import FAR, OverlapScene, random_things
from scipy.spatial.transform import Rotation
from worlds import STYLES, random_world

from fisheye_geometry.lens import Lens, PinholeLens

PLACES = Path(os.environ.get('FISHEYE_PLACES', ''))
"""Folder of equirectangular pictures of real places, if there are any, to look at beside random
worlds."""
REAL_SHARE = 0.6
NEAR_SHARE = 0.05, 0.5
"""Of what both cameras see, where anything is near."""


@dataclass(frozen=True)
class RandomRig:
    """One pair of frames and the truth about it.

    Attributes
    ----------
    rotation
        Takes rays of the right camera's optical frame to the left one's.
    overlap_deg
        Width of the scene that both see at the horizon; 0 without a common scene.
    far_share
        Part of the common scene that is far.
    """

    name: str
    left: np.ndarray
    right: np.ndarray
    lenses: tuple[Lens, Lens]
    rotation: Rotation
    overlap_deg: float
    far_share: float
    about: dict = field(default_factory=dict)


def random_rig(seed: int, *, common: bool = True, held_out: bool = False) -> RandomRig:
    """Make a rig; without `common` it looks at two places, of one texture or of two.

    Parameters
    ----------
    seed
        Of everything random.
    common
        Whether the cameras see a common scene.
    held_out
        Which half of the real places to use: what is fitted on one is reported on the other.
    """
    rng = np.random.default_rng([seed, common, held_out])
    style, world = _world(rng, held_out)
    other = world
    opposite = not common and rng.random() < 0.5  # two ends of one place: the same textures
    if not (common or opposite):
        other = _elsewhere(rng, style, held_out)
    overlap_deg = rng.uniform(8, 60)
    lenses = random_lenses(rng, 170.0 if opposite else 200.0)
    reach_deg = [np.degrees(half_width_rad(lens)) for lens in lenses]
    yaw_deg = min(sum(reach_deg) - overlap_deg, 180.0)
    overlap_deg = sum(reach_deg) - yaw_deg
    attitudes = random_attitudes(rng, 180.0, 0.1) if opposite else random_attitudes(rng, yaw_deg)
    baseline_m = rng.uniform(0.02, 0.3)
    place = np.array([baseline_m / 2, *(rng.normal(0, 0.05, 2) * baseline_m)])
    scene, near_share = OverlapScene(world), 0.0
    if common and rng.random() < 0.4:
        scene, near_share = _with_near_things(rng, world, lenses, attitudes, place)
    exposure = np.exp(rng.uniform(np.log(0.25), np.log(4))) ** (rng.random() < 0.5)
    noise, blur_px = rng.uniform(0, 15) * rng.random(), rng.uniform(0, 1.2) * rng.random()
    images, lit = [], []
    for lens, turn, origin, around, gain in zip(
        lenses,
        attitudes,
        (-place, place),
        (scene, scene if common else OverlapScene(other)),
        (exposure**-0.5, exposure**0.5),
        strict=True,
    ):
        light, inside = _look(around, lens, turn, origin)
        lit.append(inside)
        images.append(_expose(rng, light, inside, lens, gain, noise, blur_px))
    body = _add_body(rng, images, lit) if rng.random() < 0.15 else 0.0
    return RandomRig(
        name=f'{style}_{seed}',
        left=images[0],
        right=images[1],
        lenses=lenses,
        rotation=attitudes[0].inv() * attitudes[1],
        overlap_deg=overlap_deg if common else 0.0,
        far_share=(1 - near_share) * (1 - body) if common else 0.0,
        about={
            'size': f'{lenses[0].width}x{lenses[0].height}',
            'exposure': round(float(exposure), 2),
            'noise': round(noise, 1),
            'blur_px': round(blur_px, 1),
            'baseline_m': round(baseline_m, 2),
            'yaw_deg': round(yaw_deg, 1),
            'near': round(near_share, 2),
            'body': round(body, 2),
            'style': style,
        },
    )


def _world(rng, held_out):
    places = _places()[held_out::2]
    if places and rng.random() < REAL_SHARE:
        place = places[rng.integers(len(places))]
        world = _picture(place)
        world = np.roll(world, rng.integers(world.shape[1]), axis=1)
        return place.stem, world if rng.random() < 0.5 else world[:, ::-1].copy()
    style = STYLES[rng.integers(len(STYLES) - 1)]
    return style, random_world(rng, style)


def _elsewhere(rng, style, held_out):
    """Another world: of the same style, or of another place."""
    if rng.random() < 0.5 and style in STYLES:
        return random_world(rng, style)
    while True:
        other_style, other = _world(rng, held_out)
        if other_style != style:
            return other


@lru_cache
def _places():
    return sorted(PLACES.glob('*.png')) if str(PLACES) != '.' else []


@lru_cache
def _picture(path):
    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).astype(np.float32)


def _texture(rng):
    """What a near thing is covered with: a piece of a random world, or a tiling."""
    if rng.random() < 0.15:
        cell = int(rng.integers(10, 60))
        tile = (np.indices((2 * cell, 2 * cell)) // cell).sum(axis=0) % 2
        return (tile * rng.uniform(30, 180) + rng.uniform(20, 70)).astype(np.float32)
    noise = np.zeros((256, 256), np.float32)
    for cells in (4, 8, 16, 32, 64):
        layer = rng.standard_normal((cells, cells)).astype(np.float32)
        noise += cv2.resize(layer, (256, 256), interpolation=cv2.INTER_CUBIC) / cells**0.5
    noise = (noise - noise.mean()) / noise.std()
    return np.clip(rng.uniform(60, 180) + noise * rng.uniform(5, 50), 2, 250).astype(np.float32)


def _look(scene, lens, turn, origin):
    y, x = np.mgrid[: lens.height, : lens.width]
    pixels = np.stack([x, y], axis=-1).astype(float)
    if isinstance(lens, PinholeLens):  # the lens's own inverse is exact, and slow for a picture
        flat = cv2.undistortPoints(
            pixels.reshape(-1, 1, 2), lens.matrix, np.array(lens.distortion)
        )
        rays = np.dstack([flat.reshape(*x.shape, 2), np.ones(x.shape)])
        rays, lit = rays / np.linalg.norm(rays, axis=-1, keepdims=True), np.ones(x.shape, bool)
    else:
        rays, lit = lens.unproject(pixels)
    return scene.look(origin, rays @ turn.as_matrix().T, lens.focal_x_px)[0], lit


def _with_near_things(rng, world, lenses, attitudes, place):
    """Put things near the rig that take 5 to 50 % of what both see; the scene, and the share."""
    angle, z = np.meshgrid(np.linspace(-np.pi, np.pi, 160, endpoint=False), np.linspace(-1, 1, 80))
    side = np.sqrt(1 - z**2)
    rays = np.stack([side * np.sin(angle), z, side * np.cos(angle)], -1).reshape(-1, 3)
    for lens, turn in zip(lenses, attitudes, strict=True):
        pixels, inside = lens.project(rays @ turn.as_matrix())
        x, y = pixels.T
        inside &= (x >= 0) & (y >= 0) & (x < lens.width) & (y < lens.height)
        rays = rays[inside]
    for _ in range(50):
        scene = OverlapScene(world, tuple(random_things(rng, _texture)))
        near = np.zeros(len(rays), bool)
        for origin in (-place, place):
            near |= scene.look(origin, rays, 10.0)[1] != FAR
        if NEAR_SHARE[0] < near.mean() < NEAR_SHARE[1]:
            return scene, float(near.mean())
    return OverlapScene(world), 0.0


def _expose(rng, light, lit, lens, gain, noise, blur_px):
    """Turn light into a frame: blur, vignetting, exposure, noise, 8 bits; black outside."""
    if blur_px > 0.2:
        light = cv2.GaussianBlur(light, (0, 0), blur_px)
    y, x = np.ogrid[: lens.height, : lens.width]
    radius = np.hypot(x - lens.center_x_px, y - lens.center_y_px) / (lens.width / 2)
    light = light * gain * (1 - rng.uniform(0, 0.4) * np.minimum(radius, 1) ** 2)
    light = light + rng.normal(0, max(noise, 1e-3), light.shape)
    return np.where(lit, np.clip(np.rint(light), 1, 255), 0).astype(np.uint8)


def _add_body(rng, images, lit):
    """Paint the robot's own body at the same pixels of both frames; return the share it takes."""
    if images[0].shape != images[1].shape:
        return 0.0
    height, width = images[0].shape
    share = rng.uniform(0.1, 0.35)
    x = np.arange(width)
    edge = height * (1 - share + 0.03 * np.sin(x / width * rng.uniform(5, 30)))
    y = np.arange(height)[:, None]
    period = rng.uniform(0.02, 0.08) * width
    if rng.random() < 0.5:
        pattern = ((x + y) // period % 2) * 150 + 40
    else:
        pattern = ((x // period + y // period) % 2) * 120 + 50
    for image, inside in zip(images, lit, strict=True):
        body = (y > edge) & inside
        image[body] = np.clip(pattern + rng.normal(0, 3, pattern.shape), 1, 255)[body]
    return share
