"""One camera's view: its pictures, and where they lie on the surface of the panorama."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fisheye_geometry.errors import ImageFormatError
from fisheye_geometry.lens import Lens
from fisheye_geometry.remap import LEVEL, RemapTable, Turn, remap_table
from fisheye_geometry.surface import Surface

Cut = Callable[[np.ndarray, np.ndarray], object]
"""Draws a part of a view: takes the camera's picture and the array to draw into."""


@dataclass(frozen=True, eq=False)
class View:
    """How one camera's pictures are corrected.

    Attributes
    ----------
    source
        What the pictures show: a lens's view, or a surface if they are corrected already.
    surface
        What they show once corrected.
    interpolation
        One of `fisheye_geometry.remap.INTERPOLATIONS`.
    turn
        The camera's attitude against a level rig.
    seen
        (source height, source width) bool: where the pictures show anything; None for everywhere.
    """

    source: Lens | Surface
    surface: Surface
    interpolation: str = 'linear'
    turn: Turn = LEVEL
    seen: np.ndarray | None = None

    @property
    def is_corrected(self) -> bool:
        """Whether the pictures need no warping, only placing."""
        return self.source == self.surface and self.turn == LEVEL

    def valid(self) -> np.ndarray:
        """(surface height, surface width) bool: where the corrected picture shows anything."""
        if self.is_corrected:
            return self._seen
        if self.seen is None:
            return self._table.valid
        return self.shown(self._table, self._table.valid.shape)

    def corrected(self, image: np.ndarray) -> np.ndarray:
        """Correct a whole picture; exactly 0 where nothing is seen and nowhere else."""
        if self.is_corrected:
            return image
        corrected = self._table(image)
        valid = self._table.valid
        floor = valid if image.ndim == 2 else np.repeat(valid[..., None], image.shape[2], axis=2)
        return np.maximum(corrected, floor, out=corrected)

    def cut(self, x_px: float, y_px: float, width: int, height: int) -> Cut:
        """Prepare to draw the part of the corrected picture whose upper left pixel is (x, y)."""
        if self.is_corrected:
            return _Copy(round(x_px), round(y_px), width, height, self.source)
        return self._drawn_on(self.surface.window(x_px, y_px, width, height))

    def samples(
        self, x_px: float, y_px: float, width: int, height: int, step: float
    ) -> RemapTable:
        """Prepare to draw only every `step`-th row and column of the same part."""
        window = self.surface.window(x_px, y_px, width, height)
        return self._drawn_on(window.with_focal(window.focal_px / step))

    def shown(self, cut: Cut, shape: tuple[int, int]) -> np.ndarray:
        """(height, width) bool: where a cut of that shape shows anything."""
        drawn = np.empty(shape, np.uint8)
        cut(self._seen.astype(np.uint8) * 255, drawn)
        return drawn == 255

    @property
    def _seen(self) -> np.ndarray:
        everywhere = np.ones((self.source.height, self.source.width), bool)
        return everywhere if self.seen is None else self.seen

    @property
    def _table(self) -> RemapTable:
        return remap_table(self.source, self.surface, self.interpolation, self.turn)

    def _drawn_on(self, surface: Surface) -> RemapTable:
        return RemapTable(self.source, surface, self.interpolation, self.turn)


class _Copy:
    """Draws a rectangle of a corrected picture; what lies outside of it is 0."""

    def __init__(self, x_px: int, y_px: int, width: int, height: int, source: Surface):
        left, top = max(0, -x_px), max(0, -y_px)
        right = max(left, min(width, source.width - x_px))
        bottom = max(top, min(height, source.height - y_px))
        self._to = np.s_[top:bottom, left:right]
        self._from = np.s_[top + y_px : bottom + y_px, left + x_px : right + x_px]
        self._is_whole = (left, top, right, bottom) == (0, 0, width, height)
        self._size = source.width, source.height

    def __call__(self, image: np.ndarray, out: np.ndarray) -> None:
        if image.shape[1::-1] != self._size:
            raise ImageFormatError(
                'the picture has {}x{} px; its projection is of {}x{} px'.format(
                    *image.shape[1::-1], *self._size
                )
            )
        if not self._is_whole:
            out[:] = 0
        out[self._to] = image[self._from]
