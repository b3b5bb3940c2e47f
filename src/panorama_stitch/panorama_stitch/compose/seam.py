"""Seams: the columns in which neighbouring views agree best, so that fading them blurs least."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from panorama_stitch.compose.layout import Layout, Seam, between, neighbours
from panorama_stitch.compose.placed import Placed, PlacedView

_LARGEST_DIFFERENCE = 40.0
"""Grey levels; what differs more is no worse."""
_NOISE = 1.0
"""Grey levels by which views differ anyway."""
_SHOWN_SHARE = 0.98
"""A seam shows at least so much of both views as one in the middle of the overlap."""


def optimise_seams(layout: Layout, placed: Placed, group: Sequence[np.ndarray]) -> Layout:
    """Move each seam within its overlap to where the views differ least.

    The sides of a lens are its worst part, so that towards the edge of the overlap they have to
    differ up to half as much as in the middle to win.

    Parameters
    ----------
    layout
        With its seams in the middle of the overlaps.
    placed
        What each camera shows where.
    group
        A picture (height, width[, channels]) uint8 of each camera.
    """
    seams = zip(layout.seams, neighbours(placed), strict=True)
    return replace(
        layout, seams=tuple(_settled(layout, *pair, group, seam) for seam, pair in seams)
    )


def _settled(layout: Layout, left: PlacedView, right: PlacedView, turn_px: int, group, seam: Seam):
    (x, y), surface = layout.origin, layout.surface
    begin, end = between(left, right, turn_px)
    if not layout.wraps:
        begin, end = max(begin, x), min(end, x + surface.width)
    width = seam.end - seam.begin
    if not 0 < width < end - begin:
        return seam
    rows = slice(y, y + surface.height)
    seen = np.ones((surface.height, end - begin), bool)
    pictures: list[np.ndarray] = []
    shows: list[np.ndarray] = []
    for view, moved in ((left, 0), (right, turn_px)):
        columns = slice(begin - moved, end - moved)
        shows.append(view.shows(rows, columns))
        seen &= shows[-1] & ~view.shows_body(rows, columns)
        picture: np.ndarray = view.cut(rows, columns)(group[view.index])
        pictures.append(
            picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        )
    shown = _over(width, seen.mean(axis=0))
    difference = _over(width, _difference(pictures[0], pictures[1], seen)) / np.maximum(
        shown, 1e-3
    )
    starts = begin - x + np.arange(len(shown))
    off_middle = (starts - seam.begin) / ((end - begin) / 2)
    price = (difference + _NOISE) * (1 + off_middle**2)
    price[shown < _SHOWN_SHARE * shown[np.abs(off_middle).argmin()]] = np.inf
    holes = _holes(shows[0], shows[1], width)
    price[holes > holes[np.abs(off_middle).argmin()]] = np.inf
    best = int(starts[price.argmin()])
    return Seam(best, best + width)


def _holes(left: np.ndarray, right: np.ndarray, width: int) -> np.ndarray:
    """Pixels that stay black for each place of a seam, as views (rows, columns) show them."""
    neither, no_left, no_right = (
        np.concatenate([[0], (~shows).sum(axis=0).cumsum()])
        for shows in (left | right, left, right)
    )
    return no_left[:-width] + neither[width:] - neither[:-width] + no_right[-1] - no_right[width:]


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
