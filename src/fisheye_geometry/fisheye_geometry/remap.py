"""Remap tables: where each pixel of a corrected picture comes from, computed once."""

from copy import copy
from functools import cached_property, lru_cache

import cv2
import numpy as np

from fisheye_core.errors import GeometryError, ImageFormatError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.band import Band, band_rows, bands_of
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface

INTERPOLATION_FLAGS = {
    'nearest': cv2.INTER_NEAREST,
    'linear': cv2.INTER_LINEAR,
    'cubic': cv2.INTER_CUBIC,
}
INTERPOLATIONS = tuple(INTERPOLATION_FLAGS)

OUTSIDE_PX = -100
"""Far enough from the picture that no interpolation reaches it."""


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
        attitude: Attitude = LEVEL,
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
        attitude
            Of the source in the frame of the surface.

        Raises
        ------
        GeometryError
            For an interpolation that is not known.
        """
        if interpolation not in INTERPOLATION_FLAGS:
            raise GeometryError(
                f"interpolation '{interpolation}' is not known; "
                f'expected one of {", ".join(INTERPOLATIONS)}'
            )
        shape = surface.height, surface.width
        self.surface = surface
        self._input_shape = (source.height, source.width)
        self._flag = INTERPOLATION_FLAGS[interpolation]
        self.valid: np.ndarray = np.empty(shape, bool)
        self._pixels: np.ndarray = np.empty((*shape, 2), np.int16)
        self._fractions: np.ndarray | None = None
        if interpolation != 'nearest':
            self._fractions = np.empty(shape, np.uint16)
        for rows in band_rows(surface.height, self._input_shape[1]):
            where, self.valid[rows] = _source_pixels(source, surface, attitude, rows)
            pixels, fractions = cv2.convertMaps(
                where, None, cv2.CV_16SC2, nninterpolation=self._fractions is None
            )
            self._pixels[rows] = pixels
            if self._fractions is not None:
                self._fractions[rows] = fractions
        self.valid.setflags(write=False)

    def part(self, rows: slice, columns: slice) -> 'RemapTable':
        """Return the table of a part of the surface; it shares no memory with this one."""
        part = copy(self)
        part.__dict__.pop('_bands', None)
        top, left = rows.start, columns.start
        part.surface = self.surface.window(left, top, columns.stop - left, rows.stop - top)
        part.valid = self.valid[rows, columns].copy()
        part._pixels = self._pixels[rows, columns].copy()
        if self._fractions is not None:
            part._fractions = self._fractions[rows, columns].copy()
        part.valid.setflags(write=False)
        return part

    @cached_property
    def _bands(self) -> list[Band]:
        return bands_of(self._pixels, self.valid, self._input_shape[1])

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
        for rows, fresh in self._bands:
            # Read in order, the picture comes from memory ahead of need; along curves it does not.
            cv2.sumElems(image[fresh])
            cv2.remap(
                image,
                self._pixels[rows],
                None if self._fractions is None else self._fractions[rows],
                self._flag,
                dst=out[rows],
                borderMode=cv2.BORDER_CONSTANT,
            )
        return out


@lru_cache(maxsize=4)
def remap_table(
    source: Lens | Surface,
    surface: Surface,
    interpolation: str = 'linear',
    attitude: Attitude = LEVEL,
) -> RemapTable:
    """Build a `RemapTable`, or give the one that was built from the same arguments.

    Parameters
    ----------
    source, surface, interpolation, attitude
        As `RemapTable` takes them.

    Returns
    -------
    RemapTable
        Shared with all who asked for the same; the last 4 are kept: one takes 7 bytes a pixel.

    Raises
    ------
    GeometryError
        For an interpolation that is not known.
    """
    return RemapTable(source, surface, interpolation, attitude)


def on_picture(source: Lens | Surface, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels (..., 2) of rays (..., 3) of a source, and which lie on its picture."""
    pixels, seen = source.project(rays)
    # A pixel is half a pixel wide to each side.
    last = np.array([source.width, source.height]) - 0.5
    return pixels, seen & np.all((pixels >= -0.5) & (pixels <= last), axis=-1)


def _source_pixels(
    source: Lens | Surface, surface: Surface, attitude: Attitude, rows: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (rows, width, 2) float32 of the source's picture, and where there are any."""
    y, x = np.ogrid[rows, : surface.width]
    pixels, seen = on_picture(source, surface.rays(x, y) @ attitude.matrix)
    # Beyond its centre the outermost pixel is repeated.
    last = np.array([source.width - 1, source.height - 1])
    where = np.where(seen[..., None], np.clip(pixels, 0, last), OUTSIDE_PX)
    return where.astype(np.float32), seen
