"""Devices, with OpenCV's capture replaced: none is at hand where tests run."""

import itertools
import time

import cv2
import numpy as np
import pytest

from fisheye_capture import device as device_module
from fisheye_capture.device import DeviceSource
from fisheye_capture.source import SourceEndedError, SourceLostError
from fisheye_core.errors import SourceError

GOOD = (True, np.full((24, 32, 3), 9, np.uint8))


class Capture:
    """A `cv2.VideoCapture` that gives prepared answers and notes what is asked of it."""

    def __init__(self, answers=(), given=None):
        self.asked = []
        self.is_released = False
        self._answers = iter(answers)
        self._given = given or {}
        self._values = {}

    def isOpened(self):  # noqa: N802
        return True

    def set(self, prop, value):
        self.asked.append(prop)
        self._values[prop] = self._given.get(prop, value)

    def get(self, prop):
        return self._values.get(prop, 0.0)

    def grab(self):
        self._next = next(self._answers, None)
        return self._next is not None

    def retrieve(self):
        if isinstance(self._next, Exception):
            raise self._next
        return self._next

    def release(self):
        self.is_released = True


class JpegCapture(Capture):
    """Device that delivers what the camera coded when told not to convert, as Video4Linux does."""

    def retrieve(self):
        is_whole, jpeg = super().retrieve()
        if self._values.get(cv2.CAP_PROP_CONVERT_RGB, 1):
            return is_whole, cv2.imdecode(jpeg, cv2.IMREAD_COLOR)
        return is_whole, jpeg[None]


JPEG = cv2.imencode('.jpg', GOOD[1])[1].ravel()


@pytest.fixture
def open_device(monkeypatch, settings, tmp_path):
    """Open a device whose capture is replaced; its path is there."""

    def open_it(capture, **changes):
        path = tmp_path / 'video0'
        path.touch()
        monkeypatch.setattr(device_module.cv2, 'VideoCapture', lambda *arguments: capture)
        return DeviceSource(settings(path, **changes))

    return open_it


def test_the_format_is_asked_for_before_the_size(open_device):
    capture = Capture()
    device = open_device(capture, width=800, height=600, frame_rate_hz=30.0)
    asked = [prop for prop in capture.asked if prop != cv2.CAP_PROP_BUFFERSIZE]
    assert asked == [
        cv2.CAP_PROP_FOURCC,
        cv2.CAP_PROP_FRAME_WIDTH,
        cv2.CAP_PROP_FRAME_HEIGHT,
        cv2.CAP_PROP_FPS,
        cv2.CAP_PROP_CONVERT_RGB,
    ]
    assert capture.get(cv2.CAP_PROP_FOURCC) == cv2.VideoWriter_fourcc(*'MJPG')
    assert device.note == ''


def test_nothing_is_asked_for_that_was_not_set(open_device):
    capture = Capture()
    open_device(capture, pixel_format='')
    assert cv2.CAP_PROP_FOURCC not in capture.asked
    assert cv2.CAP_PROP_FRAME_WIDTH not in capture.asked


def test_what_the_device_gives_instead_is_noted(open_device):
    given = {
        cv2.CAP_PROP_FRAME_WIDTH: 640.0,
        cv2.CAP_PROP_FOURCC: cv2.VideoWriter_fourcc(*'YUYV'),
    }
    device = open_device(Capture(given=given), width=800, frame_rate_hz=30.0)
    assert 'width 640 instead of 800' in device.note
    assert 'YUYV instead of MJPG' in device.note


def test_a_pixel_format_has_four_letters(open_device):
    with pytest.raises(SourceError, match="pixel_format is 'JPEG2000'; expected four letters"):
        open_device(Capture(), pixel_format='JPEG2000')


def test_a_device_that_cannot_be_opened_may_come(settings, tmp_path):
    path = tmp_path / 'video0'
    path.touch()
    with pytest.raises(SourceLostError, match='cannot be opened; is it a camera'):
        DeviceSource(settings(path))


@pytest.mark.parametrize(
    'broken',
    [(False, None), (True, None), (True, np.empty((0, 0, 3), np.uint8)), cv2.error('bad')],
)
def test_a_broken_picture_is_skipped_and_counted(open_device, broken):
    device = open_device(Capture([broken, GOOD]), encoding='mono8')
    assert device.read().image.shape == (24, 32)
    assert device.damaged == 1


def test_only_broken_pictures_are_a_lost_camera(open_device):
    device = open_device(Capture(itertools.repeat((True, None))))
    with pytest.raises(SourceLostError, match='video0 sends only broken pictures'):
        device.read()


def test_what_the_camera_needs_is_taken_off_the_stamp(open_device):
    before_ns = time.time_ns()
    stamp_ns = open_device(Capture([GOOD]), delay_ms=5000.0).read().stamp_ns
    assert before_ns - 5_000_000_000 <= stamp_ns <= time.time_ns() - 5_000_000_000


def test_a_device_that_is_no_camera_is_named(settings):
    with pytest.raises(SourceError, match='/dev/zero is not a camera; expected a Video4Linux'):
        DeviceSource(settings('/dev/zero'))


def test_another_size_is_a_lost_camera(open_device):
    larger = (True, np.zeros((48, 64, 3), np.uint8))
    device = open_device(Capture([GOOD, larger]))
    device.read()
    with pytest.raises(SourceLostError, match='changed its size from 32x24 px to 64x48 px'):
        device.read()


def test_a_device_that_is_unplugged_is_lost_at_once(open_device):
    capture = Capture([GOOD])
    device = open_device(capture)
    device.read()
    with pytest.raises(SourceLostError, match='stopped sending pictures'):
        device.read()
    device.close()
    assert capture.is_released


def test_a_slow_device_is_waited_for(open_device, monkeypatch):
    """Its first pictures take longer than one wait of OpenCV's."""
    capture = Capture([GOOD])
    grabs = iter([False, False, True])
    seconds = itertools.count(step=device_module.SELECT_TIMEOUT_S)
    monkeypatch.setattr(capture, 'grab', lambda: next(grabs) and Capture.grab(capture))
    device = open_device(capture)
    monkeypatch.setattr(device_module.time, 'monotonic', lambda: next(seconds) / 2)
    assert device.read().image.shape == (24, 32, 3)


def test_an_interrupted_device_ends(open_device):
    device = open_device(Capture([GOOD]))
    device.interrupt()
    with pytest.raises(SourceEndedError):
        device.read()


def test_the_jpeg_of_a_device_is_kept_and_decoded_only_when_it_is_wanted(open_device):
    torn = JPEG[:-20]
    noise = np.arange(200, dtype=np.uint8)
    answers = [(True, picture) for picture in (torn, noise, np.append(JPEG, noise * 0))]
    frame = open_device(JpegCapture(answers), encoding='rgb8').read()
    np.testing.assert_array_equal(frame.jpeg, JPEG)
    assert frame.size == (32, 24)
    assert 'image' not in vars(frame)
    assert frame.image.shape == (24, 32, 3)


def test_a_grey_picture_is_no_jpeg_of_the_device(open_device):
    frame = open_device(JpegCapture([(True, JPEG)]), encoding='mono8').read()
    assert (frame.jpeg, frame.image.shape) == (None, (24, 32))


def test_a_device_whose_jpeg_changes_its_size_is_lost(open_device):
    larger = cv2.imencode('.jpg', np.zeros((48, 64, 3), np.uint8))[1].ravel()
    device = open_device(JpegCapture([(True, JPEG), (True, larger)]))
    device.read()
    with pytest.raises(SourceLostError, match='changed its size from 32x24 px to 64x48 px'):
        device.read()
