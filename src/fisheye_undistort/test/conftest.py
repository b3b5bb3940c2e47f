"""What the tests of this package share."""

from pathlib import Path

import numpy as np
import pytest
from rendered_view import render_view, scattered_poses
from undistort_bench import Bench

from fisheye_geometry.lens import FisheyeLens
from fisheye_testing.data import real_data
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.target.target import STANDARD

FOCAL = 0.003
"""What is asked of twelve photographs of a sheet: share of the focal length, px."""
CENTER_PX = 0.5


def fisheye(fov_deg: int, scale: int = 1) -> FisheyeLens:
    """Return a lens that sees 170 or 190 degrees across 640 * scale pixels."""
    focal, distortion = {
        170: (215.0, (0.02, -0.01, 0.003, -0.0008)),
        190: (199.0, (-0.03, 0.003, -0.006, 0.0015)),
    }[fov_deg]
    return FisheyeLens(
        640 * scale,
        480 * scale,
        focal * scale,
        focal * scale * 1.003,
        321.8 * scale,
        237.6 * scale,
        distortion,
        visible_angle_rad=np.radians(fov_deg / 2 + 1),
    )


def seen_exactly(lens, target, pose, name='view') -> TargetView:
    """Return the projections of a target's points."""
    points = target.points_mm @ pose.rotation.T + pose.translation_mm
    return TargetView(name, lens.project(points)[0], np.arange(len(points)))


def demand(lens, truth):
    """Demand the intrinsics of the truth."""
    assert abs(lens.focal_x_px / truth.focal_x_px - 1) < FOCAL
    assert abs(lens.focal_y_px / truth.focal_y_px - 1) < FOCAL
    assert abs(lens.center_x_px - truth.center_x_px) < CENTER_PX
    assert abs(lens.center_y_px - truth.center_y_px) < CENTER_PX


@pytest.fixture
def shun74() -> Path:
    """Return the folder of real chessboard views."""
    return real_data('shun74')


@pytest.fixture(scope='session')
def paper_lens() -> FisheyeLens:
    """Return the paper's lens: 170 degrees, 640 x 480."""
    return fisheye(170)


@pytest.fixture(scope='session')
def paper_poses(paper_lens):
    """Return twelve poses of the paper's sheet."""
    return scattered_poses(paper_lens, STANDARD['circles'], 12, (170, 300))


@pytest.fixture(scope='session')
def paper_pictures(paper_lens, paper_poses):
    """Return twelve photographs of the paper's sheet."""
    return [
        render_view(paper_lens, STANDARD['circles'], pose, seed=seed)
        for seed, pose in enumerate(paper_poses)
    ]


@pytest.fixture
def make_bench(request):
    benches = []

    def make(**parameters):
        name = ''.join(c if c.isalnum() else '_' for c in request.node.name)
        benches.append(Bench(name, **parameters))
        return benches[-1]

    yield make
    for bench in benches:
        bench.close()
