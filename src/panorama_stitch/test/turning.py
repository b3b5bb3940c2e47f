"""A rig that turns on the spot in a world that is far away, or before landmarks that are near."""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.sheet_model import intrinsics_of
from panorama_stitch.turn.sightings import Sightings
from panorama_stitch.turn.turn_state import TurnState

MOUNTS_DEG = {'left': (-70.0, -8.0, 1.0), 'right': (70.0, -5.0, -2.0)}
"""Yaw, pitch and roll."""
DISTORTION = (0.02, -0.01, 0.003, -0.0008)
_OUTLIER_PX = 20.0


def turning_lens(width: int = 320, focal: float = 107.5) -> FisheyeLens:
    """Return a lens of 170 degrees whose axis is not in the middle."""
    height = width * 3 // 4
    center = (width - 1) / 2 + 1.5, (height - 1) / 2 - 1.0
    lens = FisheyeLens(width, height, focal, focal, *center, DISTORTION)
    return lens.with_max_angle(np.radians(87))


def mounts() -> list[Attitude]:
    """Return the attitudes of both cameras."""
    return [Attitude(*np.radians(angles)) for angles in MOUNTS_DEG.values()]


def turn_pictures(
    world: np.ndarray, lens: FisheyeLens, angles_rad: Sequence[float], noise: float = 2.0
) -> Iterator[tuple[np.ndarray, ...]]:
    """Yield what both cameras see of a world (h, 2 h) all around, (height, width) uint8 each."""
    rng = np.random.default_rng(0)
    height, width = world.shape
    rays, seen = lens.unproject(np.stack(np.meshgrid(*map(np.arange, lens_size(lens))), -1))
    for angle in angles_rad:
        pictures = []
        for mount in mounts():
            x, y, z = np.moveaxis(rays @ (Attitude(angle).matrix @ mount.matrix).T, -1, 0)
            column = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * width - 0.5
            row = (np.arcsin(y.clip(-1, 1)) / np.pi + 0.5) * height - 0.5
            maps = column.astype(np.float32), row.astype(np.float32)
            picture = cv2.remap(world, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
            noisy = picture + rng.normal(0, noise, picture.shape)
            pictures.append(np.where(seen, noisy.round().clip(20, 255), 0).astype(np.uint8))
        yield tuple(pictures)


def lens_size(lens: FisheyeLens) -> tuple[int, int]:
    """Width and height, px."""
    return lens.width, lens.height


def turn_truth(off_m: float, landmarks: int = 300, frames: int = 40) -> TurnState:
    """Return a rig off the axis that turns a little more than once in a room, and landmarks."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(landmarks, 3)) * (1, 0.5, 1)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return TurnState(
        np.array([intrinsics_of(turning_lens())] * 2),
        np.array([mount.matrix for mount in mounts()]),
        off_m * np.array([[-0.6, 0.0, 0.8], [0.6, 0.02, 0.8]]),
        np.linspace(0, np.radians(372), frames),
        directions,
        1 / rng.uniform(1.2, 6.0, landmarks),
    )


def turn_sightings(truth: TurnState, noise_px: float, outliers: float = 0.0) -> Sightings:
    """Return where the cameras see landmarks, some of them elsewhere."""
    rng = np.random.default_rng(2)
    counts = len(truth.lenses), len(truth.angles), len(truth.directions)
    camera, frame, landmark = (index.ravel() for index in np.indices(counts))
    seen = Sightings(camera, frame, landmark, np.zeros((len(camera), 2)))
    pixels, rays = truth.predict(seen), truth.rays(seen)
    angle = np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])
    size = np.array(lens_size(turning_lens()))
    shown = (angle < np.radians(86)) & np.all((pixels > 4) & (pixels < size - 5), axis=1)
    pixels = pixels + rng.normal(0, noise_px, pixels.shape)
    wrong = rng.uniform(size=len(pixels)) < outliers
    pixels[wrong] += rng.normal(0, _OUTLIER_PX, (np.count_nonzero(wrong), 2))
    return Sightings(camera, frame, landmark, pixels).only(shown)
