"""Sources on disk: a picture, several pictures, a video."""

from collections.abc import Callable, Iterator, Sequence
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


Round = Iterator[tuple[str, np.ndarray | SourceError]]
"""The pictures of one round, each with its name; an error in place of one that cannot be read."""


class SequenceSource(PacedSource):
    """Pictures in turn, all of one size: those of a folder or the frames of a video.

    What cannot be read or has another size is left out; its time passes without a picture, so that
    two cameras keep step.
    """

    damage = ''

    def __init__(self, settings: CaptureSettings, one_round: Callable[[], Round]):
        """Start with what gives the pictures of a round.

        Raises
        ------
        SourceError
            If none of them can be read.
        """
        super().__init__(settings.frame_rate_hz)
        self._encoding = settings.encoding
        self._shape: tuple[int, ...] | None = None
        pictures, begin = self._in_turn(one_round, settings.loop), []
        for picture in pictures:
            begin.append(picture)
            if picture is not None:
                break
        self._pictures = chain(begin, pictures)

    def _picture(self, stamp_ns):
        try:
            image = next(self._pictures)
        except StopIteration:
            raise SourceEndedError('the last picture was shown (loop is false)') from None
        return None if image is None else from_opencv(image, self._encoding)

    def _in_turn(self, one_round, loop):
        """Yield the pictures of each round, None in place of one that is left out."""
        while True:
            is_any_whole, first_fault = False, ''
            for name, picture in one_round():
                if fault := self._fault(name, picture):
                    first_fault = first_fault or fault
                    self.note = self.note or f'{fault}; such pictures are left out'
                    self.damaged += 1
                    yield None
                else:
                    is_any_whole = True
                    yield picture
            if not is_any_whole:
                raise SourceError(first_fault)
            if not loop:
                return

    def _fault(self, name, picture):
        if isinstance(picture, SourceError):
            return str(picture)
        self._shape = self._shape or picture.shape
        if picture.shape == self._shape:
            return ''
        return (
            f'{name} has {picture.shape[1]}x{picture.shape[0]} px; '
            f'the pictures before it have {self._shape[1]}x{self._shape[0]} px'
        )


def folder_pictures(paths: Sequence[Path]) -> Round:
    """Yield the pictures of files."""
    for path in paths:
        try:
            picture: np.ndarray | SourceError = read_picture(path)
        except SourceError as error:
            picture = error
        yield str(path), picture


def video_pictures(path: Path) -> Round:
    """Yield the frames of a video; a `SourceError` is raised if it has none."""
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
