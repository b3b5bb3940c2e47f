"""Calibration from photographs of a sheet, rendered and real."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from conftest import demand, fisheye, seen_exactly
from rendered_view import facing_pose, render_view, scattered_poses

from fisheye_geometry.lens_surface import surface_for
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.pictures import read_pictures
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.fit.circle_bias import center_bias
from fisheye_undistort.fit.estimate import Estimate
from fisheye_undistort.fit.sheet_model import intrinsics_of
from fisheye_undistort.target.target import STANDARD, Target

PAPER = STANDARD['circles']
DENSE = Target('circles', 7, 10, 25, 25, radius_mm=9)
BOARD = Target('chessboard', 7, 10, 25, 25)
SIZE = (640, 480)

ANGLE_DEG = 0.1
"""What is asked of twelve photographs of a sheet, beside the intrinsics."""
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
