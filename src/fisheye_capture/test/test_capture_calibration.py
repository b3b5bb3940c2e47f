"""The calibration beside the pictures: read, published, and written by set_camera_info."""

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of, camera_of
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.camera_file import Camera, read_camera, write_camera

LENS = synthetic_lens(640, 480, np.radians(170))
SMALL = synthetic_lens(32, 24, np.radians(170))


def test_without_a_calibration_k_is_zero_and_it_is_said(ros, write_picture):
    ros.start(source=str(write_picture('one.png', 7)))
    info = ros.hear('/left/camera_info')
    assert (info.width, info.height, any(info.k)) == (32, 24, False)

    def is_said():
        status = ros.hear('/diagnostics').status[0]
        # A busy machine may have shed pictures, too, or have told of the time before the first.
        said = status.message.split(';')[0]
        return (status.level, said) == (DiagnosticStatus.WARN, 'the camera is not calibrated')

    ros.spin_until(is_said, 'the sentence about it')


def test_a_calibration_file_is_published(ros, write_picture, tmp_path):
    write_camera(tmp_path / 'left.yaml', Camera('left', SMALL))
    ros.start(
        source=str(write_picture('one.png', 7)), camera_info_url=f'file://{tmp_path}/left.yaml'
    )
    assert camera_of(ros.hear('/left/camera_info')).lens == SMALL


def test_a_calibration_of_another_size_is_not_published(ros, write_picture, tmp_path):
    write_camera(tmp_path / 'left.yaml', Camera('left', LENS))
    ros.start(source=str(write_picture('one.png', 7)), camera_info_url=str(tmp_path / 'left.yaml'))
    assert not any(ros.hear('/left/camera_info').k)
    said = 'the calibration is for 640x480 px; the pictures have 32x24 px'
    ros.spin_until(
        lambda: ros.hear('/diagnostics').status[0].message.startswith(said),
        'the sentence about it',
    )


def test_set_camera_info_writes_the_file_and_is_used_at_once(ros, write_picture, tmp_path):
    path = tmp_path / 'new' / 'left.yaml'
    ros.start(source=str(write_picture('one.png', 7)), camera_info_url=str(path))
    assert not any(ros.hear('/left/camera_info').k)
    answer = ros.call(camera_info_of(Camera('left', SMALL), Header()))
    assert answer.success
    assert str(path) in answer.status_message
    assert read_camera(path) == Camera('left', SMALL, projection=read_camera(path).projection)
    ros.spin_until(lambda: any(ros.hear('/left/camera_info').k), 'the new calibration')


def test_set_camera_info_is_refused_with_a_sentence(ros, write_picture, tmp_path):
    ros.start(source=str(write_picture('one.png', 7)))
    answer = ros.call(camera_info_of(Camera('left', SMALL), Header()))
    assert (answer.success, answer.status_message) == (
        False,
        'camera_info_url is empty; expected the file to write',
    )


def test_nonsense_is_never_written(ros, write_picture, tmp_path):
    path = tmp_path / 'left.yaml'
    ros.start(source=str(write_picture('one.png', 7)), camera_info_url=str(path))
    answer = ros.call(CameraInfo(width=32, height=24, distortion_model='equidistant'))
    assert not answer.success
    assert 'K is zero' in answer.status_message
    assert not path.exists()


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda m: m.r.__setitem__(4, np.nan), 'R holds nan; expected finite numbers'),
        (lambda m: m.p.__setitem__(3, np.inf), 'P holds inf; expected finite numbers'),
        (lambda m: m.k.__setitem__(2, -1e6), 'center_x_px is -1e+06; expected it within'),
        (lambda m: m.k.__setitem__(0, np.nan), 'focal_x_px is nan; expected'),
        (lambda m: m.d.__setitem__(0, np.nan), 'finite numbers'),
        (
            lambda m: setattr(m, 'width', 64),
            'the calibration is for 64x24 px; the pictures have 32x24 px',
        ),
        (
            lambda m: setattr(m, 'binning_x', 2),
            'the calibration is for 16x24 px; the pictures have 32x24 px',
        ),
        (lambda m: setattr(m.roi, 'x_offset', 1), 'roi has 32 px from 1 on along x'),
    ],
)
def test_what_the_next_start_would_refuse_is_never_written(
    ros, write_picture, tmp_path, change, words
):
    path = tmp_path / 'left.yaml'
    ros.start(source=str(write_picture('one.png', 7)), camera_info_url=str(path))
    ros.hear('/left/camera_info')
    message = camera_info_of(Camera('left', SMALL), Header())
    change(message)
    answer = ros.call(message)
    assert not answer.success
    assert words in answer.status_message
    assert not path.exists()


def test_the_usual_place_of_calibrations_is_written_and_read(
    ros, write_picture, tmp_path, monkeypatch
):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    url = 'file://${ROS_HOME}/camera_info/${NAME}.yaml'
    ros.start(source=str(write_picture('one.png', 7)), camera_info_url=url)
    ros.hear('/left/camera_info')
    answer = ros.call(camera_info_of(Camera('left', SMALL), Header()))
    assert answer.status_message == f'written to {tmp_path}/camera_info/left.yaml'
    assert read_camera(tmp_path / 'camera_info' / 'left.yaml').lens == SMALL
