from dataclasses import replace

import numpy as np
import pytest
from conftest import fisheye
from rendered_view import facing_pose, scattered_poses

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.circle_grid import Circles, find_circles
from fisheye_undistort.detect.grid_order import order_grid
from fisheye_undistort.target.target import STANDARD, Target

NEAR_PX = 6.0
"""A neighbour is farther; a large circle's centre of mass is not."""

DENSE = Target('circles', 7, 10, 25, 25, radius_mm=9)
TARGETS = {
    'paper': (STANDARD['circles'], (150, 300)),
    'dense': (DENSE, (100, 160)),
    'acircles': (STANDARD['acircles'], (100, 180)),
    'square': (Target('circles', 4, 4, 40, 40, radius_mm=15), (120, 220)),
}


def images_of(lens, target, pose):
    """Return the circles of a target as a perfect detector would: centres and local stretch."""

    def project(points):
        return lens.project(points @ pose.rotation.T + pose.translation_mm)[0]

    points, step = target.points_mm, 1e-3
    jacobian = np.stack(
        [(project(points + step * axis) - project(points)) / step for axis in np.eye(3)[:2]],
        axis=-1,
    )
    shapes = jacobian @ jacobian.transpose(0, 2, 1) * target.radius_mm**2 / 4
    return Circles(project(points), shapes)


def same_order(points, ids, truth):
    """Return whether ids are right; symmetric grids may be turned by half a turn."""
    return any(np.abs(points - order[ids]).max() < NEAR_PX for order in (truth, truth[::-1]))


@pytest.mark.parametrize('fov_deg', [170, 190])
@pytest.mark.parametrize('name', TARGETS)
def test_order_survives_barrel_distortion(name, fov_deg):
    target, distance_mm = TARGETS[name]
    lens = fisheye(fov_deg)
    turns = [np.arange(len(target.points_mm))]
    if name == 'square':  # a quarter turn is as good
        turns.append(np.rot90(turns[0].reshape(4, 4)).ravel())
    for pose in scattered_poses(lens, target, 10, distance_mm, seed=3):
        circles = images_of(lens, target, pose)
        shuffled = np.random.default_rng(0).permutation(len(circles))
        points, ids = order_grid(
            Circles(circles.centers[shuffled], circles.shapes[shuffled]), target
        )
        assert len(ids) == len(circles)
        assert any(same_order(points, ids, circles.centers[turn]) for turn in turns)


def test_a_whole_photograph(paper_lens, paper_poses, paper_pictures):
    target = STANDARD['circles']
    for pose, picture in zip(paper_poses, paper_pictures, strict=True):
        points, ids = order_grid(find_circles(picture), target)
        assert same_order(points, ids, images_of(paper_lens, target, pose).centers)


def test_a_few_missing_circles_and_strays_are_borne():
    lens = fisheye(170)
    circles = images_of(lens, DENSE, facing_pose(1.0, 0.5, 150, (0.3, -0.2, 0.4)))
    left = np.setdiff1d(np.arange(70), [0, 13, 44, 69])
    strays = [[30.0, 40.0], [300.0, 420.0], [600.0, 100.0]]
    seen = Circles(
        np.concatenate([strays, circles.centers[left]]),
        np.concatenate([circles.shapes[:3], circles.shapes[left]]),
    )
    points, ids = order_grid(seen, DENSE)
    assert len(ids) == 66
    assert same_order(points, ids, circles.centers)


@pytest.mark.parametrize('wrong', [{'rows': 6}, {'rows': 8}, {'columns': 9}, {'columns': 11}])
def test_another_grid_is_described(wrong):
    circles = images_of(fisheye(170), DENSE, facing_pose(0, 0.2, 150, (0.2, 0.1, 0)))
    with pytest.raises(CalibrationError) as error:
        order_grid(circles, replace(DENSE, **wrong))
    told = str(error.value)
    assert '7 x 10' in told or '10 x 7' in told
    assert f'{next(iter(wrong.values()))} {next(iter(wrong))}' in told


def test_no_circles_no_grid():
    with pytest.raises(CalibrationError, match='0 dark round particles'):
        order_grid(Circles(np.empty((0, 2)), np.empty((0, 2, 2))), DENSE)


def test_a_few_circles_in_a_line_are_no_grid():
    line = np.stack([np.arange(5) * 60.0 + 50, np.full(5, 90.0)], axis=-1)
    circles = Circles(line, np.tile(100.0 * np.eye(2), (5, 1, 1)))
    with pytest.raises(CalibrationError, match='no grid among 5 dark round particles'):
        order_grid(circles, STANDARD['acircles'])
    with pytest.raises(CalibrationError, match='no grid among 5 dark round particles'):
        order_grid(circles, Target('circles', 3, 3, 60, 60, radius_mm=20))
