"""Cropping: the largest part of a panorama that holds a picture everywhere."""

import numpy as np

from fisheye_geometry.surface import Surface

CROPS = ('valid', 'none')
_MAX_TRIM_DEG = 3.0
"""Columns at the far left and right that a crop may give up to gain rows."""


def valid_rectangle(
    shown: np.ndarray, surface: Surface, *, wraps: bool = False
) -> tuple[int, int, int, int]:
    """Largest rectangle (x, y, width, height) without a hole that keeps nearly all columns.

    A driver needs the field of view to the sides, so only `_MAX_TRIM_DEG` of it are up for trade,
    and nothing where the panorama `wraps`.
    """
    height, width = shown.shape
    middle = int(np.clip(round(surface.center_y_px), 0, height - 1))
    # In each column, the first and last row of the run that holds the horizon.
    above, below = ~shown[middle::-1], ~shown[middle:]
    top = np.where(above.any(axis=0), middle - above.argmax(axis=0) + 1, 0)
    bottom = np.where(below.any(axis=0), middle + below.argmax(axis=0) - 1, height - 1)
    trim = 0 if wraps else min(round(np.radians(_MAX_TRIM_DEG) * surface.focal_px), width // 8)
    inner = slice(trim, width - trim)
    best, rectangle = 0, (0, 0, width, height)
    # Running limits of what each trimmed column, from the inside out, would cost.
    left_top, left_bottom = _outward(
        top, bottom, inner, slice(trim - 1, None, -1) if trim else slice(0)
    )
    right_top, right_bottom = _outward(top, bottom, inner, slice(width - trim, None))
    for i in range(trim + 1):
        for j in range(trim + 1):
            first, last = max(left_top[i], right_top[j]), min(left_bottom[i], right_bottom[j])
            area = (width - 2 * trim + i + j) * (last - first + 1)
            if last >= first and area > best:
                best = area
                rectangle = (trim - i, int(first), width - 2 * trim + i + j, int(last - first + 1))
    return rectangle


def _outward(top, bottom, inner: slice, side: slice):
    """Limits of the rows that remain when 0, 1, ... columns of a side join the inner ones."""
    tops = np.concatenate([[top[inner].max()], top[side]])
    bottoms = np.concatenate([[bottom[inner].min()], bottom[side]])
    return np.maximum.accumulate(tops), np.minimum.accumulate(bottoms)
