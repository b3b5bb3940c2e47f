"""Rigs as they stand in the field, through the running nodes: the overlap and the panorama."""

import json
import math

import pytest
from field import calibrated
from known_rigs import folder_rig

from fisheye_testing.data import real_data
from fisheye_testing.waiting import wait_for

START_S = 60.0
CLOSE_DEG = 0.5
"""Demanded of each rotation, parallax and noise included."""
CONFIDENT = 0.7


def started(rig, watcher, name, composed=True):
    """Run a rig's images; return its truth once its overlaps were measured."""
    folder = real_data('field', name)
    truth = json.loads((folder / 'truth.json').read_text())
    rig.start_all(composed, folder_rig(folder).cameras, frame_rate_hz=5.0)
    wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'the overlaps')
    wait_for(lambda: watcher.newest, START_S, 'a panorama')
    return truth


def bearings_deg(truth):
    return {camera: truth['axes_deg'][camera][0] for camera in truth['cameras']}


@pytest.mark.parametrize(
    'name',
    [
        'tilt_down_12',
        'post_near',
        'body_striped',
        'upside_down',
        'mixed_lenses',
        'ring_3',
        'back_to_back',
    ],
)
def test_the_overlaps_are_those_of_the_rig(rig, watcher, name):
    truth = started(rig, watcher, name)
    bearings = bearings_deg(truth)
    overlaps = watcher.overlaps.overlaps
    assert len(overlaps) == len(truth['cameras']) - (not truth['closed'])
    for overlap in overlaps:
        assert overlap.found, overlap.left_camera
        assert overlap.confidence > CONFIDENT
        true_deg = (bearings[overlap.right_camera] - bearings[overlap.left_camera]) % 360
        assert overlap.yaw_deg % 360 == pytest.approx(true_deg, abs=CLOSE_DEG)
    projection = watcher.projection
    assert projection.wraps == truth['closed']
    if truth['closed']:
        assert projection.width == round(2 * math.pi * projection.focal_px)
    # The newest panorama may be from before the overlaps came, or without a camera that was late.
    wait_for(
        lambda: (watcher.picture().max(axis=2) > 0).mean() > 0.99,
        START_S,
        'a panorama without black',
    )


def test_corrected_images_of_a_tilted_rig_are_stitched_level_too(rig, watcher):
    truth = started(rig, watcher, 'tilt_down_5', composed=False)
    (overlap,) = watcher.overlaps.overlaps
    bearings = bearings_deg(truth)
    assert overlap.found
    true_deg = (bearings['right'] - bearings['left']) % 360
    assert overlap.yaw_deg == pytest.approx(true_deg, abs=CLOSE_DEG)


def test_a_rig_that_leans_is_measured_in_its_own_frame(rig, watcher):
    truth = started(rig, watcher, 'nod_12')
    answer = calibrated(watcher)
    assert 'confidence' in answer.message
    true_deg = truth['relative_deg'][0]
    assert answer.overlaps[0].yaw_deg == pytest.approx(true_deg, abs=CLOSE_DEG)
