"""The capture node in this process, heard by a node beside it."""

import re
import threading

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import CompressedImage

from fisheye_bridge.camera_info import camera_of
from fisheye_bridge.images import from_jpeg, to_array
from fisheye_bridge.topics import ImagePublisher
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import FileAccessError, FisheyeError, SettingError, SourceError

LENS = synthetic_lens(640, 480, np.radians(170))


def test_a_camera_needs_nothing_but_its_namespace(ros):
    ros.start()
    image, info = ros.hear('/left/image_raw'), ros.hear('/left/camera_info')
    assert (image.header.frame_id, image.encoding) == ('left_optical_frame', 'bgr8')
    assert to_array(image)[0].shape == (480, 640, 3)
    lens = camera_of(info).lens
    assert (lens.width, lens.height, lens.model) == (640, 480, 'equidistant')
    assert lens.distortion == LENS.distortion


def test_every_picture_has_a_camera_info_of_its_stamp(ros):
    ros.start(frame_rate_hz=10)
    heard = ros.ear.heard
    for topic in ('/left/image_raw', '/left/camera_info'):
        ros.hear(topic)
    ros.spin_until(
        lambda: heard['/left/camera_info'].header == heard['/left/image_raw'].header,
        'a camera_info of the stamp of the last picture',
    )


def test_the_picture_is_the_one_of_the_file_also_as_jpeg(ros, write_picture):
    ros.start(source=str(write_picture('one.png', 7)), encoding='mono8', frame_rate_hz=30.0)
    topic = '/left/image_raw/compressed'
    ros.ear.listen(CompressedImage, topic)
    image, encoding = to_array(ros.hear('/left/image_raw'))
    assert encoding == 'mono8'
    assert (image == 7).all()
    packed = ros.hear(topic)
    assert packed.format == 'mono8; jpeg compressed '
    assert from_jpeg(packed)[0].shape == (24, 32)


def test_a_camera_that_is_not_there_is_an_error_in_the_diagnostics(ros):
    ros.start(source=97, reconnect_max_s=0.1)
    status = ros.hear('/diagnostics').status[0]
    assert status.level == DiagnosticStatus.ERROR
    assert 'there is no device /dev/video97 (attempts to reopen:' in status.message
    assert '/left/image_raw' not in ros.ear.heard


def test_a_picture_that_was_not_published_is_not_counted_as_handled(ros, monkeypatch):
    release = threading.Event()
    monkeypatch.setattr(ImagePublisher, 'publish_picture', lambda *_: release.wait())
    try:
        ros.start(source='synthetic', frame_rate_hz=100.0, width=64, height=48)

        def told():
            said = ros.hear('/diagnostics').status[0].message
            return re.search(r'(\d+) of the last (\d+) pictures were shed', said)

        shed, came = ros.spin_until(told, 'what was shed').groups()
        in_work_or_next = 2
        assert int(came) - int(shed) <= in_work_or_next
    finally:
        release.set()


def test_the_diagnostics_do_not_tell_the_password(ros):
    ros.start(source='http://user:secret@127.0.0.1:1/stream')
    status = ros.hear('/diagnostics').status[0]
    values = {entry.key: entry.value for entry in status.values}
    assert values['source'] == 'http://127.0.0.1:1/stream'
    assert 'secret' not in str(status)


@pytest.mark.parametrize(
    ('parameters', 'error', 'sentence'),
    [
        ({'source': 'nowhere.png'}, SourceError, "source 'nowhere.png' is not there"),
        ({'frame_rate_hz': 0}, SettingError, 'frame_rate_hz'),
        ({'encoding': 'yuv'}, SettingError, 'bgr8, mono8, rgb8'),
        ({'camera_info_url': 'http://x/y.yaml'}, SettingError, "scheme 'http'"),
        ({'camera_info_url': 'package://nowhere_/y.yaml'}, SettingError, 'not installed'),
        ({'camera_info_url': 'x' * 300}, FileAccessError, 'cannot be read: File name too long'),
        ({'camera_info_url': '/dev/null/x'}, FileAccessError, 'cannot be read: Not a directory'),
    ],
)
def test_what_can_never_work_is_refused_at_start(ros, parameters, error, sentence):
    with pytest.raises(FisheyeError, match=sentence) as raised:
        ros.start(**parameters)
    assert raised.type is error
