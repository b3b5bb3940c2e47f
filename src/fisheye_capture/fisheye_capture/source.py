"""What every source of pictures is: something that gives the next frame until it is lost."""

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_core.coded_picture import decoded
from fisheye_core.encodings import from_opencv
from fisheye_core.errors import SourceError
from fisheye_geometry.camera_file import Camera


class SourceLostError(SourceError):
    """A camera that is not there, or not any more; it may come."""


class SourceEndedError(SourceError):
    """The last picture was given, and no more are wanted."""


@dataclass(frozen=True)
class Frame:
    """A picture and when it was taken.

    Attributes
    ----------
    stamp_ns
        Time since the epoch.
    image
        (height, width, 3) or, as mono8, (height, width) uint8; possibly read-only.
    jpeg
        As the camera itself coded it, (n,) uint8; None where it gave pixels.
    """

    stamp_ns: int
    image: np.ndarray
    jpeg = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        height, width = self.image.shape[:2]
        return width, height


@dataclass(frozen=True)
class JpegFrame:
    """A `Frame` that the camera coded: decoded only where its pixels are wanted."""

    stamp_ns: int
    jpeg: np.ndarray
    size: tuple[int, int]
    encoding: str

    @cached_property
    def image(self) -> np.ndarray:
        """Pixels in the wanted encoding; raises an `ImageFormatError` if they are broken."""
        return from_opencv(decoded(self.jpeg), self.encoding)


class Source(ABC):
    """Camera or file that delivers frames one after the other.

    Attributes
    ----------
    camera
        What the camera sees, where the source itself knows it.
    note
        What a user should know of how it was opened; '' for nothing.
    skipped
        Frames that were due while the one before was still in work.
    damaged
        Frames that came damaged and were not given.
    damage
        What is said of them behind their number; '' where `note` says it.
    """

    camera: Camera | None = None
    note: str = ''
    skipped: int = 0
    damaged: int = 0
    damage: str = (
        'pictures came damaged and were dropped, each with those that are drawn upon it; is the '
        'link good enough?'
    )

    @abstractmethod
    def read(self) -> Frame | JpegFrame:
        """Wait for the next frame.

        Raises
        ------
        SourceError
            When there is none; a `SourceLostError` may come back, a `SourceEndedError` does not.
        """

    def interrupt(self) -> None:  # noqa: B027
        """End a `read` that waits in another thread, with a `SourceError`."""

    def close(self) -> None:  # noqa: B027
        """Release what the source holds; no `read` may be under way."""


CREDENTIALS = (
    r'^(?P<scheme>[A-Za-z][\w+.-]*:/{1,3}|(?![A-Za-z][\w+.-]*:/))'
    r'(?P<login>(?!\[[\da-fA-F:.]+\])[^/@:?]*:(?!\d{1,5}[/?]).*|[^/@:?]*)@'
)
"""User and password at the start of a URL; a password may hold any letter, / and @ too.

What looks like a port and a path, or an IPv6 address, is none: an @ may stand further on.
"""
_SECRETS = re.compile(
    '((?:user|usr|login|account|pass|pwd|psw|pw|token|jwt|key|auth|secret|session|sid|ticket|'
    'credential|sig|hash|nonce|code(?!c))[^=&?/;]{0,16}=)[^&]*',
    re.IGNORECASE,
)
"""Users and passwords further on in it: what stands behind such a word, up to the next &."""


def shown_source(source: str) -> str:
    """Return a source as others may read it: a URL without its user, password and tokens."""
    return _SECRETS.sub(r'\1***', re.sub(CREDENTIALS, r'\g<scheme>', source, count=1))
