"""The capture node with a device that codes its pictures itself."""

import tempfile
import time

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage

from fisheye_bridge.images import from_jpeg, to_array
from fisheye_capture import device, source
from fisheye_testing.odd_pictures import turned


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
