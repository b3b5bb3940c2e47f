"""Whether a mount that moves is told, and a person who crosses is not: rendered drives.

A rig of two fisheye cameras rolls through a place, past posts, with people crossing its seam. In
half of the drives the right camera is turned after ten seconds, by 0.3, 0.7 or 2 degrees.
"""

import argparse
import sys

import numpy as np
from mounts import random_lens
from scenes import OverlapScene, Post
from scipy.spatial.transform import Rotation
from worlds import STYLES, random_world

from panorama_stitch.overlap.monitor import SeamMonitor
from panorama_stitch.overlap.view import OverlapView

SECONDS, MOVED_AT_S = 30, 10
TURNS_DEG = (0.0, 0.0, 0.0, 0.3, 0.7, 2.0)
TOLD_DEG = 0.5
SIZE = 320, 240


def main() -> int:
    """Print the table; 1 where anything is told wrongly."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--drives', type=int, default=50)
    options = parser.parse_args()
    wrong, table = 0, {}
    for seed in range(options.drives):
        turn_deg = TURNS_DEG[seed % len(TURNS_DEG)]
        told, drift_deg, quality = drive(seed, turn_deg)
        row = table.setdefault(turn_deg, [])
        row.append((told, drift_deg, quality))
        wrong += told != (turn_deg > TOLD_DEG)
    print('turned by  drives  told  drift, median  quality, median')
    for turn_deg, row in sorted(table.items()):
        told, drift, quality = np.array(row).T
        print(
            f'{turn_deg:9.1f} {len(row):7} {told.sum():5.0f} {np.nanmedian(drift):14.2f} '
            f'{np.median(quality):16.2f}'
        )
    return 1 if wrong else 0


def drive(seed: int, turn_deg: float) -> tuple[bool, float, float]:
    """Drive once; return whether a drift was told, the last one, deg, and the last quality."""
    rng = np.random.default_rng([seed, 77])
    world = random_world(rng, STYLES[rng.integers(4)])
    lens = random_lens(rng, *SIZE, 170.0)
    yaw_deg, baseline_m = rng.uniform(120, 145), rng.uniform(0.03, 0.2)
    left, right = (
        Rotation.from_euler('YX', [side * yaw_deg / 2, rng.uniform(-10, 0)], degrees=True)
        for side in (-1, 1)
    )
    axis = rng.standard_normal(3)
    moved = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.radians(turn_deg))
    monitor = SeamMonitor(left.inv() * right)
    posts = [(rng.uniform(-4, 4), rng.uniform(2, 20), rng.uniform(0.03, 0.15)) for _ in range(12)]
    start, pace = rng.uniform(-3, -1), rng.uniform(0.2, 0.6)
    told, state = False, None
    for second in range(SECONDS):
        x = start + pace * (second % 12)  # people cross, one after another
        things = [Post(x, 1.5, 0.22, -0.8, 0.9, plain(60 + 10 * (second // 12)))]
        things += [
            Post(px, pz - 0.5 * second, r, -2.0, 1.0, plain(150))
            for px, pz, r in posts
            if pz - 0.5 * second > 0.5
        ]
        scene = OverlapScene(world, things)
        attitudes = left, right * moved if second >= MOVED_AT_S else right
        views = [
            see(rng, scene, lens, attitude, np.array([side * baseline_m / 2, 0.0, 0.0]))
            for side, attitude in zip((-1, 1), attitudes, strict=True)
        ]
        state = monitor.look(*views, float(second))
        told |= state.drifted
    return told, state.drift_deg, state.quality


def plain(level: float) -> np.ndarray:
    """A texture of one grey level."""
    return np.full((8, 8), level, np.float32)


def see(rng, scene, lens, attitude, origin) -> OverlapView:
    """What a camera of the rig shows at a moment."""
    y, x = np.mgrid[: lens.height, : lens.width]
    rays, lit = lens.unproject(np.stack([x, y], axis=-1))
    light, _ = scene.look(origin, rays @ attitude.as_matrix().T, lens.focal_x_px)
    light = light + rng.normal(0, 3, light.shape)
    return OverlapView(np.where(lit, np.clip(light, 1, 255), 0).astype(np.uint8), lens)


if __name__ == '__main__':
    sys.exit(main())
