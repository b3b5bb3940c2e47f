from dataclasses import replace

import numpy as np
import pytest
from conftest import demand, fisheye, seen_exactly
from foreign_lenses import foreign_lens
from rendered_view import facing_pose, scattered_poses

from fisheye_core.errors import CalibrationError
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.fit.sheet_model import warp_board
from fisheye_undistort.fit.turned_views import turned
from fisheye_undistort.report.misfit import misfit_of
from fisheye_undistort.target.target import STANDARD, Target

PAPER = STANDARD['circles']
BOARD = Target('chessboard', 7, 10, 25, 25)
SIZE = (640, 480)

EXACT = 1e-6
"""Of exact points only rounding is left."""


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


def test_no_views_no_lens():
    with pytest.raises(CalibrationError, match='no view'):
        calibrate([], PAPER, SIZE)


def test_a_view_that_tells_nothing_is_refused():
    # Neither perspective nor distortion: the lens could have any focal length.
    points_px = PAPER.points_mm[:, :2] + (320, 240)
    with pytest.raises(CalibrationError, match='no lens fits what was seen'):
        calibrate([TargetView('', points_px, np.arange(9))], PAPER, SIZE)
