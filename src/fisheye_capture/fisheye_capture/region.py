"""Regions: the part of a source's frames that one camera is, as of two lenses in one stream."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_capture.source import Frame, JpegFrame
from fisheye_core.errors import ImageFormatError, SettingError
from fisheye_geometry.camera import Camera, Readout

_HALVES = {
    'left': lambda width, height: (0, 0, width // 2, height),
    'right': lambda width, height: (width - width // 2, 0, width // 2, height),
    'top': lambda width, height: (0, 0, width, height // 2),
    'bottom': lambda width, height: (0, height - height // 2, width, height // 2),
}
_BOX = re.compile(r'\s*(\d{1,6})\s*,\s*(\d{1,6})\s*,\s*(\d{1,6})\s*,\s*(\d{1,6})\s*', re.ASCII)


class Region:
    """A part of every frame of a source.

    Attributes
    ----------
    name : str
        As the parameter has it: a half, or `x,y,w,h` in px.
    """

    def __init__(self, name: str, setting: str = 'region'):
        """Read the name of a region; `setting` is what the parameter is called.

        Raises
        ------
        SettingError
            If it names none.
        """
        self.name = name
        box = _BOX.fullmatch(name)
        self._box: tuple[int, ...] = tuple(map(int, box.groups())) if box else ()
        if name not in _HALVES and not (box and min(self._box[2:]) > 0):
            raise SettingError(
                f"{setting} is '{name}'; expected {', '.join(_HALVES)}, or x,y,w,h in px "
                'with a width and a height of at least 1'
            )

    def fault(self, width: int, height: int) -> str:
        """Explain why a frame of a size, px, does not hold the region; '' if it does."""
        x, y, w, h = self._in(width, height)
        if w and h and x + w <= width and y + h <= height:
            return ''
        return (
            f"region '{self.name}' reaches outside the frame of {width}x{height} px; expected "
            f'x + w up to {width} and y + h up to {height}'
        )

    def box(self, width: int, height: int) -> tuple[int, int, int, int]:
        """Return x, y, width and height of the region in a frame of a size, px.

        Raises
        ------
        ImageFormatError
            If it is not within the frame.
        """
        if fault := self.fault(width, height):
            raise ImageFormatError(fault)
        return self._in(width, height)

    def cut(self, image: np.ndarray) -> np.ndarray:
        """Return the region's part of an image (height, width[, channels]), a view into it."""
        x, y, w, h = self.box(*image.shape[1::-1])
        return image[y : y + h, x : x + w]

    def frame(self, frame: Frame | JpegFrame) -> 'CutFrame':
        """Return the region's part of a frame, decoded only where its pixels are wanted."""
        _, _, width, height = self.box(*frame.size)
        return CutFrame(frame, self, (width, height))

    def camera(self, camera: Camera) -> Camera:
        """Return the camera whose pictures are the region of another's."""
        return Readout(*self.box(camera.lens.width, camera.lens.height)).of(camera)

    def _in(self, width: int, height: int) -> tuple[int, int, int, int]:
        x, y, w, h = self._box or _HALVES[self.name](width, height)
        return x, y, w, h


@dataclass(frozen=True)
class CutFrame:
    """A region of a `Frame` or `JpegFrame`; the JPEG of the whole is of no use for it."""

    whole: Frame | JpegFrame
    region: Region
    size: tuple[int, int]
    jpeg = None

    @property
    def stamp_ns(self) -> int:
        """Time since the epoch."""
        return self.whole.stamp_ns

    @cached_property
    def image(self) -> np.ndarray:
        """Pixels, a view; raises an `ImageFormatError` if the whole picture is broken."""
        return self.region.cut(self.whole.image)


AnyFrame = Frame | JpegFrame | CutFrame


def region_named(name: str, setting: str = 'region') -> Region | None:
    """Return the region of a parameter; None for an empty one, which is the whole frame."""
    return Region(name, setting) if name else None
