"""The capture node in this process, heard by a node beside it."""

import re
import tempfile
import threading
import time

import cv2
import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of, camera_of
from fisheye_bridge.images import from_jpeg, to_array
from fisheye_bridge.qos import IMAGE
from fisheye_bridge.topics import ImagePublisher
from fisheye_capture import device, source
from fisheye_capture.capture_node import CaptureNode
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import FileAccessError, FisheyeError, SettingError, SourceError
from fisheye_geometry.camera_file import Camera, read_camera, write_camera
from fisheye_testing.odd_pictures import turned

LENS = synthetic_lens(640, 480, np.radians(170))
SMALL = synthetic_lens(32, 24, np.radians(170))


class Ear(Node):
    """Keeps the last message of each topic of the camera called left."""

    def __init__(self, context):
        super().__init__('ear', context=context)
        self.heard, self.topics = {}, {}
        for kind, topic in (
            (Image, '/left/image_raw'),
            (CameraInfo, '/left/camera_info'),
            (DiagnosticArray, '/diagnostics'),
        ):
            self.listen(kind, topic)

    def listen(self, kind, topic):
        self.topics[topic] = self.create_subscription(
            kind, topic, lambda message: self.heard.update({topic: message}), IMAGE
        )


@pytest.fixture
def ros(wait_until):
    """Return `start`, which builds the node, and `hear`, which spins until a topic was heard."""

    class Ros:
        def __init__(self):
            self.context = rclpy.Context()
            rclpy.init(context=self.context)
            self.executor = SingleThreadedExecutor(context=self.context)
            self.ear = Ear(self.context)
            self.executor.add_node(self.ear)
            self.nodes = [self.ear]

        def start(self, namespace='/left', **parameters):
            node = CaptureNode(
                context=self.context,
                namespace=namespace,
                parameter_overrides=[
                    Parameter(name, value=value) for name, value in parameters.items()
                ],
            )
            self.nodes.append(node)
            self.executor.add_node(node)
            return node

        def spin_until(self, condition, what):
            def spun():
                self.executor.spin_once(timeout_sec=0.05)
                return condition()

            wait_until(spun, what)

        def hear(self, topic):
            self.ear.heard.pop(topic, None)
            self.spin_until(lambda: topic in self.ear.heard, topic)
            return self.ear.heard[topic]

        def call(self, camera_info):
            client = self.ear.create_client(SetCameraInfo, '/left/set_camera_info')
            future = client.call_async(SetCameraInfo.Request(camera_info=camera_info))
            self.spin_until(future.done, 'the answer')
            return future.result()

    ros = Ros()
    yield ros
    for node in reversed(ros.nodes):
        node.destroy_node()
    rclpy.shutdown(context=ros.context)


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
    ros.hear('/left/image_raw')
    info, image = ros.hear('/left/camera_info'), ros.ear.heard['/left/image_raw']
    assert info.header == image.header


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


class JpegDevice:
    """A `cv2.VideoCapture` of a camera that codes its pictures itself."""

    picture = cv2.imencode('.jpg', np.full((24, 32, 3), 90, np.uint8))[1].ravel()

    def isOpened(self):  # noqa: N802
        return True

    def set(self, prop, value):
        return True

    def get(self, prop):
        return {cv2.CAP_PROP_FOURCC: cv2.VideoWriter_fourcc(*'MJPG'), cv2.CAP_PROP_FPS: 30}.get(
            prop, 0
        )

    def grab(self):
        time.sleep(0.02)
        return True

    def retrieve(self):
        return True, self.picture[None]

    def release(self):
        pass


@pytest.fixture
def jpeg_device(monkeypatch):
    """Return the path of a device that is there, and whose capture is replaced."""
    monkeypatch.setattr(device.cv2, 'VideoCapture', lambda *arguments: JpegDevice())
    with tempfile.NamedTemporaryFile(dir='/dev/shm') as file:
        yield file.name


def test_the_jpeg_of_a_device_is_passed_on_as_it_is(ros, jpeg_device, monkeypatch):
    def never(*arguments):
        raise AssertionError('the picture was decoded')

    topic = '/left/image_raw/compressed'
    ros.ear.destroy_subscription(ros.ear.topics['/left/image_raw'])
    ros.ear.listen(CompressedImage, topic)
    monkeypatch.setattr(source, 'decoded', never)
    ros.start(source=jpeg_device)
    message = ros.hear(topic)
    assert bytes(message.data) == JpegDevice.picture.tobytes()
    assert message.format == 'bgr8; jpeg compressed bgr8'
    assert ros.hear('/left/camera_info').width == 32
    monkeypatch.undo()


def test_the_jpeg_of_a_device_is_decoded_for_those_who_want_pixels(ros, jpeg_device):
    ros.start(source=jpeg_device)
    image, encoding = to_array(ros.hear('/left/image_raw'))
    assert (encoding, image.shape, image[0, 0, 0]) == ('bgr8', (24, 32, 3), 90)


def test_a_region_of_a_device_is_coded_anew(ros, jpeg_device):
    topic = '/left/image_raw/compressed'
    ros.ear.listen(CompressedImage, topic)
    ros.start(source=jpeg_device, region='8,4,16,12')
    image, _ = from_jpeg(ros.hear(topic))
    assert image.shape == (12, 16, 3)
    assert image.mean() == pytest.approx(90, abs=3)
    assert to_array(ros.hear('/left/image_raw'))[0].shape == (12, 16, 3)
    info = ros.hear('/left/camera_info')
    assert (info.width, info.height) == (16, 12)


def test_a_region_outside_the_picture_is_told(ros, jpeg_device):
    ros.start(source=jpeg_device, region='8,4,160,12')
    said = "region '8,4,160,12' reaches outside the frame of 32x24 px; expected x + w up to 32"
    ros.spin_until(
        lambda: said in ros.hear('/diagnostics').status[0].message, 'the sentence about it'
    )
    assert '/left/image_raw' not in ros.ear.heard


def test_a_device_held_on_its_side_gives_pictures_as_its_sensor_does(
    ros, jpeg_device, monkeypatch
):
    exif = np.frombuffer(turned(JpegDevice.picture.tobytes()), np.uint8)
    monkeypatch.setattr(JpegDevice, 'picture', exif)
    ros.start(source=jpeg_device)
    assert to_array(ros.hear('/left/image_raw'))[0].shape == (24, 32, 3)


def test_a_picture_that_cannot_be_decoded_is_dropped_and_counted(ros, jpeg_device, monkeypatch):
    impossible = JpegDevice.picture.copy()
    table = impossible.tobytes().index(b'\xff\xc4') + 5
    impossible[table : table + 16] = 255  # More Huffman codes than there are bits for.
    monkeypatch.setattr(JpegDevice, 'picture', impossible)
    ros.start(source=jpeg_device)

    def broken():
        values = {entry.key: entry.value for entry in ros.hear('/diagnostics').status[0].values}
        return int(values['pictures broken'])

    ros.spin_until(broken, 'a broken picture')
    assert '/left/image_raw' not in ros.ear.heard


def test_without_a_calibration_k_is_zero_and_it_is_said(ros, write_picture):
    ros.start(source=str(write_picture('one.png', 7)))
    info = ros.hear('/left/camera_info')
    assert (info.width, info.height, any(info.k)) == (32, 24, False)
    status = ros.hear('/diagnostics').status[0]
    assert status.level == DiagnosticStatus.WARN
    # A busy machine may have shed pictures, too.
    assert status.message.split(';')[0] == 'the camera is not calibrated'


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
    message = ros.hear('/diagnostics').status[0].message
    assert message == 'the calibration is for 640x480 px; the pictures have 32x24 px'


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
        told = ros.hear('/diagnostics').status[0].message
        shed, came = re.search(r'(\d+) of the last (\d+) pictures were shed', told).groups()
        in_work_or_next = 2
        assert 0 < int(came) - int(shed) <= in_work_or_next
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
