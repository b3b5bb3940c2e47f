"""Cameras of this machine, read through OpenCV."""

import os
import stat
import time
from pathlib import Path

import cv2
import numpy as np

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.source import (
    Frame,
    JpegFrame,
    Source,
    SourceEndedError,
    SourceLostError,
)
from fisheye_core.coded_picture import size_of, whole_jpeg
from fisheye_core.encodings import from_opencv
from fisheye_core.errors import ImageFormatError, SourceError

BROKEN_IN_A_ROW = 10
"""So many broken pictures one after the other are a broken camera."""
_PATIENCE_S = 4.0
"""A device may take this long to give its first picture, or to go on after a hiccup."""
_BUFFERS = 2
"""One that is read and one that fills; with one alone, drivers lose every other picture."""
SELECT_TIMEOUT_S = 1
_NS_PER_MS = 1_000_000
_VIDEO4LINUX = 81
"""Major number of its devices."""
# How long OpenCV waits for a picture of a device; it looks when it waits for the first time.
os.environ.setdefault('OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT', str(SELECT_TIMEOUT_S))


def jpeg_frame(stamp_ns: int, data: np.ndarray, encoding: str) -> JpegFrame | None:
    """Return the frame that a camera coded itself, data (n,) uint8; None if it is torn."""
    jpeg = whole_jpeg(data)
    if jpeg is None:
        return None
    try:
        return JpegFrame(stamp_ns, jpeg, size_of(jpeg), encoding)
    except ImageFormatError:
        return None


def check_size(name: str, expected: tuple[int, int] | None, size: tuple[int, int]) -> None:
    """Refuse a picture of another size than those before: the calibration holds for one only.

    Raises
    ------
    SourceLostError
        If it has another.
    """
    if expected not in (None, size):
        raise SourceLostError(
            '{} changed its size from {}x{} px to {}x{} px'.format(name, *expected, *size)
        )


class DeviceSource(Source):
    """A camera of this machine, through Video4Linux."""

    def __init__(self, settings: CaptureSettings):
        source = settings.source
        if len(settings.pixel_format) not in (0, 4):
            raise SourceError(
                f"pixel_format is '{settings.pixel_format}'; expected four letters, as MJPG"
            )
        path = f'/dev/video{source}' if source.isdecimal() else source
        if not os.path.exists(path):
            raise SourceLostError(f'there is no device {path}')
        if not os.access(path, os.R_OK | os.W_OK):
            raise SourceLostError(f'{path} may not be opened; is the user in the group video?')
        device = Path(path).stat()
        if stat.S_ISCHR(device.st_mode) and os.major(device.st_rdev) != _VIDEO4LINUX:
            raise SourceError(f'{path} is not a camera; expected a Video4Linux device')
        capture = cv2.VideoCapture(path, cv2.CAP_V4L2)
        if not capture.isOpened():
            raise SourceLostError(f'{path} cannot be opened; is it a camera, and free?')
        self._name, self._capture, self._encoding = path, capture, settings.encoding
        self._delay_ns = round(settings.delay_ms * _NS_PER_MS)
        self._size = None
        self._interrupted = False
        self.note = self._set_up(settings)

    def read(self) -> Frame | JpegFrame:
        """Wait for the next frame; skips a few broken ones."""
        for _ in range(BROKEN_IN_A_ROW):
            self._grab()
            stamp_ns = time.time_ns() - self._delay_ns
            frame = self._retrieve(stamp_ns)
            if frame is not None:
                check_size(self._name, self._size, frame.size)
                self._size = frame.size
                return frame
            self.damaged += 1
        raise SourceLostError(f'{self._name} sends only broken pictures')

    def close(self) -> None:
        """Release the camera."""
        self._capture.release()

    def interrupt(self) -> None:
        """End a wait within `SELECT_TIMEOUT_S`."""
        self._interrupted = True

    def _set_up(self, settings):
        """Ask for the format, which decides on the sizes, then for the rest; say what differs."""
        capture, pixel_format = self._capture, settings.pixel_format
        capture.set(cv2.CAP_PROP_BUFFERSIZE, _BUFFERS)
        if pixel_format:
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter_fourcc(*pixel_format))
        asked = {
            'width': (cv2.CAP_PROP_FRAME_WIDTH, settings.width),
            'height': (cv2.CAP_PROP_FRAME_HEIGHT, settings.height),
            'rate': (cv2.CAP_PROP_FPS, settings.frame_rate_hz),
        }
        for prop, value in asked.values():
            if value:
                capture.set(prop, value)
        given = {name: capture.get(prop) for name, (prop, _) in asked.items()}
        differing = [
            f'{name} {given[name]:g} instead of {value:g}'
            for name, (_, value) in asked.items()
            if value and abs(given[name] - value) > 0.5
        ]
        code = max(0, int(capture.get(cv2.CAP_PROP_FOURCC)))
        fourcc = code.to_bytes(4, 'little').decode('latin-1')
        if pixel_format and fourcc != pixel_format:
            differing.append(f'{fourcc} instead of {pixel_format}')
        if fourcc == 'MJPG' and settings.encoding != 'mono8':
            # Its own JPEG, to be passed on as it is; in grey it would be another picture.
            capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        return f'{self._name} gives ' + ', '.join(differing) if differing else ''

    def _retrieve(self, stamp_ns):
        """Make a frame of what was grabbed; None if it is broken."""
        try:
            is_whole, image = self._capture.retrieve()
        except cv2.error:
            return None
        if not is_whole or image is None or not image.size:
            return None
        if image.ndim == 2 and image.shape[0] == 1:
            return jpeg_frame(stamp_ns, image[0], self._encoding)
        return Frame(stamp_ns, from_opencv(image, self._encoding))

    def _grab(self):
        deadline_s = time.monotonic() + _PATIENCE_S
        while not self._interrupted:
            began_s = time.monotonic()
            if self._capture.grab():
                return
            now_s = time.monotonic()
            # A failure without a wait is no slow camera but a lost one.
            if now_s - began_s < SELECT_TIMEOUT_S / 2 or now_s > deadline_s:
                raise SourceLostError(f'{self._name} stopped sending pictures')
        raise SourceEndedError('the source was closed')
