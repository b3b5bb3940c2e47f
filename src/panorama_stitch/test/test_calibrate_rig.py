import shutil
import sys
import threading

import cv2
import numpy as np
import pytest
import rclpy
import yaml
from scenes import world
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from turning import MOUNTS_DEG, turn_pictures, turning_lens

from fisheye_bridge.qos import IMAGE
from fisheye_bridge.stamps import stamp_of
from fisheye_core.command_line import FAILED
from fisheye_core.errors import SourceError
from fisheye_geometry.camera_file import read_camera
from fisheye_testing.image_message import to_message
from panorama_stitch.turn import record_node
from panorama_stitch.turn.calibrate_rig import GOOD, main
from panorama_stitch.turn.record_node import record
from panorama_stitch.turn.tracker import TurnTracker
from panorama_stitch.turn.turn_calibration import calibrate_turn

STEP_DEG, TURNED_DEG = 7.0, 378.0
AROUND = 51
"""Pictures of one turn."""
FOCAL, ANGLE_DEG, MOUNT_DEG = 0.005, 0.3, 0.3
BEYOND_LEFT_DEG = 40.0
"""Above and below what the left camera sees in the middle of its picture."""
PERIOD_NS = 100_000_000
NAMES = tuple(MOUNTS_DEG)


@pytest.fixture(scope='module')
def pictures():
    angles = np.radians(np.arange(0, TURNED_DEG, STEP_DEG))
    return list(turn_pictures(world(), turning_lens(), angles))


@pytest.fixture(scope='module')
def recorded(pictures, tmp_path_factory):
    """A folder with a folder of pictures for each camera."""
    folder = tmp_path_factory.mktemp('turn')
    for name, seen in zip(NAMES, zip(*pictures, strict=True), strict=True):
        (folder / name).mkdir()
        for number, picture in enumerate(seen):
            cv2.imwrite(str(folder / name / f'{number:03}.png'), picture)
    return folder


def sources(folder):
    return [f'{name}={folder / name}' for name in NAMES]


def refused(capsys, *arguments):
    """Run a command that must fail; give its sentence."""
    assert main([str(argument) for argument in arguments]) == FAILED
    told = capsys.readouterr().err
    assert told.startswith('calibrate_rig: ')
    assert told.count('\n') == 1
    return told


def test_from_folders_of_pictures_to_the_files_of_a_panorama(recorded, tmp_path, capsys):
    assert main([*sources(recorded), '-o', str(tmp_path)]) == GOOD
    told = capsys.readouterr().out
    assert 'verdict  good' in told
    assert '371.0 degrees to the right' in told
    truth = turning_lens()
    grid = np.stack(np.meshgrid(np.arange(truth.width), np.arange(truth.height)), -1)
    true, seen = truth.unproject(grid)
    for name in NAMES:
        camera = read_camera(tmp_path / f'{name}.yaml')
        assert camera.name == name
        assert abs(camera.lens.focal_x_px / truth.focal_x_px - 1) < FOCAL
        apart = np.linalg.norm(camera.lens.unproject(grid)[0] - true, axis=-1)
        assert np.degrees(apart[seen].max()) < ANGLE_DEG
    nodes = yaml.safe_load((tmp_path / 'rig.yaml').read_text())
    stitch, panorama = (nodes[f'/**/{n}']['ros__parameters'] for n in ('stitch', 'panorama'))
    for name, mount in MOUNTS_DEG.items():
        for angle, value in zip(('yaw', 'pitch', 'roll'), mount, strict=True):
            assert abs(stitch[f'{name}.{angle}_deg'] - value) < MOUNT_DEG
            assert panorama[f'{name}.{angle}_deg'] == stitch[f'{name}.{angle}_deg']
        url = (tmp_path / f'{name}.yaml').as_uri()
        assert panorama[f'{name}.camera_info_url'] == url
        assert nodes[f'/**/{name}/capture']['ros__parameters']['camera_info_url'] == url
    # What it wrote it may replace.
    assert 'nowhere is not there' in refused(capsys, 'left=nowhere', '-o', tmp_path)


def test_what_only_the_second_camera_sees_counts_too(pictures):
    tracker = TurnTracker(NAMES)
    for left, right in pictures:
        tracker.add((left[60:180, 60:260], right))
    state = calibrate_turn(tracker, NAMES).fit.state
    above_deg = np.degrees(np.arcsin(state.directions[:, 1]))
    assert np.count_nonzero(np.abs(above_deg) > BEYOND_LEFT_DEG) > 80
    assert np.abs(state.lenses[:, 0] / turning_lens().focal_x_px - 1).max() < FOCAL


def test_topics_are_watched_until_the_rig_has_come_round(pictures):
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('turning', context=context)
    topics = {name: f'/calibrate_rig_test/{name}' for name in NAMES}
    publishers = [node.create_publisher(Image, topic, IMAGE) for topic in topics.values()]
    ended = threading.Event()

    tracker = TurnTracker(NAMES)

    def turn():
        """Go on whenever the last pictures were taken: a machine that is busy turns slowly."""
        stamp_ns = 0
        while not ended.wait(0.02):
            stamp_ns += PERIOD_NS
            now = pictures[len(tracker.frames) % AROUND]
            for publisher, picture in zip(publishers, now, strict=True):
                header = Header(stamp=stamp_of(stamp_ns))
                publisher.publish(to_message(picture, 'mono8', header))

    thread = threading.Thread(target=turn)
    thread.start()
    try:
        record(topics, tracker)
    finally:
        ended.set()
        thread.join()
        node.destroy_node()
        rclpy.shutdown(context=context)
    assert 50 <= len(tracker.frames) <= 60


def test_nobody_publishes(monkeypatch):
    monkeypatch.setattr(record_node, '_LONGEST_WAIT_S', 0.3)
    with pytest.raises(SourceError, match='came on /calibrate_rig_test/nobody for'):
        record({'left': '/calibrate_rig_test/nobody'}, TurnTracker(['left']))


def test_half_a_turn_is_none(recorded, tmp_path, capsys):
    for name in NAMES:
        (tmp_path / name).mkdir()
        for number in range(26):
            shutil.copy(recorded / name / f'{number:03}.png', tmp_path / name)
    told = refused(capsys, *sources(tmp_path))
    assert 'none of 26 pictures shows again what the first one shows' in told


def test_pictures_too_far_apart(recorded, tmp_path, capsys):
    for name in NAMES:
        (tmp_path / name).mkdir()
        for number in (0, 13, 26):
            shutil.copy(recorded / name / f'{number:03}.png', tmp_path / name)
    assert 'picture 2 of left shows only' in refused(capsys, *sources(tmp_path))


def test_cameras_with_different_numbers_of_pictures(recorded, tmp_path, capsys):
    (tmp_path / 'left').mkdir()
    shutil.copy(recorded / 'left' / '000.png', tmp_path / 'left')
    told = refused(capsys, f'left={tmp_path / "left"}', f'right={recorded / "right"}')
    assert 'left has 1 pictures and right more' in told


def test_a_picture_that_cannot_be_read(recorded, tmp_path, capsys):
    shutil.copy(recorded / 'left' / '000.png', tmp_path)
    (tmp_path / '001.png').write_bytes(b'no picture')
    told = refused(capsys, f'left={tmp_path}')
    assert '001.png is not a picture that can be read' in told


def test_a_scene_that_stands_still(recorded, tmp_path, capsys):
    for name in NAMES:
        (tmp_path / name).mkdir()
        for number in range(3):
            shutil.copy(recorded / name / '000.png', tmp_path / name / f'{number}.png')
    assert 'only 1 pictures were kept' in refused(capsys, *sources(tmp_path))


@pytest.mark.parametrize(
    ('arguments', 'told'),
    [
        (['left'], "'left' names no camera; expected NAME=SOURCE"),
        (['left=a', 'left=b'], "'left=b' names no camera"),
        (['7=a'], "'7=a' names no camera"),
        ([f'c{number}=a' for number in range(9)], '9 cameras; expected 1 to 8'),
        (['left=nowhere'], 'nowhere is not there'),
        (['rig=a'], "camera 'rig' and the parameters would both be written to rig.yaml"),
        (['a/b=c', 'a_b=c'], "camera 'a_b' and camera 'a/b' would both be written to a_b.yaml"),
        (['left=a', '--turn', 'up'], "invalid choice: 'up'"),
        (['left=a', '-o', 'nowhere'], 'nowhere cannot be written to: it is no folder'),
    ],
)
def test_bad_arguments_are_a_sentence(arguments, told, capsys):
    assert told in refused(capsys, *arguments)


def test_parameters_of_the_user_are_not_replaced(tmp_path, capsys):
    (tmp_path / 'rig.yaml').write_text('/**:\n  ros__parameters: {width: 640}\n')
    told = refused(capsys, 'left=nowhere', '-o', tmp_path)
    assert 'rig.yaml cannot be written: there is one that calibrate_rig did not write' in told


def test_without_ros_only_topics_are_refused(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'panorama_stitch.turn.record_node', None)
    assert '--topics needs ROS 2' in refused(capsys, '--topics', 'left=/left/image_raw')


def test_topics_on_which_nothing_came_before_the_end(monkeypatch, capsys):
    monkeypatch.setattr(record_node, 'record', lambda topics, tracker: None)
    assert 'only 0 pictures were kept' in refused(capsys, '--topics', 'left=/left/image_raw')
