from math import degrees, radians

import numpy as np
import pytest
from scenes import exposed, pair, tilted

from fisheye_geometry.attitude import Attitude
from panorama_stitch.overlap.alignment import align, overlap_score
from panorama_stitch.overlap.particles import facing_halves
from panorama_stitch.overlap.pose import Pose
from panorama_stitch.overlap.structure import face

COARSE_DEG = 0.2
"""Error of a pose found at 2 px per degree."""
FINE_DEG = 0.1
START_DEG = 0.7
"""Error of the offset that is aligned."""


def facing_pair(views, surfaces, px_per_deg):
    return face(*facing_halves(*views), surfaces[1], 0.0, px_per_deg)


@pytest.mark.parametrize('kind', ['cylindrical', 'equirectangular'])
@pytest.mark.parametrize(
    'turn', [Attitude(0, radians(1.7)), Attitude(0, 0, radians(-1.9)), Attitude()]
)
def test_finds_a_turn_from_an_offset_that_is_a_little_off(kind, turn):
    (left, right), surfaces, true_px = pair(kind)
    right = exposed(tilted(right, surfaces[1], turn), 0.8, noise=4)
    true_px -= surfaces[0].width - surfaces[0].width // 2
    coarse = facing_pair((left, right), surfaces, 2.0)
    start = Pose(true_px + START_DEG * surfaces[0].focal_px * radians(1), 0.0).scaled(
        1 / coarse.step
    )
    pose = align(coarse, start, tilt=True)
    assert degrees(pose.pitch_rad - turn.pitch_rad) == pytest.approx(0, abs=2 * COARSE_DEG)
    assert degrees(pose.roll_rad - turn.roll_rad) == pytest.approx(0, abs=2 * COARSE_DEG)
    error_px = pose.x_px - true_px / coarse.step
    assert error_px / coarse.px_per_deg == pytest.approx(0, abs=COARSE_DEG)
    assert overlap_score(coarse, pose) > overlap_score(coarse, start)

    fine = facing_pair((left, right), surfaces, 4.0)
    pose = align(fine, pose.scaled(coarse.step / fine.step), tilt=True, fine=True)
    assert (pose.x_px - true_px / fine.step) / fine.px_per_deg == pytest.approx(0, abs=FINE_DEG)


def test_without_tilt_only_the_offset_moves():
    (left, right), surfaces, true_px = pair()
    facing = facing_pair(
        (left, tilted(right, surfaces[1], Attitude(0, radians(1)))), surfaces, 2.0
    )
    pose = align(facing, Pose(true_px / 2 - 160, 0.0), tilt=False)
    assert abs(pose.pitch_rad) + abs(pose.roll_rad) < 1e-6


def test_pictures_without_overlap_stay_where_they_are():
    views, surfaces, _ = pair()
    facing = facing_pair(views, surfaces, 2.0)
    start = Pose(float(facing.left.image.shape[1] - 3), 0.0)
    assert align(facing, start, tilt=True) == start


def test_certainty_of_a_wrong_offset_is_low():
    views, surfaces, true_px = pair()
    facing = facing_pair(views, surfaces, 2.0)
    x = (true_px - surfaces[0].width + surfaces[0].width // 2) / facing.step
    assert overlap_score(facing, Pose(x, 0.0)) > 0.8
    assert overlap_score(facing, Pose(x - 30, 0.0)) < 0.3
    assert overlap_score(facing, Pose(1e4, 0.0)) == 0.0


def test_flat_pictures_have_no_certainty():
    (left, right), surfaces, _ = pair()
    flat = tuple(np.where(view > 0, 128, 0).astype(np.uint8) for view in (left, right))
    assert overlap_score(facing_pair(flat, surfaces, 2.0), Pose(50.0, 0.0)) == 0.0
