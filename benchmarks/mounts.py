"""Random lenses and attitudes of the two cameras of a rig."""

from math import radians

import numpy as np
from scipy.spatial.transform import Rotation

from fisheye_geometry.lens import FisheyeLens, Lens, PinholeLens

SIZES = ((320, 240), (640, 480), (640, 480), (800, 600), (1280, 960))


def random_lenses(rng, widest_deg: float) -> tuple[Lens, Lens]:
    """Make the lenses of a rig, mostly alike; the widest so wide."""
    width, height = SIZES[rng.integers(len(SIZES))]
    kind = rng.random()
    fov = 78.0 if kind < 0.15 else min(rng.choice([150.0, 170.0, 170.0, 185.0, 200.0]), widest_deg)
    if fov < 90:
        focal = width / 2 / np.tan(radians(fov) / 2)
        lens = PinholeLens(
            width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, (-0.05, 0.01, 0, 0)
        )
        return lens, lens
    first = random_lens(rng, width, height, fov)
    if rng.random() < 0.8:
        return first, first
    return first, random_lens(rng, *SIZES[rng.integers(len(SIZES))], rng.choice([150.0, 170.0]))


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


def half_width_rad(lens: Lens) -> float:
    """Return how far to either side a lens sees, for sure."""
    return min(
        lens.angle_at(-0.5, lens.center_y_px), lens.angle_at(lens.width - 0.5, lens.center_y_px)
    )


def random_attitudes(rng, yaw_deg: float, tilt_scale: float = 1.0) -> tuple[Rotation, Rotation]:
    """Rotations of both cameras' rays to the scene: tilted, leaning, or turned over, or level."""
    tilt = np.zeros((2, 2))
    kind = rng.integers(4)
    if kind == 1:
        tilt[:] = rng.uniform(-20, 20), 0
    elif kind == 2:
        tilt = rng.uniform(-10, 10, (2, 2))
    elif kind == 3:
        tilt = rng.uniform(-3, 3, (2, 2))
    over = 180.0 if rng.random() < 0.1 else 0.0
    return tuple(
        Rotation.from_euler('YXZ', [side * yaw_deg / 2, pitch, roll + over], degrees=True)
        for side, (pitch, roll) in zip((-1, 1), tilt * tilt_scale, strict=True)
    )
