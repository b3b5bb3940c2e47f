"""Remap tables: where each pixel of a corrected picture comes from, computed once."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from fisheye_geometry.errors import GeometryError, ImageFormatError
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface

_INTERPOLATIONS = {
    'nearest': cv2.INTER_NEAREST,
    'linear': cv2.INTER_LINEAR,
    'cubic': cv2.INTER_CUBIC,
}
INTERPOLATIONS = tuple(_INTERPOLATIONS)

_OUTSIDE_PX = -100
"""Far enough from the picture that no interpolation reaches it."""
_BAND_PX = 20_000
"""Rows are drawn in bands of about so many pixels of the picture, which stay in the cache."""


@dataclass(frozen=True)
class Turn:
    """Attitude of a camera in the frame of its surface, rad.

    Yaw turns the camera to the right, pitch up, roll clockwise as the camera sees it, in the
    order yaw, pitch, roll.
    """

    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rad: float = 0.0

    @property
    def matrix(self) -> np.ndarray:
        """Rotation (3, 3) that takes rays of the camera to rays of the surface."""
        (cy, sy), (cp, sp), (cr, sr) = (
            (np.cos(angle), np.sin(angle))
            for angle in (self.yaw_rad, self.pitch_rad, self.roll_rad)
        )
        yaw = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        pitch = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
        roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
        return yaw @ pitch @ roll


LEVEL = Turn()


class _Band(NamedTuple):
    """Some rows of a surface.

    Attributes
    ----------
    rows
        Of the surface.
    pixels, fractions
        Fixed-point maps as `cv2.convertMaps` gives them.
    fresh
        Rows and columns of the picture that are needed here, rows of the band above left out.
    """

    rows: slice
    pixels: np.ndarray
    fractions: np.ndarray | None
    fresh: tuple[slice, slice]


class RemapTable:
    """Fixed-point maps from a picture to a surface.

    The picture is a camera's (seen through its lens) or itself on a surface, to be turned or cut.

    Attributes
    ----------
    surface : Surface
        What the corrected picture shows.
    valid : ndarray
        (height, width) bool, read-only: where the camera sees anything.
    """

    def __init__(
        self,
        source: Lens | Surface,
        surface: Surface,
        interpolation: str = 'linear',
        turn: Turn = LEVEL,
    ):
        """Compute the maps.

        Parameters
        ----------
        source
            What the picture shows: the camera's lens, or the surface that it is on already.
        surface
            What the corrected picture is to show.
        interpolation
            One of `INTERPOLATIONS`.
        turn
            Attitude of the source in the frame of the surface.

        Raises
        ------
        GeometryError
            For an interpolation that is not known.
        """
        if interpolation not in _INTERPOLATIONS:
            raise GeometryError(
                f"interpolation '{interpolation}' is not known; "
                f'expected one of {", ".join(INTERPOLATIONS)}'
            )
        self.surface = surface
        self._input_shape = (source.height, source.width)
        self._flag = _INTERPOLATIONS[interpolation]
        self.valid = np.empty((surface.height, surface.width), bool)
        self._bands = []
        needed = range(0), range(0)
        step = max(8, round(_BAND_PX / source.width))
        for top in range(0, surface.height, step):
            rows = slice(top, min(top + step, surface.height))
            where, self.valid[rows] = _source_pixels(source, surface, turn, rows)
            nearest = interpolation == 'nearest'
            pixels, fractions = cv2.convertMaps(where, None, cv2.CV_16SC2, nninterpolation=nearest)
            above, needed = needed, _needed(where[self.valid[rows]])
            band = _Band(rows, pixels, None if nearest else fractions, _fresh(needed, above))
            self._bands.append(band)
        self.valid.setflags(write=False)

    def __call__(self, image: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """Correct a picture.

        Parameters
        ----------
        image
            (height, width[, channels]) uint8 of the lens's size.
        out
            Where to put the result, a slice of a larger picture perhaps; a new array if None.

        Returns
        -------
        ndarray
            (surface.height, surface.width[, channels]) uint8, 0 where nothing is seen.

        Raises
        ------
        ImageFormatError
            If `image` has not the source's size, or `out` does not fit.
        """
        if image.shape[:2] != self._input_shape:
            height, width = self._input_shape
            raise ImageFormatError(
                f'the picture has {image.shape[1]}x{image.shape[0]} px; '
                f'its calibration is for {width}x{height} px'
            )
        expected = self.valid.shape + image.shape[2:]
        if out is None:
            out = np.empty(expected, image.dtype)
        if out.shape != expected or out.dtype != image.dtype:
            raise ImageFormatError(f'out is {out.dtype}{out.shape}; expected {expected}')
        for rows, pixels, fractions, fresh in self._bands:
            # Read in order, the picture comes from memory ahead of need; along curves it does not.
            cv2.sumElems(image[fresh])
            cv2.remap(
                image,
                pixels,
                fractions,
                self._flag,
                dst=out[rows],
                borderMode=cv2.BORDER_CONSTANT,
            )
        return out


@lru_cache(maxsize=16)
def remap_table(
    source: Lens | Surface,
    surface: Surface,
    interpolation: str = 'linear',
    turn: Turn = LEVEL,
) -> RemapTable:
    """Build a `RemapTable`, or give the one that was built from the same arguments.

    Parameters
    ----------
    source, surface, interpolation, turn
        As `RemapTable` takes them.

    Returns
    -------
    RemapTable
        Shared with all who asked for the same; the last 16 are kept.

    Raises
    ------
    GeometryError
        For an interpolation that is not known.
    """
    return RemapTable(source, surface, interpolation, turn)


def _source_pixels(source: Lens | Surface, surface: Surface, turn: Turn, rows: slice):
    """Pixels (rows, width, 2) float32 of the source's picture, and where there are any."""
    y, x = np.ogrid[rows, : surface.width]
    pixels, seen = source.project(surface.rays(x, y) @ turn.matrix)
    last = np.array([source.width - 1, source.height - 1])
    # A pixel is half a pixel wide to each side; beyond its centre the outermost is repeated.
    seen &= np.all((pixels >= -0.5) & (pixels <= last + 0.5), axis=-1)
    where = np.where(seen[..., None], np.clip(pixels, 0, last), _OUTSIDE_PX)
    return where.astype(np.float32), seen


def _needed(pixels: np.ndarray) -> tuple[range, range]:
    """Rows and columns of the picture in which pixels (n, 2) lie."""
    if not len(pixels):
        return range(0), range(0)
    (left, top), (right, bottom) = pixels.min(axis=0).astype(int), pixels.max(axis=0).astype(int)
    return range(top, bottom + 2), range(left, right + 2)


def _fresh(needed: tuple[range, range], above: tuple[range, range]) -> tuple[slice, slice]:
    """Leave out the rows that were needed above."""
    (rows, columns), (rows_above, _) = needed, above
    begin, end = rows.start, rows.stop
    if end > rows_above.stop:
        begin = max(begin, rows_above.stop)
    else:
        end = min(end, rows_above.start)
    return slice(begin, end), slice(columns.start, columns.stop)
