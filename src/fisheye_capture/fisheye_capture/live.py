"""Cameras read through OpenCV: a device here; in a process of its own, a network stream."""

import os
import time

import cv2

from fisheye_capture.settings import CaptureSettings
from fisheye_capture.source import (
    Frame,
    JpegFrame,
    Source,
    SourceEndedError,
    SourceLostError,
)
from fisheye_geometry.coded_picture import size_of, whole_jpeg
from fisheye_geometry.encodings import from_opencv
from fisheye_geometry.errors import ImageFormatError, SourceError

_BROKEN_IN_A_ROW = 10
"""So many broken pictures one after the other are a broken camera."""
_PATIENCE_S = 4.0
"""A device may take this long to give its first picture, or to go on after a hiccup."""
_BUFFERS = 2
"""One that is read and one that fills; with one alone, drivers lose every other picture."""
_SELECT_TIMEOUT_S = 1
# How long OpenCV waits for a picture of a device; it looks when it waits for the first time.
os.environ.setdefault('OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT', str(_SELECT_TIMEOUT_S))


class LiveSource(Source):
    """What an opened `cv2.VideoCapture` gives, each picture stamped when it was there."""

    def __init__(self, name: str, capture: cv2.VideoCapture, encoding: str):
        self._name = name
        self._capture = capture
        self._encoding = encoding
        self._size = None

    def read(self) -> Frame | JpegFrame:
        """Wait for the next frame; skips a few broken ones."""
        for _ in range(_BROKEN_IN_A_ROW):
            self._grab()
            stamp_ns = time.time_ns()
            image = self._retrieve()
            frame = None if image is None else self._frame(stamp_ns, image)
            if frame is not None:
                return self._checked(frame)
        raise SourceLostError(f'{self._name} gives only broken pictures')

    def close(self) -> None:
        """Release the camera."""
        self._capture.release()

    def _grab(self):
        if not self._capture.grab():
            raise SourceLostError(f'{self._name} gives no more pictures')

    def _retrieve(self):
        try:
            is_whole, image = self._capture.retrieve()
        except cv2.error:
            return None
        return image if is_whole and image is not None and image.size else None

    def _frame(self, stamp_ns, image):
        """Make a frame of what OpenCV gave; None if it is broken."""
        return Frame(stamp_ns, from_opencv(image, self._encoding))

    def _checked(self, frame):
        """Refuse a picture of another size: the calibration holds for one only."""
        self._size = self._size or frame.size
        if frame.size != self._size:
            raise SourceLostError(
                '{} changed its size from {}x{} px to {}x{} px'.format(
                    self._name, *self._size, *frame.size
                )
            )
        return frame


class DeviceSource(LiveSource):
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
        capture = cv2.VideoCapture(path, cv2.CAP_V4L2)
        if not capture.isOpened():
            raise SourceLostError(f'{path} cannot be opened; is it a camera, and free?')
        super().__init__(path, capture, settings.encoding)
        self._interrupted = False
        self.note = self._set_up(settings)

    def interrupt(self) -> None:
        """End a wait within `_SELECT_TIMEOUT_S`."""
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

    def _frame(self, stamp_ns, image):
        is_coded = image.ndim == 2 and image.shape[0] == 1
        if not is_coded:
            return super()._frame(stamp_ns, image)
        jpeg = whole_jpeg(image[0])
        if jpeg is None:
            return None
        try:
            return JpegFrame(stamp_ns, jpeg, size_of(jpeg), self._encoding)
        except ImageFormatError:
            return None

    def _grab(self):
        deadline_s = time.monotonic() + _PATIENCE_S
        while not self._interrupted:
            began_s = time.monotonic()
            if self._capture.grab():
                return
            now_s = time.monotonic()
            # A failure without a wait is no slow camera but a lost one.
            if now_s - began_s < _SELECT_TIMEOUT_S / 2 or now_s > deadline_s:
                raise SourceLostError(f'{self._name} gives no more pictures')
        raise SourceEndedError('the source was closed')
