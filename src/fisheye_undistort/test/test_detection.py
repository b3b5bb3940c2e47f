import numpy as np
import pytest
from conftest import fisheye, seen_exactly
from rendered_view import Look, facing_pose, render_view, scattered_poses

from fisheye_core.errors import CalibrationError
from fisheye_undistort.calibration import calibrate
from fisheye_undistort.detection import Detector
from fisheye_undistort.target import STANDARD, Target

CORNER_PX = 0.25
"""Corners of squares are blurred by the lens and placed by what is around them."""
FOCAL = 0.003


@pytest.mark.parametrize('kind', ['chessboard', 'charuco'])
def test_corners_are_found_where_they_are(kind):
    lens, target = fisheye(170), STANDARD[kind]
    pose = facing_pose(0.8, 0.3, 170, (0.2, -0.3, 0.1))
    view = Detector(target)('shot', render_view(lens, target, pose))
    truth = seen_exactly(lens, target, pose).points_px
    miss = min(
        np.linalg.norm(view.points_px - order[view.ids], axis=-1).max()
        for order in (truth, truth[::-1])
    )
    assert miss < CORNER_PX
    assert len(view.ids) == len(target.points_mm)


def test_a_charuco_board_may_be_half_out_of_the_picture():
    lens, target = fisheye(170), STANDARD['charuco']
    pose = facing_pose(0.0, 1.25, 170)
    view = Detector(target)('shot', render_view(lens, target, pose))
    truth = seen_exactly(lens, target, pose).points_px
    assert 8 <= len(view.ids) < len(truth)
    assert np.linalg.norm(view.points_px - truth[view.ids], axis=-1).max() < CORNER_PX


@pytest.mark.parametrize('kind', ['acircles', 'chessboard', 'charuco'])
def test_every_kind_calibrates(kind):
    lens, target = fisheye(170), STANDARD[kind]
    detect = Detector(target, min_area_px=40)
    poses = scattered_poses(lens, target, 10, (110, 170))
    views = [detect('', render_view(lens, target, p, seed=i)) for i, p in enumerate(poses)]
    found = calibrate(views, target, (lens.width, lens.height)).lens
    assert abs(found.focal_x_px / lens.focal_x_px - 1) < FOCAL
    assert abs(found.center_x_px - lens.center_x_px) < 0.5


@pytest.mark.parametrize(
    ('target', 'told'),
    [
        (STANDARD['circles'], 'expected 3 rows and 3 columns'),
        (STANDARD['chessboard'], 'no chessboard of 6 x 9 inner corners'),
        (STANDARD['charuco'], '0 corners of a ChArUco board of 5 x 7 squares'),
    ],
)
def test_an_empty_scene_is_told(target, told):
    lens = fisheye(170)
    behind = facing_pose(0.0, 3.0, 300)
    scene = render_view(lens, target, behind, Look())
    with pytest.raises(CalibrationError, match=told):
        Detector(target)('scene', scene)


def test_the_number_of_rows_must_be_right():
    lens = fisheye(170)
    picture = render_view(lens, STANDARD['circles'], facing_pose(0.2, 0.3, 250))
    wrong = Target('circles', 4, 3, 100, 70, radius_mm=25)
    with pytest.raises(CalibrationError, match=r'grid of circles, 3 x 3 .*expected 4 rows'):
        Detector(wrong)('shot', picture)
