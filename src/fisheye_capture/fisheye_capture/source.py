"""What every source of pictures is: something that gives the next frame until it is lost."""

from abc import ABC, abstractmethod
from typing import NamedTuple

import cv2
import numpy as np

from fisheye_geometry.camera_file import Camera
from fisheye_geometry.errors import SourceError


class SourceLostError(SourceError):
    """A camera that is not there, or not any more; it may come."""


class SourceEndedError(SourceError):
    """The last picture was given, and no more are wanted."""


class Frame(NamedTuple):
    """A picture and when it was taken.

    Attributes
    ----------
    stamp_ns
        Time since the epoch.
    image
        (height, width, 3) or, as mono8, (height, width) uint8; possibly read-only.
    """

    stamp_ns: int
    image: np.ndarray


class Source(ABC):
    """Gives frames, one after the other.

    Attributes
    ----------
    camera
        What the camera sees, where the source itself knows it.
    note
        What a user should know of how it was opened; '' for nothing.
    skipped
        Frames that were due while the one before was still in work.
    """

    camera: Camera | None = None
    note: str = ''
    skipped: int = 0

    @abstractmethod
    def read(self) -> Frame:
        """Wait for the next frame.

        Raises
        ------
        SourceError
            When there is none; a `SourceLostError` may come back, a `SourceEndedError` does not.
        """

    def interrupt(self) -> None:  # noqa: B027
        """Have a `read` that waits in another thread end soon, with a `SourceError`."""

    def close(self) -> None:  # noqa: B027
        """Release what the source holds; no `read` may be under way."""


_FROM_COLOR = {'rgb8': cv2.COLOR_BGR2RGB, 'mono8': cv2.COLOR_BGR2GRAY}
_FROM_GREY = {'rgb8': cv2.COLOR_GRAY2RGB, 'bgr8': cv2.COLOR_GRAY2BGR}


def encoded(image: np.ndarray, encoding: str) -> np.ndarray:
    """Turn OpenCV's picture, (height, width[, 3]) grey or BGR, into one of an encoding."""
    conversion = (_FROM_GREY if image.ndim == 2 else _FROM_COLOR).get(encoding)
    return image if conversion is None else cv2.cvtColor(image, conversion)
