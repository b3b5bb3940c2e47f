"""The whole line as users run it: installed executables, real DDS, a subscriber of its own."""

import math
import os
import signal
import time

import numpy as np
import pytest
from fisheye_bridge.camera_info import camera_of
from rig import COMPOSED, SEPARATE, camera_parameters, wait_for
from sensor_msgs.msg import CameraInfo, CompressedImage

RATE_HZ = 30.0
WATCHED_S = float(os.environ.get('WATCHED_S', '8'))
START_S = 40.0
STOP_S = 2.0
CLOSE_PX = 1.0
LEVEL_GAIN_STEP = 12
"""Grey levels by which neighbouring columns at a seam may differ more than elsewhere."""


def start(rig, watcher, *, composed=False, folder=None, **capture):
    rig.start_all(composed, camera_parameters(folder), frame_rate_hz=RATE_HZ, **capture)
    wait_for(lambda: rig.check_alive() or watcher.newest, START_S, 'a first panorama')
    wait_for(lambda: watcher.overlaps and watcher.projection, START_S, 'the latched topics')


@pytest.mark.parametrize('composed', [False, True], ids=['five nodes', 'one node'])
def test_every_pair_arrives_and_every_node_ends_at_once(rig, watcher, composed):
    start(rig, watcher, composed=composed)
    time_to_settle = time.time_ns() + 1_000_000_000
    wait_for(lambda: watcher.stamps_ns[-1] > time_to_settle, START_S, 'a settled stream')
    watcher.restart()
    wait_for(
        lambda: len(watcher.stamps_ns) > WATCHED_S * RATE_HZ, 3 * WATCHED_S + 10, 'the panoramas'
    )
    gaps = np.diff(watcher.stamps_ns) * RATE_HZ / 1e9
    assert gaps == pytest.approx(1.0, abs=1e-3), 'a stamp of the grid is missing'
    # Not the executables' fault if a machine is loaded: they are told to end one after the other.
    for node in reversed(COMPOSED if composed else SEPARATE):
        code, seconds = rig.stop(node)
        assert (node, code) == (node, 0), rig.log(node).read_text()
        assert seconds < STOP_S


def test_the_synthetic_rig_is_stitched_where_it_should_be(rig, watcher):
    start(rig, watcher)
    (overlap,) = watcher.overlaps.overlaps
    assert overlap.found
    assert (overlap.left_camera, overlap.right_camera) == ('left', 'right')
    true_px = math.radians(140) * watcher.projection.focal_px
    assert overlap.offset_x_px == pytest.approx(true_px, abs=CLOSE_PX)
    assert overlap.offset_deg == pytest.approx(140, abs=0.5)
    answer = watcher.calibrate()
    assert answer.success
    assert answer.overlaps[0].offset_x_px == pytest.approx(true_px, abs=CLOSE_PX)
    picture = watcher.picture()
    projection = watcher.projection
    assert picture.shape == (projection.height, projection.width, 3)
    assert picture.any(axis=2).all(), 'no black inside'


@pytest.mark.parametrize('name', ['workshop', 'hall', 'forest', 'apartment', 'bridge'])
def test_real_pictures_are_stitched_where_they_should_be(rig, watcher, real_rig, name):
    import json

    folder = real_rig(name)
    start(rig, watcher, composed=True, folder=folder)
    truth = json.loads((folder / 'truth.json').read_text())
    (overlap,) = watcher.overlaps.overlaps
    true_px = math.radians(truth['offset_deg']) * watcher.projection.focal_px
    assert overlap.found
    assert overlap.offset_x_px == pytest.approx(true_px, abs=CLOSE_PX)
    assert watcher.picture().any(axis=2).all()


@pytest.mark.parametrize('name', ['apart_lobby', 'apart_mixed'])
def test_views_without_a_common_scene_stay_side_by_side(rig, watcher, real_rig, name):
    start(rig, watcher, folder=real_rig(name))
    answer = watcher.calibrate()
    assert answer.success
    assert not answer.overlaps[0].found
    (overlap,) = watcher.overlaps.overlaps
    assert not overlap.found
    assert watcher.projection.width == 2 * overlap.offset_x_px


def test_what_a_teleoperation_stack_needs_is_there(rig, watcher):
    start(rig, watcher)
    taken = {}
    for kind, topic in (
        (CameraInfo, 'left/camera_info'),
        (CompressedImage, 'panorama/image/compressed'),
    ):
        watcher.node.create_subscription(
            kind, topic, lambda message, topic=topic: taken.setdefault(topic, message), 1
        )
    wait_for(lambda: len(taken) == 2, START_S, 'camera_info and a compressed panorama')
    assert camera_of(taken['left/camera_info']).lens.max_angle_rad > math.radians(85)
    assert taken['left/camera_info'].header.frame_id == 'left_optical_frame'
    assert taken['panorama/image/compressed'].format == 'bgr8; jpeg compressed bgr8'
    assert taken['panorama/image/compressed'].header.frame_id == 'panorama_optical_frame'


@pytest.mark.parametrize('with_signal', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('node', ['left/capture', 'left/undistort', 'stitch', 'panorama'])
def test_a_lone_node_ends_at_once(rig, node, with_signal):
    rig.start(node, **({'left.source': 'http://127.0.0.1:9/'} if node == 'panorama' else {}))
    if node == 'panorama':
        wait_for(lambda: rig.processes[node].poll() is not None, START_S, 'a refusal')
        assert 'camera_info_url' in rig.log(node).read_text()
        return
    wait_for(lambda: rig.log(node).exists(), START_S, 'a log')


@pytest.mark.parametrize(
    ('node', 'parameters', 'words'),
    [
        ('left/capture', {'frame_rate_hz': 5000}, 'frame_rate_hz is 5000; expected 0.1 to 1000'),
        ('left/capture', {'source': '/none/there.png'}, "'/none/there.png' is not there"),
        ('left/capture', {'camera_info_url': '/none.yaml'}, '/none.yaml cannot be read'),
        ('left/undistort', {'surface': 'spherical'}, "surface is 'spherical'; expected one of"),
        ('stitch', {'blend': 'soft'}, "blend is 'soft'; expected one of"),
        ('stitch', {'cameras': '[left]'}, "cameras is ['left']; expected at least two"),
        ('panorama', {'left.source': 'gone.mp4'}, "'gone.mp4' is not there"),
    ],
)
def test_a_bad_start_is_a_sentence_and_exit_1(rig, node, parameters, words):
    rig.start(node, **parameters)
    wait_for(lambda: rig.processes[node].poll() is not None, START_S, 'the end')
    said = rig.log(node).read_text()
    assert rig.processes[node].returncode == 1, said
    assert words in said
    assert 'Traceback' not in said
