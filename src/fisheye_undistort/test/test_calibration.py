from dataclasses import replace

import cv2
import numpy as np
import pytest
from conftest import fisheye, seen_exactly
from foreign_lenses import foreign_lens
from rendered_view import facing_pose, render_view, scattered_poses

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens_surface import surface_for
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.pictures import read_pictures
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.fit.circle_bias import center_bias
from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.sheet_model import intrinsics_of, warp_board
from fisheye_undistort.fit.turned_views import turned
from fisheye_undistort.report.misfit import misfit_of
from fisheye_undistort.target.target import STANDARD, Target

PAPER = STANDARD['circles']
DENSE = Target('circles', 7, 10, 25, 25, radius_mm=9)
BOARD = Target('chessboard', 7, 10, 25, 25)
SIZE = (640, 480)

EXACT = 1e-6
"""Of exact points only rounding is left."""
FOCAL = 0.003
"""What is asked of twelve photographs of a sheet: share of the focal length, px, degrees."""
CENTER_PX = 0.5
ANGLE_DEG = 0.1
STRAIGHT_PX = 1.0


def angle_error_deg(lens, truth, up_to_rad):
    """Return the largest error of the angle that the fitted lens assigns to a true radius."""
    angles = np.linspace(0.01, up_to_rad, 100)
    rays = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=-1)
    pixels, seen = truth.project(rays)
    assert seen.all()
    # The principal point is judged apart: what remains is the distortion curve.
    pixels += [lens.center_x_px - truth.center_x_px, lens.center_y_px - truth.center_y_px]
    back, seen = lens.unproject(pixels)
    assert seen.all()
    return np.degrees(np.abs(np.arctan2(back[:, 0], back[:, 2]) - angles).max())


def demand(lens, truth):
    """Demand the intrinsics of the truth."""
    assert abs(lens.focal_x_px / truth.focal_x_px - 1) < FOCAL
    assert abs(lens.focal_y_px / truth.focal_y_px - 1) < FOCAL
    assert abs(lens.center_x_px - truth.center_x_px) < CENTER_PX
    assert abs(lens.center_y_px - truth.center_y_px) < CENTER_PX


@pytest.fixture(scope='module')
def exact_views(paper_lens):
    poses = scattered_poses(paper_lens, BOARD, 10, (120, 220))
    return [seen_exactly(paper_lens, BOARD, pose, str(i)) for i, pose in enumerate(poses)]


@pytest.mark.parametrize('fov_deg', [170, 190])
def test_exact_points_give_the_exact_lens(fov_deg):
    truth = fisheye(fov_deg)
    poses = scattered_poses(truth, BOARD, 10, (120, 220))
    views = [seen_exactly(truth, BOARD, pose) for pose in poses]
    lens = calibrate(views, BOARD, SIZE).lens
    assert np.allclose(lens.matrix, truth.matrix, rtol=EXACT)
    assert np.allclose(lens.distortion, truth.distortion, atol=1e-4)


@pytest.mark.parametrize('focal_px', [110.0, 215.0, 500.0])
def test_the_start_finds_any_focal_length(focal_px):
    truth = replace(fisheye(170), focal_x_px=focal_px, focal_y_px=focal_px)
    poses = [facing_pose(a, 0.3, 1.2 * focal_px, (0.4, 0.3, a)) for a in range(6)]
    views = [seen_exactly(truth, BOARD, pose) for pose in poses]
    assert abs(calibrate(views, BOARD, SIZE).lens.focal_x_px / focal_px - 1) < EXACT


def test_one_wrong_point_is_outvoted(exact_views, paper_lens):
    random = np.random.default_rng(1)
    views = [
        TargetView(v.name, v.points_px + random.normal(0, 0.05, v.points_px.shape), v.ids)
        for v in exact_views
    ]
    views[3].points_px[11] += (25, -10)
    demand(calibrate(views, BOARD, SIZE).lens, paper_lens)


def test_a_view_that_does_not_fit_is_dropped_and_named(exact_views, paper_lens):
    wrong = TargetView(
        'wrong.png', exact_views[2].points_px[::-1].copy(), exact_views[2].ids.copy()
    )
    wrong.points_px[:35] += 6
    calibration = calibrate([*exact_views, wrong], BOARD, SIZE)
    assert list(calibration.dropped) == ['wrong.png']
    assert 'does not fit: rms' in calibration.dropped['wrong.png']
    assert len(calibration.views) == len(exact_views)
    demand(calibration.lens, paper_lens)


def test_a_board_that_is_not_flat_does_not_bend_the_lens(paper_lens):
    warp_mm = np.array([1.2, 0.2, 0.6])
    points = warp_board(BOARD.points_mm, warp_mm)
    random = np.random.default_rng(0)
    views = [
        TargetView(
            '',
            paper_lens.project(points @ pose.rotation.T + pose.translation_mm)[0]
            + random.normal(0, 0.05, (70, 2)),
            np.arange(70),
        )
        for pose in scattered_poses(paper_lens, BOARD, 12, (120, 220), seed=2)
    ]
    calibration = calibrate(views, BOARD, SIZE)
    assert np.allclose(calibration.estimate.board_warp_mm, warp_mm, atol=0.1)
    demand(calibration.lens, paper_lens)


def noisy(views, noise_px=0.1, seed=5):
    random = np.random.default_rng(seed)
    return [
        TargetView(v.name, v.points_px + random.normal(0, noise_px, v.points_px.shape), v.ids)
        for v in views
    ]


@pytest.mark.parametrize('reach_deg', [35, 50])
def test_beyond_the_points_the_lens_stays_near_and_says_how_near(reach_deg):
    truth = fisheye(190)
    poses = [
        facing_pose(a, np.radians(reach_deg) * (i % 3) / 4, 250, (0.4 * np.sin(i), 0.4, a))
        for i, a in enumerate(np.linspace(0, 2 * np.pi, 15, endpoint=False))
    ]
    small = Target('chessboard', 6, 9, 12, 12)
    calibration = calibrate(
        noisy([seen_exactly(truth, small, pose) for pose in poses]), small, SIZE
    )
    assert np.degrees(calibration.directions_rad[0].max()) < reach_deg + 10
    rays, seen = truth.unproject(calibration.angles.pixels)
    apart = np.linalg.norm(rays - calibration.angles.rays, axis=-1)
    deviation = calibration.angles.deviation_rad(calibration.covariance)
    use = seen & calibration.angles.seen
    assert np.degrees(apart[use].max()) < 10
    assert np.degrees(deviation[use].max()) > 1
    assert np.mean(apart[use] < 3 * deviation[use]) > 0.99


def test_halves_of_the_views_agree_within_what_is_claimed(exact_views):
    views = noisy([*exact_views, *noisy(exact_views)])
    halves = calibrate(views, BOARD, SIZE).halves
    assert halves.excess < 2
    # What is held out differs by as much as the points scatter, 0.1 px along either axis.
    assert 0.1 < halves.held_out_px < 0.3


def test_a_corner_that_lies_wrong_is_named_and_left_out(exact_views, paper_lens):
    views = noisy(exact_views)
    views[3].points_px[11] += (25, -10)
    calibration = calibrate(views, BOARD, SIZE)
    (told,) = calibration.outlying
    assert told.startswith(f'{views[3].name}: row 2, column 2, 2')
    assert len(calibration.views[3].ids) == 69
    demand(calibration.lens, paper_lens)


@pytest.mark.parametrize('count', [0, 1, 4])
def test_pictures_that_were_turned_are_turned_back_and_named(count, exact_views, paper_lens):
    views = noisy(exact_views)
    views = [turned(v, SIZE) if i < count else v for i, v in enumerate(views)]
    calibration = calibrate(views, BOARD, SIZE)
    assert calibration.turned == tuple(view.name for view in views[:count])
    demand(calibration.lens, paper_lens)


def test_a_lens_that_is_no_fisheye_of_ours_leaves_what_is_told():
    lens = foreign_lens('equisolid', 170)
    skewed = replace(lens, skew_px=0.02 * lens.focal_x_px)
    poses = scattered_poses(skewed, BOARD, 20, (90, 200))
    results = [
        misfit_of(calibrate(noisy([seen_exactly(seen, BOARD, p) for p in poses]), BOARD, SIZE))
        for seen in (lens, skewed)
    ]
    assert results[0].typical_px < 0.05
    assert results[1].typical_px > 0.2
    assert 0.2 < np.degrees(results[1].typical_rad) / results[1].typical_px < 0.5


def test_the_bias_is_that_of_a_photograph(paper_lens, paper_poses, paper_pictures):
    unknowns = np.concatenate([intrinsics_of(paper_lens), np.zeros(3)])
    found_px = 0.05
    """What blur and noise leave of a centre of mass."""
    for pose, picture in zip(paper_poses[:4], paper_pictures, strict=False):
        view = Detector(PAPER)('', picture)
        truth = seen_exactly(paper_lens, PAPER, pose).points_px
        if np.abs(truth - view.points_px).max() > 6:  # half a turn looks the same
            view = replace(view, ids=8 - view.ids)
        turned = np.concatenate([cv2.Rodrigues(pose.rotation)[0].ravel(), pose.translation_mm])
        bias = center_bias(Estimate(unknowns, turned[None]), [view], PAPER)[0]
        assert np.abs(bias).max() > 10 * found_px
        assert np.abs(view.points_px - truth[view.ids] - bias).max() < found_px


@pytest.mark.parametrize('fov_deg', [170, 190])
@pytest.mark.parametrize(
    ('target', 'scale', 'distance_mm'),
    [
        pytest.param(PAPER, 1, (170, 300), id='3x3'),
        pytest.param(DENSE, 2, (110, 170), id='7x10'),
    ],
)
def test_photographs_of_a_sheet_give_the_lens(fov_deg, target, scale, distance_mm):
    truth = fisheye(fov_deg, scale)
    detect = Detector(target, min_area_px=100)
    views = [
        detect(str(seed), render_view(truth, target, pose, seed=seed))
        for seed, pose in enumerate(scattered_poses(truth, target, 12, distance_mm))
    ]
    size = (truth.width, truth.height)
    corrected, plain = (calibrate(views, target, size, correct_bias=b) for b in (True, False))
    assert not corrected.dropped
    demand(corrected.lens, truth)
    reach = corrected.directions_rad[0].max()
    error, without = (angle_error_deg(c.lens, truth, reach) for c in (corrected, plain))
    assert error < ANGLE_DEG
    assert error < without / 2
    assert corrected.rms_px < plain.rms_px


def test_a_single_picture_of_nine_circles(paper_lens):
    pose = facing_pose(0.5, 0.15, 200, (0.35, 0.25, 0.1))
    view = Detector(PAPER)('one.png', render_view(paper_lens, PAPER, pose))
    calibration = calibrate([view], PAPER, SIZE)
    lens = calibration.lens
    surface = surface_for(lens, 'rectilinear', hfov_rad=np.radians(130))
    for line in sheet_lines(PAPER):
        pixels, _ = paper_lens.project(line @ pose.rotation.T + pose.translation_mm)
        rays, seen = lens.unproject(pixels)
        assert seen.all()
        corrected, _ = surface.project(rays)
        centered = corrected - corrected.mean(axis=0)
        across = np.linalg.svd(centered, full_matrices=False)[2][1]
        assert np.abs(centered @ across).max() < STRAIGHT_PX


def sheet_lines(target):
    """Rows and columns of the sheet as 3-D points close to each other."""
    grid = target.points_mm.reshape(target.rows, target.columns, 3)
    share = np.linspace(0, 1, 50)[:, None]
    for line in (*grid, *grid.transpose(1, 0, 2)):
        yield line[0] + share * (line[-1] - line[0])


def test_no_views_no_lens():
    with pytest.raises(CalibrationError, match='no view'):
        calibrate([], PAPER, SIZE)


@pytest.mark.parametrize('half', ['left', 'right'])
def test_twenty_real_views_of_a_chessboard(shun74, half):
    rms_px, focal, center_px = 0.3, 0.005, 3.0
    detect = Detector(BOARD)
    pictures = read_pictures([str(shun74 / 'calib-*.jpg')], half)
    calibration = calibrate(
        [detect(picture.name, picture.gray) for picture in pictures], BOARD, (1280, 960)
    )
    storage = cv2.FileStorage(str(shun74 / 'camera_params.yaml'), cv2.FILE_STORAGE_READ)
    published = storage.getNode('camera_params').getNode('K1' if half == 'left' else 'K2').mat()
    lens = calibration.lens
    assert len(calibration.views) == 20
    assert calibration.rms_px < rms_px
    assert abs(lens.focal_x_px / published[0, 0] - 1) < focal
    assert abs(lens.focal_y_px / published[1, 1] - 1) < focal
    assert abs(lens.center_x_px - published[0, 2]) < center_px
    assert abs(lens.center_y_px - published[1, 2]) < center_px


def test_a_view_that_tells_nothing_is_refused():
    # Neither perspective nor distortion: the lens could have any focal length.
    points_px = PAPER.points_mm[:, :2] + (320, 240)
    with pytest.raises(CalibrationError, match='no lens fits what was seen'):
        calibrate([TargetView('', points_px, np.arange(9))], PAPER, SIZE)
