"""Two lenses in one stream: the cameras share its reader, and each is a region of its frames."""

from math import pi, radians
from pathlib import Path

import cv2
import numpy as np
import pytest
from ament_index_python.packages import get_package_share_directory
from field import write_pictures

from fisheye_testing.data import real_data
from fisheye_testing.health import Health
from fisheye_testing.mjpeg_server import MjpegServer
from fisheye_testing.rig import SIDES, executable
from fisheye_testing.waiting import wait_for

START_S = 40.0
CLOSE_PX = 1.5
"""Of an overlap; JPEG moves it a little."""
JPEG_LEVELS = 6.0
"""Mean difference that coding a picture once more may make."""


@pytest.fixture
def both(tmp_path):
    """Return what both cameras of the synthetic scene see, side by side in one picture."""
    write_pictures(tmp_path)
    return np.hstack([cv2.imread(str(tmp_path / f'{side}.jpg')) for side in SIDES])


@pytest.fixture
def watcher(domain):
    """Return a subscriber that also hears the diagnostics."""
    with Health(domain) as health:
        yield health


def two_of(source, folder, **regions):
    """Return the parameters of two cameras that are regions of one source."""
    regions = {'left': 'left', 'right': 'right', **regions}
    return {
        f'{side}.{name}': value
        for side in SIDES
        for name, value in (
            ('source', source),
            ('region', regions[side]),
            ('camera_info_url', folder / f'{side}.yaml'),
        )
    }


def message(watcher):
    return watcher.status['panorama'].message if 'panorama' in watcher.status else ''


def check_panorama(rig, watcher):
    wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'an overlap')
    (overlap,) = watcher.overlaps.overlaps
    assert overlap.found
    true_px = radians(140) * watcher.projection.focal_px
    assert overlap.offset_x_px == pytest.approx(true_px, abs=CLOSE_PX)


@pytest.mark.parametrize('split', ['halves', 'boxes', 'top and bottom'])
def test_two_lenses_in_a_picture(rig, watcher, tmp_path, both, split):
    regions = {'boxes': {'left': '0,0,640,480', 'right': '640,0,640,480'}}.get(split, {})
    if split == 'top and bottom':
        both = np.vstack(np.hsplit(both, 2))
        regions = {'left': 'top', 'right': 'bottom'}
    cv2.imwrite(str(tmp_path / 'both.png'), both)
    rig.start('panorama', **two_of(tmp_path / 'both.png', tmp_path, **regions))
    check_panorama(rig, watcher)
    left = cv2.imread(str(tmp_path / 'left.jpg'))
    assert np.array_equal(watcher.picture_on('left/image_raw'), left)


def test_two_lenses_of_a_network_camera_share_one_connection(rig, watcher, tmp_path, both):
    camera = MjpegServer(cv2.imencode('.jpg', both)[1].tobytes(), rate_hz=20)
    # While this process, which is the camera, is held up the camera is silent.
    rig.start('panorama', silence_timeout_s=20.0, **two_of(camera.url, tmp_path))
    check_panorama(rig, watcher)
    assert camera.connections == 1
    right = cv2.imread(str(tmp_path / 'right.jpg')).astype(int)
    assert np.abs(watcher.picture_on('right/image_raw') - right).mean() < JPEG_LEVELS
    camera.stop()
    wait_for(
        lambda: 'left, right: ' in message(watcher) and 'refuses' in message(watcher),
        START_S,
        'the loss, told once for both',
    )


def test_two_lenses_of_a_topic_share_one_subscription(rig, watcher, tmp_path, both):
    cv2.imwrite(str(tmp_path / 'both.png'), both)
    rig.start('dual/capture', source=tmp_path / 'both.png')
    parameters = two_of('topic', tmp_path)
    command = [str(executable('panorama')), '--ros-args']
    for side in SIDES:
        command += ['-r', f'{side}/image_raw:=/dual/image_raw']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={value}']
    rig.run('panorama', command)
    check_panorama(rig, watcher)
    assert watcher.node.count_subscribers('/dual/image_raw') == 1


def test_lenses_of_a_topic_that_camera_infos_describe(rig, watcher, tmp_path, both):
    cv2.imwrite(str(tmp_path / 'both.png'), both)
    for side in SIDES:
        rig.start(
            f'{side}/capture',
            source=tmp_path / 'both.png',
            region=side,
            camera_info_url=tmp_path / f'{side}.yaml',
        )
    rig.start('dual/capture', source=tmp_path / 'both.png')
    command = [str(executable('panorama')), '--ros-args']
    for side in SIDES:
        command += ['-r', f'{side}/image_raw:=/dual/image_raw']
        command += ['-p', f'{side}.source:=topic', '-p', f'{side}.region:={side}']
    rig.run('panorama', command)
    check_panorama(rig, watcher)


def test_a_dual_fisheye_frame_becomes_a_closed_panorama(rig, watcher):
    frame = real_data('gear360', 'frame.png')
    nominal = Path(get_package_share_directory('panorama_stitch'), 'config/calibration')
    rig.start(
        'panorama',
        surface='equirectangular',
        **{
            f'{side}.{name}': value
            for side in SIDES
            for name, value in (
                ('source', frame),
                ('region', side),
                (
                    'camera_info_url',
                    'package://panorama_stitch/config/calibration/dual_fisheye.yaml',
                ),
                ('mask_file', nominal / 'dual_fisheye_mask.png'),
                ('yaw_deg', -90.0 if side == 'left' else 90.0),
                ('pitch_deg', 0.0),
                ('roll_deg', 0.0),
            )
        },
    )
    wait_for(
        lambda: rig.check_alive() or (watcher.projection and watcher.projection.wraps),
        START_S,
        'a closed panorama',
    )
    projection = watcher.projection
    assert projection.width == pytest.approx(2 * pi * projection.focal_px)
    wait_for(
        lambda: watcher.newest and watcher.newest.width == projection.width, START_S, 'its picture'
    )


def test_a_region_outside_the_frame_stops_only_its_own_camera(rig, watcher, tmp_path, both):
    cv2.imwrite(str(tmp_path / 'both.png'), both)
    rig.start('panorama', **two_of(tmp_path / 'both.png', tmp_path, right='900,0,640,480'))
    wait_for(lambda: rig.check_alive() or watcher.newest, START_S, 'a panorama of one camera')
    said = "right: region '900,0,640,480' reaches outside the frame of 1280x480 px; expected"
    wait_for(lambda: said in message(watcher), START_S, 'the sentence')
    left = cv2.imread(str(tmp_path / 'left.jpg'))
    assert np.array_equal(watcher.picture_on('left/image_raw'), left)


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({'left.region': 'middle'}, "left.region is 'middle'; expected left, right, top, bottom"),
        (
            {'left.source': '97', 'right.source': '/dev/video97', 'right.delay_ms': 5},
            'right.delay_ms is 5.0; expected 0.0, as left has it, whose source is the same',
        ),
    ],
)
def test_a_bad_start_is_a_sentence(rig, tmp_path, both, parameters, words):
    files = {f'{side}.camera_info_url': tmp_path / f'{side}.yaml' for side in SIDES}
    rig.start('panorama', **files, **parameters)
    wait_for(lambda: rig.processes['panorama'].poll() is not None, START_S, 'the end')
    said = rig.log('panorama').read_text()
    assert words in said
    assert 'Traceback' not in said
