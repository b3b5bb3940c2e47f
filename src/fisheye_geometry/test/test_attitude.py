"""Attitudes: angles to matrices and back, in the conventions that are written down."""

import numpy as np
import pytest

from fisheye_geometry.attitude import (
    LEVEL,
    Attitude,
    angle_between,
    attitude_of,
    closest_rotation,
    quaternion,
    rotation_matrix,
    rotation_vector,
)

EXACT = 1e-9
ATTITUDES = [
    Attitude(*np.radians(angles))
    for angles in ((20, 10, 5), (-140, -30, 170), (179, 60, -90), (0, 0, 180), (90, -89, 3))
]


def test_an_attitude_turns_as_it_says():
    right, down, forward = Attitude(0.2, 0.1, 0.3).matrix.T
    assert np.arctan2(forward[0], forward[2]) == pytest.approx(0.2), 'yaw is to the right'
    assert -np.arcsin(forward[1]) == pytest.approx(0.1), 'pitch is up'
    assert right[1] > 0, 'roll is clockwise'
    assert np.cross(right, down) == pytest.approx(forward)


@pytest.mark.parametrize('attitude', ATTITUDES)
def test_the_angles_come_back_from_the_matrix(attitude):
    back = Attitude.of(attitude.matrix)
    assert vars(back) == pytest.approx(vars(attitude), abs=EXACT)


@pytest.mark.parametrize('pitch_deg', [90, -90])
def test_straight_up_and_down_any_angles_of_the_same_rotation_do(pitch_deg):
    matrix = Attitude(*np.radians([30, pitch_deg, 20])).matrix
    assert Attitude.of(matrix).matrix == pytest.approx(matrix, abs=1e-6)


def test_rotation_vectors():
    matrix = Attitude(yaw_rad=0.4).matrix
    assert rotation_vector(matrix) == pytest.approx([0, 0.4, 0], abs=EXACT)
    assert rotation_matrix([0, 0.4, 0]) == pytest.approx(matrix, abs=EXACT)
    assert angle_between(LEVEL.matrix, matrix) == pytest.approx(0.4)


def test_the_closest_rotation_is_the_one_between_all_rays_that_count():
    second = np.vstack([np.eye(3), [0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    matrix = Attitude(0.4, -0.2, 0.1).matrix
    first = second @ matrix.T
    first[-1] = (0.0, 1.0, 0.0)
    weight = np.array([1.0, 2.0, 1.0, 1.0, 0.0])
    assert closest_rotation(first, second, weight) == pytest.approx(matrix, abs=EXACT)


def test_only_a_turn_about_the_vertical_is_a_pure_yaw():
    assert Attitude(1.0).is_pure_yaw
    assert not Attitude(1.0, 0.1).is_pure_yaw
    assert not Attitude(1.0, 0.0, 0.1).is_pure_yaw


@pytest.mark.parametrize(
    'attitude', [*ATTITUDES, LEVEL, Attitude(np.pi), Attitude(roll_rad=np.pi)]
)
def test_a_quaternion_is_the_same_rotation(attitude):
    x, y, z, w = quaternion(attitude)
    vector = np.array([x, y, z])
    across = np.cross(vector, np.eye(3)).T
    matrix = np.eye(3) + 2 * w * across + 2 * across @ across
    assert w >= 0
    assert matrix == pytest.approx(attitude.matrix, abs=1e-7)
    assert attitude_of(x, y, z, w).matrix == pytest.approx(attitude.matrix, abs=1e-7)
    assert attitude_of(-x, -y, -z, -w).matrix == pytest.approx(attitude.matrix, abs=1e-7)
