"""A world of random texture, and views of it through lenses of any attitude; for tests."""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from fisheye_geometry.lens import FisheyeLens
from panorama_stitch.overlap.view import OverlapView

WIDTH, HEIGHT = 320, 240
LENS = FisheyeLens(
    WIDTH,
    HEIGHT,
    WIDTH / np.radians(170),
    WIDTH / np.radians(170),
    (WIDTH - 1) / 2,
    (HEIGHT - 1) / 2,
    (0.0, 0.0, 0.0, 0.0),
    visible_angle_rad=np.radians(85),
)
WORLD_PX = 2048


def world(seed: int) -> np.ndarray:
    """(h, 2 h) float32: blotches of many sizes."""
    rng = np.random.default_rng(seed)
    total = np.zeros((WORLD_PX // 2, WORLD_PX), np.float32)
    for cells in (16, 32, 64, 128, 256):
        blotches = rng.standard_normal((cells // 2, cells)).astype(np.float32)
        total += cv2.resize(blotches, (WORLD_PX, WORLD_PX // 2), interpolation=cv2.INTER_CUBIC)
    total -= total.min()
    return 20 + total * (215 / total.max())


def rays(lens=LENS) -> tuple[np.ndarray, np.ndarray]:
    """Rays (h, w, 3) of a picture's pixels, and which there are."""
    y, x = np.mgrid[: lens.height, : lens.width]
    return lens.unproject(np.stack([x, y], axis=-1))


def see(
    around, attitude: Rotation, origin=(0.0, 0.0, 0.0), post=None, lens=LENS, seed=0
) -> OverlapView:
    """Look at a world that is infinitely far, and at an upright post.

    Parameters
    ----------
    around
        As of `world`.
    attitude
        Takes the camera's rays to the world's.
    origin
        Where the lens is, m.
    post
        (x, z, radius) m, grey; None: no post.
    lens
        The camera.
    seed
        Of the noise.
    """
    directions, lit = rays(lens)
    x, y, z = np.moveaxis(directions @ attitude.as_matrix().T, -1, 0)
    column = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * WORLD_PX - 0.5
    row = (np.arcsin(np.clip(y, -1, 1)) / np.pi + 0.5) * WORLD_PX / 2 - 0.5
    places = np.stack([column, row], -1).astype(np.float32)
    light = cv2.remap(around, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    if post is not None:
        dx, dz = post[0] - origin[0], post[1] - origin[2]
        miss = np.arcsin(post[2] / np.hypot(dx, dz))
        at = np.arctan2(x, z) - np.arctan2(dx, dz)
        light = np.where(np.abs(at) < miss, 100 + 60 * np.sign(np.sin(40 * y)), light)
    light = light + np.random.default_rng(seed).normal(0, 2, light.shape)
    return OverlapView(np.where(lit, np.clip(light, 1, 255), 0).astype(np.uint8), lens)


def turned(*, yaw=0.0, pitch=0.0, roll=0.0) -> Rotation:
    """An attitude from angles, deg."""
    return Rotation.from_euler('YXZ', [yaw, pitch, roll], degrees=True)


def apart_deg(one: Rotation, other: Rotation) -> float:
    """Angle between two rotations."""
    return float(np.degrees((one.inv() * other).magnitude()))
