"""Rigs of real pictures: level, tilted, turned over, with things near and the robot itself."""

import json
from itertools import pairwise

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fisheye_geometry.camera_file import read_camera
from fisheye_testing.data import real_data
from panorama_stitch.overlap.measure import measure_rotation
from panorama_stitch.overlap.view import OverlapView

RIGHT_RAD = np.radians(0.5)
"""What an operator sees as a step in the panorama."""
CONFIDENT, DOUBTFUL = 0.8, 0.5
FIELD = [
    'back_to_back',
    'body_checked',
    'body_striped',
    'mast',
    'mixed_lenses',
    'nod_12',
    'nod_lean',
    'one_upside_down',
    'portrait',
    'post_at_2',
    'post_near',
    'ring_3',
    'ring_4_tilted',
    'roll_one_6',
    'six_conventional',
    'three_wide_300',
    'tilt_down_12',
    'tilt_down_20',
    'tilt_down_5',
    'tilt_mixed',
    'tilt_one_6',
    'upside_down',
]
APART = ('apart_lobby', 'apart_mixed')


def view(path, camera):
    image = cv2.imread(str(path / f'{camera}.png'))
    return OverlapView(image, read_camera(path / f'{camera}.yaml').lens)


@pytest.mark.parametrize('name', FIELD)
def test_every_neighbouring_pair_of_a_rig_is_right(name):
    path = real_data('field', name)
    truth = json.loads((path / 'truth.json').read_text())
    cameras, attitudes = truth['cameras'], truth['attitude']
    neighbours = list(pairwise(cameras))
    if truth['closed'] and len(cameras) > 2:
        neighbours.append((cameras[-1], cameras[0]))
    for left, right in neighbours:
        left_to_rig, right_to_rig = (
            Rotation.from_matrix(np.reshape(attitudes[camera], (3, 3))) for camera in (left, right)
        )
        result = measure_rotation([(view(path, left), view(path, right))])
        error = (result.rotation.inv() * left_to_rig.inv() * right_to_rig).magnitude()
        assert error < RIGHT_RAD, f'{left} and {right}: {np.degrees(error):.2f} degrees'
        assert result.confidence > CONFIDENT


@pytest.mark.parametrize('name', APART)
def test_views_without_a_common_scene_are_not_believed(name):
    path = real_data('rigs', name)
    result = measure_rotation([(view(path, 'left'), view(path, 'right'))])
    assert result is None or result.confidence < DOUBTFUL
