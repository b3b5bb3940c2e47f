"""Bands: the rows that a remap draws at once, and what it reads of the picture for them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

_BAND_PX = 20_000
"""Rows are drawn in bands of about so many pixels of the picture, which stay in the cache."""
_STRIDE = 4
"""Columns from one that tells what a band needs to the next."""


class Band(NamedTuple):
    """Some rows of a surface.

    Attributes
    ----------
    rows
        Of the surface.
    fresh
        Rows and columns of the picture that are needed here, rows of the band above left out.
    """

    rows: slice
    fresh: tuple[slice, slice]


def band_rows(height: int, picture_width: int) -> Iterator[slice]:
    """Cut the rows of a surface into bands, for pictures of a width."""
    step = max(8, round(_BAND_PX / picture_width))
    for top in range(0, height, step):
        yield slice(top, min(top + step, height))


def bands_of(pixels: np.ndarray, valid: np.ndarray, picture_width: int) -> list[Band]:
    """Return the bands of a surface.

    Parameters
    ----------
    pixels
        (height, width, 2) int16: the pixel of the picture that each of the surface shows.
    valid
        (height, width) bool: where there is one.
    picture_width
        Of the picture, px.
    """
    bands, above = [], (range(0), range(0))
    for rows in band_rows(len(valid), picture_width):
        part = rows, slice(None, None, _STRIDE)
        needed = _needed(pixels[part][valid[part]])
        bands.append(Band(rows, _fresh(needed, above)))
        above = needed
    return bands


def _needed(pixels: np.ndarray) -> tuple[range, range]:
    """Rows and columns of the picture in which pixels (n, 2) lie."""
    if not len(pixels):
        return range(0), range(0)
    (left, top), (right, bottom) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
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
