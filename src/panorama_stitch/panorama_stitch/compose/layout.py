"""Layout: where each camera's view lies in the panorama, and where one gives way to the next."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import cv2
import numpy as np

from fisheye_geometry.surface import Surface
from panorama_stitch.compose.view import View

CROPS = ('valid', 'none')
_MAX_TRIM_DEG = 3.0
"""Columns at the far left and right that a crop may give up to gain rows."""


class Origin(NamedTuple):
    """Where the upper left pixel of a view lies, px of the first view."""

    x_px: float
    y_px: float


class Seam(NamedTuple):
    """Columns of the panorama in which a view fades into its right neighbour."""

    begin: int
    end: int


@dataclass(frozen=True)
class Layout:
    """Places for the views of all cameras.

    Attributes
    ----------
    surface
        What the panorama shows; its centre lies midway between the first axis and the last.
    origins
        Of each view, relative to the panorama's upper left pixel.
    seams
        One for each neighbouring pair, from left to right.
    """

    surface: Surface
    origins: tuple[Origin, ...]
    seams: tuple[Seam, ...]

    def drawn(self, index: int) -> tuple[int, int]:
        """Columns [begin, end) in which view `index` is drawn, those of its seams among them."""
        begin = self.seams[index - 1].begin if index else 0
        end = self.seams[index].end if index < len(self.seams) else self.surface.width
        return begin, end


def lay_out(
    views: Sequence[View],
    offsets: Sequence[tuple[float, float]],
    *,
    fade_px: float,
    crop: str,
) -> Layout:
    """Place the views beside each other.

    Parameters
    ----------
    views
        From left to right, on surfaces of one kind and focal length.
    offsets
        For each neighbouring pair: where the right view's upper left pixel lies in the left one.
    fade_px
        Width of the fade in the middle of an overlap; 0: the right view lies over the left one,
        as published.
    crop
        'valid': the panorama keeps the rows and columns that hold a picture everywhere;
        'none': everything.
    """
    origins = [Origin(0.0, 0.0)]
    for x_px, y_px in offsets:
        origins.append(Origin(origins[-1].x_px + x_px, origins[-1].y_px + y_px))
    spans = [
        (o.x_px, o.y_px, o.x_px + v.surface.width, o.y_px + v.surface.height)
        for o, v in zip(origins, views, strict=True)
    ]
    left, top, right, bottom = (
        round(pick(values))
        for pick, values in zip((min, min, max, max), zip(*spans, strict=True), strict=True)
    )
    first, last = (origins[i].x_px + views[i].surface.center_x_px for i in (0, len(views) - 1))
    surface = replace(
        views[0].surface,
        width=right - left,
        height=bottom - top,
        center_x_px=(first + last) / 2 - left,
        center_y_px=views[0].surface.center_y_px - top,
    )
    layout = Layout(
        surface,
        tuple(Origin(o.x_px - left, o.y_px - top) for o in origins),
        tuple(_seam(a[2] - left, b[0] - left, fade_px, right - left) for a, b in pairwise(spans)),
    )
    return layout if crop == 'none' else _cropped(layout, views)


def _seam(left_end: float, right_begin: float, fade_px: float, width: int) -> Seam:
    """Put the fade in the middle of the columns that both views share."""
    if not fade_px or right_begin >= left_end:
        # Drawn between its pixels, a view may lack the outermost one.
        at = round(right_begin) if right_begin == round(right_begin) else ceil(right_begin) + 1
        at = min(max(at, 0), width)
        return Seam(at, at)
    middle, half = (left_end + right_begin) / 2, min(fade_px, left_end - right_begin) / 2
    return Seam(max(round(middle - half), 0), min(round(middle + half), width))


def _cropped(layout: Layout, views: Sequence[View]) -> Layout:
    x, y, width, height = _valid_rectangle(covered(layout, views), layout.surface)
    return Layout(
        layout.surface.window(x, y, width, height),
        tuple(Origin(o.x_px - x, o.y_px - y) for o in layout.origins),
        tuple(Seam(*(min(max(edge - x, 0), width) for edge in seam)) for seam in layout.seams),
    )


def covered(layout: Layout, views: Sequence[View]) -> np.ndarray:
    """(height, width) bool: where the panorama surely shows something."""
    shape = (layout.surface.height, layout.surface.width)
    shown = np.zeros(shape, bool)
    for index, (view, origin) in enumerate(zip(views, layout.origins, strict=True)):
        begin, end = layout.drawn(index)
        x, y = round(origin.x_px), round(origin.y_px)
        valid = view.valid()
        if (x, y) != origin:
            # Drawn between its pixels, a view may lack the outermost ones.
            inner = np.ones((3, 3), np.uint8)
            valid = cv2.erode(valid.astype(np.uint8), inner, borderValue=0).astype(bool)
        begin, end = max(begin, x), min(end, x + valid.shape[1])
        top, bottom = max(0, y), min(shape[0], y + valid.shape[0])
        shown[top:bottom, begin:end] |= valid[top - y : bottom - y, begin - x : end - x]
    return shown


def _valid_rectangle(shown: np.ndarray, surface: Surface) -> tuple[int, int, int, int]:
    """Largest rectangle (x, y, width, height) without a hole that keeps nearly all columns.

    A driver needs the field of view to the sides, so only `_MAX_TRIM_DEG` of it are up for trade.
    """
    height, width = shown.shape
    middle = int(np.clip(round(surface.center_y_px), 0, height - 1))
    # In each column, the first and last row of the run that holds the horizon.
    above, below = ~shown[middle::-1], ~shown[middle:]
    top = np.where(above.any(axis=0), middle - above.argmax(axis=0) + 1, 0)
    bottom = np.where(below.any(axis=0), middle + below.argmax(axis=0) - 1, height - 1)
    trim = min(round(np.radians(_MAX_TRIM_DEG) * surface.focal_px), width // 8)
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
