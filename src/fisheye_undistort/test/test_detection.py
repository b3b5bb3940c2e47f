import cv2
import numpy as np
import pytest
from conftest import fisheye, seen_exactly
from foreign_lenses import foreign_lens
from rendered_view import Look, facing_pose, render_view, scattered_poses

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.partial_chessboard import find_part
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.target.target import STANDARD, TAGS, Target

CORNER_PX = 0.25
"""Corners of squares are blurred by the lens and placed by what is around them."""
FOCAL = 0.003


TAGS_640 = Target('aprilgrid', 4, 4, 44.0, 44.0, marker_mm=34.0, dictionary=TAGS)


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


@pytest.mark.parametrize(('turn', 'quick'), [(0.1, False), (1.7, True), (3.2, False), (4.8, True)])
def test_a_chessboard_may_be_cut_off_by_the_edge_of_the_picture(turn, quick):
    """Its dots tell which corners are seen, whichever way up."""
    lens, target = fisheye(170), STANDARD['chessboard']
    pose = facing_pose(0.2, 1.1, 130, (0.1, -0.2, turn))
    view = Detector(target, quick=quick)('shot', render_view(lens, target, pose))
    truth = seen_exactly(lens, target, pose).points_px
    assert 30 <= len(view.ids) < len(truth)
    off_px = np.linalg.norm(view.points_px - truth[view.ids], axis=-1)
    assert np.mean(off_px < CORNER_PX) > 0.9
    assert off_px.max() < 1


def test_a_corner_that_opencv_guesses_outside_of_the_picture_is_left_out():
    lens, target = foreign_lens('equisolid', 190), STANDARD['chessboard']
    pose = facing_pose(0.543, 1.267, 177.1, (0.498, -0.062, -2.296))
    view = Detector(target)('shot', render_view(lens, target, pose, seed=22))
    assert 30 <= len(view.ids) < 54
    assert np.all((view.points_px > 0) & (view.points_px < (lens.width, lens.height)))


def test_no_part_of_a_chessboard_is_taken_without_its_dots():
    lens, target = fisheye(170), STANDARD['chessboard']
    pose = facing_pose(0.2, 1.1, 130, (0.1, -0.2, 0.1))
    picture = render_view(lens, target, pose)
    # Grey over the dots leaves the squares' corners.
    squares = np.array(target.dotted_squares)[:, ::-1] - (target.columns / 2, target.rows / 2)
    dots_mm = np.pad(squares * target.dx_mm, ((0, 0), (0, 1)))
    places, _ = lens.project(dots_mm @ pose.rotation.T + pose.translation_mm)
    for place in places:
        cv2.circle(picture, tuple(place.round().astype(int).tolist()), 6, 100, -1)
    with pytest.raises(CalibrationError, match='no chessboard of 6 x 9'):
        Detector(target)('shot', picture)


def test_a_real_chessboard_without_dots_has_no_part(shun74):
    """OpenCV sees three dots in this bent board, of which a part is seen."""
    gray = cv2.imread(str(shun74 / 'calib-01.jpg'), cv2.IMREAD_GRAYSCALE)
    assert not len(find_part(gray, STANDARD['chessboard'], quick=True)[1])


def test_corners_of_tags_are_found_where_they_are_whichever_way_up():
    lens = fisheye(170)
    for turn in (0.1, 1.7, 3.2):
        pose = facing_pose(0.8, 0.3, 170, (0.2, -0.3, turn))
        view = Detector(TAGS_640)('shot', render_view(lens, TAGS_640, pose))
        truth = seen_exactly(lens, TAGS_640, pose).points_px[view.ids]
        assert len(view.ids) > 50
        off_px = np.linalg.norm(view.points_px - truth, axis=-1)
        assert np.mean(off_px < CORNER_PX) > 0.9


def test_a_grid_of_tags_may_be_half_out_of_the_picture():
    lens = fisheye(170)
    pose = facing_pose(0.0, 1.2, 170)
    view = Detector(TAGS_640)('shot', render_view(lens, TAGS_640, pose))
    assert 8 <= len(view.ids) < 64


def test_a_chessboard_that_the_quick_check_throws_away_is_found():
    """At the edge of a stereographic lens the squares are of very different sizes."""
    lens, target = foreign_lens('stereographic', 220), STANDARD['chessboard']
    poses = scattered_poses(lens, target, 6, (90, 250), seed=3)
    pictures = [render_view(lens, target, pose, seed=i) for i, pose in enumerate(poses)]
    # Of one that the quick look misses it finds a part, by the dots.
    for quick, least in ((False, 54), (True, 45)):
        detect = Detector(target, quick=quick)
        assert all(len(detect('', picture).ids) >= least for picture in pictures)


def test_a_chessboard_of_a_large_picture_is_refined_at_full_size():
    lens, target = foreign_lens('equisolid', 180, 2000, 1500), STANDARD['chessboard']
    pose = facing_pose(0.8, 0.3, 250, (0.2, -0.3, 0.1))
    view = Detector(target)('shot', render_view(lens, target, pose, Look(blur_px=1.2)))
    truth = seen_exactly(lens, target, pose).points_px
    off_px = min(
        np.linalg.norm(view.points_px - order, axis=-1).max() for order in (truth, truth[::-1])
    )
    assert off_px < CORNER_PX


@pytest.mark.parametrize(
    'target', [STANDARD['acircles'], Target('circles', 7, 10, 26.0, 26.0, radius_mm=9.5)], ids=str
)
def test_circles_of_any_size_are_found_without_a_limit(target):
    lens = foreign_lens('equisolid', 180)
    poses = scattered_poses(lens, target, 6, (110, 300), seed=1)
    for number, pose in enumerate(poses):
        view = Detector(target)('', render_view(lens, target, pose, seed=number))
        assert len(view.ids) >= 0.93 * len(target.cells)


@pytest.mark.parametrize('target', [STANDARD[k] for k in ('acircles', 'chessboard', 'charuco')]
                         + [TAGS_640], ids=str)  # fmt: skip
def test_every_kind_calibrates(target):
    lens = fisheye(170)
    detect = Detector(target)
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
