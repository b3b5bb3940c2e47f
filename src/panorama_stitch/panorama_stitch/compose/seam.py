"""Seams: the columns in which neighbouring views agree best, so that fading them blurs least."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, floor

import cv2
import numpy as np

from panorama_stitch.compose.layout import Layout, Seam
from panorama_stitch.compose.view import View

_LARGEST_DIFFERENCE = 40.0
"""Grey levels; what differs more is no worse."""
_NOISE = 1.0
"""Grey levels by which views differ anyway."""
_SHOWN_SHARE = 0.98
"""A seam shows at least so much of both views as one in the middle of the overlap."""


def settle_seams(layout: Layout, views: Sequence[View], group: Sequence[np.ndarray]) -> Layout:
    """Move each seam within its overlap to where the views differ least.

    The sides of a lens are its worst part, so that towards the edge of the overlap they have to
    differ up to half as much as in the middle to win.

    Parameters
    ----------
    layout
        With its seams in the middle of the overlaps.
    views
        From left to right.
    group
        A picture (height, width[, channels]) uint8 of each camera.
    """
    seams = tuple(_settled(layout, views, group, index) for index in range(len(layout.seams)))
    return replace(layout, seams=seams)


def _settled(layout: Layout, views, group, index: int) -> Seam:
    seam, surface = layout.seams[index], layout.surface
    left, right = layout.origins[index : index + 2]
    begin = max(ceil(right.x_px), layout.drawn(index)[0])
    end = min(floor(left.x_px + views[index].surface.width), layout.drawn(index + 1)[1])
    width = seam.end - seam.begin
    if not 0 < width < end - begin:
        return seam
    shape = surface.height, end - begin
    seen = np.ones(shape, bool)
    pictures = []
    for which, origin in ((index, left), (index + 1, right)):
        cut = views[which].cut(begin - origin.x_px, -origin.y_px, *shape[::-1])
        seen &= views[which].shown(cut, shape)
        picture = np.empty(shape + group[which].shape[2:], np.uint8)
        cut(group[which], picture)
        pictures.append(
            picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        )
    shown = _over(width, seen.mean(axis=0))
    difference = _over(width, _difference(*pictures, seen)) / np.maximum(shown, 1e-3)
    starts = begin + np.arange(len(shown))
    off_middle = (starts - seam.begin) / ((end - begin) / 2)
    price = (difference + _NOISE) * (1 + off_middle**2)
    price[shown < _SHOWN_SHARE * shown[np.abs(off_middle).argmin()]] = np.inf
    best = int(starts[price.argmin()])
    return Seam(best, best + width)


def _difference(left: np.ndarray, right: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Mean difference of brightness and of edges in each column, where both are seen."""
    left, right = left.astype(np.float32), right.astype(np.float32)
    right *= left[seen].sum() / max(right[seen].sum(), 1.0)
    difference = np.abs(left - right)
    for along in ((1, 0), (0, 1)):
        edges = cv2.Sobel(left, cv2.CV_32F, *along) - cv2.Sobel(right, cv2.CV_32F, *along)
        difference += np.abs(edges) / 8
    return (np.minimum(difference, _LARGEST_DIFFERENCE) * seen).mean(axis=0)


def _over(width: int, values: np.ndarray) -> np.ndarray:
    """Means of `width` neighbouring columns."""
    return np.convolve(values, np.full(width, 1 / width), 'valid')
