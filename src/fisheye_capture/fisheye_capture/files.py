"""Sources on disk: a picture, several pictures, a video."""

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.pace import PacedSource
from fisheye_capture.source import SourceEndedError
from fisheye_core.encodings import from_opencv
from fisheye_core.errors import SourceError
from fisheye_core.picture_file import read_picture


class PictureSource(PacedSource):
    """One picture for ever, decoded once; the array is read-only and always the same."""

    def __init__(self, settings: CaptureSettings, path: Path):
        super().__init__(settings.frame_rate_hz)
        self._image = from_opencv(read_picture(path), settings.encoding)
        self._image.setflags(write=False)

    def _picture(self, stamp_ns):
        return self._image


class SequenceSource(PacedSource):
    """Pictures in turn, all of one size: those of a folder or the frames of a video."""

    def __init__(self, settings: CaptureSettings, pictures: Iterator[tuple[str, np.ndarray]]):
        """Start with pictures, each with a name; their end is the end of the source."""
        super().__init__(settings.frame_rate_hz)
        self._encoding = settings.encoding
        first = next(pictures)
        self._shape = first[1].shape
        self._pictures = chain([first], pictures)

    def _picture(self, stamp_ns):
        try:
            name, image = next(self._pictures)
        except StopIteration:
            raise SourceEndedError('the last picture was shown (loop is false)') from None
        if image.shape != self._shape:
            raise SourceError(
                f'{name} has {image.shape[1]}x{image.shape[0]} px; '
                f'the pictures before it have {self._shape[1]}x{self._shape[0]} px'
            )
        return from_opencv(image, self._encoding)


def folder_pictures(paths: Sequence[Path], loop: bool) -> Iterator[tuple[str, np.ndarray]]:
    """Yield pictures in turn; a `SourceError` for one that cannot be read."""
    while True:
        for path in paths:
            yield str(path), read_picture(path)
        if not loop:
            return


def video_pictures(path: Path, loop: bool) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the frames of a video; a `SourceError` if it has none."""
    while True:
        video = cv2.VideoCapture(str(path))
        # A calibration knows nothing of a turned picture.
        video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        frames = 0
        while (image := video.read()[1]) is not None:
            frames += 1
            yield f'frame {frames} of {path}', image
        video.release()
        if not frames:
            raise SourceError(f'{path} cannot be read as a video or a picture')
        if not loop:
            return
